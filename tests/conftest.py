# SPDX-License-Identifier: MIT
"""Settings of all tests: one thread of BLAS, property tests without clock and, in CI, chance."""

from __future__ import annotations

import gc
import os
import signal

import pytest
from hypothesis import HealthCheck, settings

# The matrices are small: threads that wait for each other take several times as much CPU time.
# Set before NumPy is imported; processes that tests start inherit it.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# A shell ignores SIGINT in its background jobs, and programs that tests start would inherit that.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Tests share the cores, so the duration of an example is no property of the code.
# In CI the examples are the same every day; `make nightly` searches longer, and elsewhere.
EXAMPLES = int(os.environ.get("HYPOTHESIS_EXAMPLES", "10"))
settings.register_profile(
    "default",
    deadline=None,
    max_examples=EXAMPLES,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile("ci", settings.get_profile("default"), derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "default")


def pytest_collection_finish() -> None:
    """Leave modules and collected tests out of garbage collections, which would visit them all."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session", autouse=True)
def _read_in_process() -> None:
    """Read binary logs in this process; the guard of hostile files has tests of its own."""
    from drivetwin.logs.formats.guarded import trust_parsers

    trust_parsers()

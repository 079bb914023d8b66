# SPDX-License-Identifier: MIT
"""Import path of the worker processes that tests of fleets start."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from tests.fleet.toys import ROOT


@pytest.fixture(autouse=True, scope="module")
def _set_import_path() -> Iterator[None]:
    """Worker processes import from the root of the repository."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(ROOT), prepend=os.pathsep)
        yield

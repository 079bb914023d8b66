# SPDX-License-Identifier: MIT
"""Settings of all tests: property tests depend on no clock, and in CI on no chance."""

from __future__ import annotations

import os

from hypothesis import HealthCheck, settings

# Tests share the cores, so the duration of an example is no property of the code.
settings.register_profile("default", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("ci", settings.get_profile("default"), derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "default")

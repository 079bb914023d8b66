# SPDX-License-Identifier: MIT
"""What tests of fleets share."""

from __future__ import annotations

import os

import pytest

from tests.fleet.toys import ROOT


@pytest.fixture(autouse=True)
def _workers_find_the_toys(monkeypatch: pytest.MonkeyPatch) -> None:
    """Worker processes import from the root of the repository."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT), prepend=os.pathsep)

# SPDX-License-Identifier: MIT
"""The public names: complete, what they say, and free until used."""

from __future__ import annotations

import subprocess
import sys

import pytest

import drivetwin


def test_every_public_name_resolves() -> None:
    for name in drivetwin.__all__:
        assert callable(getattr(drivetwin, name))
    assert len(drivetwin.__all__) > 10


def test_a_wrong_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'find_shift'"):
        getattr(drivetwin, "find_shift")  # noqa: B009


def test_importing_the_package_imports_nothing_heavy() -> None:
    code = "import sys, drivetwin; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert not {"numpy", "scipy", "plotly", "pydantic"} & set(run.stdout.split())

# SPDX-License-Identifier: MIT
"""The installed program."""

from __future__ import annotations

import os
import sys

import pytest

from drivetwin.__main__ import main


def test_linear_algebra_has_one_thread_unless_the_environment_says_otherwise(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    names = [f"{library}_NUM_THREADS" for library in ("OPENBLAS", "OMP", "MKL", "VECLIB")]
    for name in names:
        monkeypatch.setenv(name, "1")  # so that it is as before in the end
        monkeypatch.delenv(name)
    monkeypatch.setenv(names[0], "4")
    monkeypatch.setattr(sys, "argv", ["drivetwin", "--version"])
    assert main() == 0
    assert "drivetwin" in capsys.readouterr().out
    assert [os.environ[name] for name in names] == ["4", "1", "1", "1"]

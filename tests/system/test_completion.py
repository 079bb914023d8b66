# SPDX-License-Identifier: MIT
"""Completion of a line at the shell."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    ("line", "found"),
    [("drivetwin ide", ["identify"]), ("drivetwin identify --veh", ["--vehicle"])],
)
def test_a_line_is_completed(line: str, found: list[str]) -> None:
    asked = {"_DRIVETWIN_COMPLETE": "complete_bash", "COMP_WORDS": line}
    answer = subprocess.run(
        [sys.executable, "-m", "drivetwin"],
        env={**os.environ, **asked, "COMP_CWORD": str(len(line.split()) - 1)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert answer.stdout.split() == found

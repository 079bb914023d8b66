# SPDX-License-Identifier: MIT
"""Outcome of a command: the one form in which its result goes to every medium."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drivetwin.errors import DrivetwinError
from drivetwin.report.blocks import Block


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of a command.

    `blocks` are for people, `lines` below them are never wrapped; `document` is for programs;
    `files` were written. `is_confirmed` is false
    for a result that `--strict` refuses. `fault` is the error of a part, beside which the rest was
    done. `is_json` is true where the document is the result for people too.
    """

    blocks: Sequence[Block] = ()
    document: Mapping[str, Any] | None = None
    files: Sequence[Path] = ()
    is_confirmed: bool = True
    fault: DrivetwinError | None = None
    lines: Sequence[str] = ()
    is_json: bool = False

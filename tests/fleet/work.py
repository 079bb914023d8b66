# SPDX-License-Identifier: MIT
"""The function that takes the place of identification where only the fleet is tested.

What a file says is what happens to it: `bad`, `hang`, `eat`, `die`, `slow`, `unread`, or
`environment`, which counts the settings of memory as words, or nothing of the kind.
"""

from __future__ import annotations

import errno
import os
import signal
import time
from pathlib import Path
from typing import Any

from drivetwin.errors import FileFormatError
from drivetwin.fleet.task import Found, Row, RowKind, ShiftRow


def toy(task: Any) -> Found:
    """Rows and a shift that follow from the file's content alone."""
    words = Path(task.path).read_text().split()
    if "print" in words:
        print("not an answer")
        os.write(1, b"nor this\n")
    if "slow" in words:
        time.sleep(0.02)
    if "hang" in words:
        time.sleep(1e4)
    if "die" in words:
        os.kill(os.getpid(), signal.SIGKILL)
    if "eat" in words:
        held = [bytearray(b"x" * (8 * 2**20)) for _ in range(1000)]
        raise AssertionError(f"{len(held)} pieces of memory were to be had")
    if "environment" in words:
        words += [name for name in os.environ if name.startswith("MALLOC_")]
    if "unread" in words:
        raise OSError(errno.EIO, os.strerror(errno.EIO), task.path)
    if "bad" in words:
        raise FileFormatError("it says that it is bad", "make it a good one")
    name = f"P0.{words[0]}"
    rows = [Row(RowKind.PARAMETER, name, float(len(word)), 0.1, 0.2) for word in words]
    return Found(rows, [ShiftRow(True, 0.0, float(len(words)), "2", "3")])

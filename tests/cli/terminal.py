# SPDX-License-Identifier: MIT
"""The program in a terminal of its own, whose questions are answered."""

from __future__ import annotations

import os
import pty
import select
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

LIMIT = 90.0
"""Longest time [s] that the program may run."""
INTERRUPT = b"\x03"
"""Answer that interrupts the program, as Ctrl-C does."""


def run_in_terminal(
    arguments: Sequence[str], answers: Sequence[tuple[str, bytes]], folder: Path
) -> tuple[int, str]:
    """Run the program; return its exit code as a shell shows it and what it wrote.

    Each of the `answers` is sent as it is when its question, a part of the text since the answer
    before, has been asked.
    """
    terminal, end_of_program = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "drivetwin", *arguments],
        stdin=end_of_program, stdout=end_of_program, stderr=end_of_program, cwd=folder,
    )  # fmt: skip
    os.close(end_of_program)
    shown, since, waiting, interrupted = b"", 0, list(answers), False
    end = time.monotonic() + LIMIT
    while time.monotonic() < end:
        if select.select([terminal], [], [], 1.0)[0]:
            try:
                shown += os.read(terminal, 65536)
            except OSError:  # the program has ended
                break
        elif interrupted:  # the first came between the question and the wait for its answer
            process.send_signal(signal.SIGINT)
        asked = shown[since:]
        if waiting and asked.endswith(b": ") and waiting[0][0].encode() in asked:
            since = len(shown)
            answer = waiting.pop(0)[1]
            if answer == INTERRUPT:
                interrupted = True
                process.send_signal(signal.SIGINT)
            else:
                os.write(terminal, answer)
    else:
        process.kill()
    os.close(terminal)
    code = process.wait()
    assert not waiting, (waiting[0], shown.decode(errors="replace"))
    # A repeated interrupt may come while Python ends, which then ends by the signal itself.
    return 128 - code if code < 0 else code, shown.decode(errors="replace")

# SPDX-License-Identifier: MIT
"""Child processes: limits of the system on memory and computing time, and how one ended.

The limits hold where the system supports them: memory on Linux, computing time on every POSIX
system.
"""

from __future__ import annotations

import contextlib
import math
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import IO


def limit_memory(memory: int) -> None:
    """Make allocations fail beyond `memory` [bytes] more than the process has now.

    Mapped files do not count.
    """
    if sys.platform == "win32":
        return
    import resource

    status = Path("/proc/self/status")
    present = 0
    if status.exists():
        lines = dict(line.split(":", 1) for line in status.read_text().splitlines())
        present = 1024 * int(lines["VmData"].split()[0])
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    wanted = present + memory
    if hard == resource.RLIM_INFINITY or wanted < hard:
        resource.setrlimit(resource.RLIMIT_DATA, (wanted, hard))


def limit_computing_time(seconds: float) -> None:
    """Have the process ended once it has computed for `seconds` [s] more."""
    if sys.platform == "win32":
        return
    import resource

    usage = resource.getrusage(resource.RUSAGE_SELF)
    wanted = math.ceil(usage.ru_utime + usage.ru_stime + seconds)
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    if hard == resource.RLIM_INFINITY or wanted < hard:
        resource.setrlimit(resource.RLIMIT_CPU, (wanted, hard))


GRACE = 2.0
"""Time [s] for a child process to end by itself after its last task."""
_TAIL = 2000
"""Bytes at the end of what a child wrote to its standard error in which the last line is read."""


def end_process(process: subprocess.Popen[bytes], grace: float = GRACE) -> int:
    """Close the pipes of a child process and end it.

    Parameters
    ----------
    process
        The child; its pipes are closed.
    grace
        Time [s] that it may take to end by itself.

    Returns
    -------
    int
        Its exit code.
    """
    if process.stdin is not None:
        with contextlib.suppress(OSError):
            process.stdin.close()
    try:
        code = process.wait(grace)
    except subprocess.TimeoutExpired:
        process.kill()
        code = process.wait()
    if process.stdout is not None:
        process.stdout.close()
    return code


def describe_end(code: int | None, stderr: IO[bytes] | None = None) -> str:
    """Describe how a child process ended, with the last line of its standard error if given."""
    last = "" if stderr is None else _read_last_line(stderr)
    if code is not None and code < 0:
        return f"was killed by {signal.Signals(-code).name}{last}"
    return f"{BY_ITSELF} {code}{last}"


BY_ITSELF = "ended with code"
"""Beginning of the description of a process that ended by itself."""


def _read_last_line(stderr: IO[bytes]) -> str:
    stderr.seek(max(0, stderr.seek(0, os.SEEK_END) - _TAIL))
    lines = stderr.read().decode("utf-8", "replace").strip().splitlines()
    return f": {lines[-1][:300]}" if lines else ""

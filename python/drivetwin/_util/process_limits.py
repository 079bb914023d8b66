# SPDX-License-Identifier: MIT
"""Limits of the operating system on the memory and the computing time of this process.

They hold where the system supports them: memory on Linux, computing time on every POSIX system.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path


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

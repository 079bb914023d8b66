# SPDX-License-Identifier: MIT
"""Shares of the CPU time of a command by part of the program.

`python -m benchmarks.pipeline_profile COMMAND ...` runs `drivetwin COMMAND ...` in this process and
looks at the stack at equal intervals of CPU time. A sample counts for the innermost function
of the package on the stack, or as import where a module is being loaded. The process that reads
MDF files and other binary formats is not included; its time is printed as that of children.
"""

from __future__ import annotations

import resource
import signal
import sys
import time
from collections import Counter
from pathlib import Path
from types import FrameType

INTERVAL = 4e-3
"""CPU time [s] between two samples; the timers of common kernels are no finer."""

MOST_ROWS = 12
"""Parts and functions that are listed."""

PROFILE_MARK = "--- profile ---\n"
"""Line between the output of the command and its profile."""

_IMPORTING = "_find_and_load"
"""Function of the import system that is on the stack while a module is loaded."""


class Profile:
    """Counts of samples by part of the package and by function."""

    def __init__(self) -> None:
        self.parts: Counter[str] = Counter()
        self.functions: Counter[str] = Counter()

    def take_sample(self, _signal: int, frame: FrameType | None) -> None:
        """Count the stack of `frame`; the handler of the timer's signal."""
        place = ""
        while frame is not None:
            code = frame.f_code
            if code.co_name == _IMPORTING:
                self.parts["imports"] += 1
                return
            if not place and "/drivetwin/" in code.co_filename:
                module = code.co_filename.rpartition("/drivetwin/")[2].removesuffix(".py")
                place = f"{module}:{code.co_name}"
            frame = frame.f_back
        part = place.rpartition("/")[0] or place.partition(":")[0] or "other"
        self.parts[part] += 1
        self.functions[place or "other"] += 1

    def format_shares(self) -> str:
        """Return the shares [%] of the parts and of the functions, largest first."""
        total = max(self.parts.total(), 1)
        lines = [f"{time.process_time():.2f} s of CPU time, {total} samples"]
        for title, counts in (("part", self.parts), ("function", self.functions)):
            lines.append(f"{title}:")
            rows = counts.most_common(MOST_ROWS)
            lines += [f"  {100.0 * count / total:5.1f} %  {name}" for name, count in rows]
        return "\n".join(lines)


def main() -> int:
    """Run the command of the arguments and print its profile; return its exit code."""
    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python"))
    profile = Profile()
    signal.signal(signal.SIGPROF, profile.take_sample)
    signal.setitimer(signal.ITIMER_PROF, INTERVAL, INTERVAL)
    try:
        from drivetwin.__main__ import main as run

        return run()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        print(f"{PROFILE_MARK}{profile.format_shares()}")
        print(f"{children.ru_utime + children.ru_stime:.2f} s of CPU time in child processes")


if __name__ == "__main__":
    sys.exit(main())

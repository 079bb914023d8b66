# SPDX-License-Identifier: MIT
"""`python -m drivetwin`, and what the installed program calls."""

from __future__ import annotations

import os
import sys

from drivetwin.errors import INTERRUPTED

LINEAR_ALGEBRA = ("OPENBLAS", "OMP", "MKL", "VECLIB")
"""Libraries below NumPy that would start threads. With one each, unless the environment says
otherwise, results do not depend on the number of processors. The matrices are narrow: more threads
gain nothing, and where other programs run they wait for each other many times as long."""


def main() -> int:
    """Run the program; Ctrl-C ends it quietly even while it is still being loaded."""
    for library in LINEAR_ALGEBRA:  # before NumPy reads it
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    try:
        from drivetwin.cli import main as run

        return run()
    except KeyboardInterrupt:
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())

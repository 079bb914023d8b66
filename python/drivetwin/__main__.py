# SPDX-License-Identifier: MIT
"""`python -m drivetwin`, and what the installed program calls."""

from __future__ import annotations

import os
import sys

from drivetwin._util.atomic import interrupt_on_signals, was_interrupted
from drivetwin.errors import INTERRUPTED

LINEAR_ALGEBRA = ("OPENBLAS", "OMP", "MKL", "VECLIB")
"""Linear-algebra libraries below NumPy that start threads. Each is limited to one thread unless the
environment sets another number, so results do not depend on the number of processors. More threads
give no speed-up on the narrow matrices and slow the run down when other programs are active."""


def main() -> int:
    """Run the program; Ctrl-C or SIGTERM ends it quietly even while it is still being loaded."""
    for library in LINEAR_ALGEBRA:  # before NumPy reads it
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    try:
        interrupt_on_signals()
        from drivetwin.cli import main as run

        return run()
    except KeyboardInterrupt:
        return INTERRUPTED
    except Exception:
        if was_interrupted():
            return INTERRUPTED
        raise


if __name__ == "__main__":
    sys.exit(main())

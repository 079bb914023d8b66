# SPDX-License-Identifier: MIT
"""`python -m drivetwin`, and what the installed program calls."""

from __future__ import annotations

import sys

INTERRUPTED = 130
"""Exit code of a program that Ctrl-C stopped."""


def main() -> int:
    """Run the program; Ctrl-C ends it quietly even while it is still being loaded."""
    try:
        from drivetwin.cli import main as run

        return run()
    except KeyboardInterrupt:
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: MIT
"""Work limit of a search, counted in passes over the log.

The work is never timed, so a slow machine gives the same result as a fast one.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from drivetwin.errors import IdentificationError

RUN = 1.0
"""Passes that one evaluation of Q counts."""
EXPANSION = 8.0
"""Passes that one expansion of Q counts: as long as so many evaluations, whatever the log."""
WEIGHTING = 4.0
"""Passes that forming the covariance of Q anew counts."""
MAX_REFIT_WORK = 600.0
"""Work of a refit from a minimum: an element in the plant takes 3 to 6 expansions of about 30
passes, another minimum or sampling mode about 100 passes [passes]."""
REMEDY = "check ratios, clutch gains and P0 on the card against the log"
"""Remedy for the user if no search ends at a plausible minimum."""


class BudgetExceeded(IdentificationError):
    """The work limit of a search is exceeded."""


@dataclass
class Budget:
    """Remaining passes."""

    left: float


_present: ContextVar[Budget | None] = ContextVar("drivetwin_work", default=None)


@contextmanager
def limit_evaluations(passes: float) -> Iterator[Budget]:
    """Limit the work of all searches of this thread inside the block, in passes over the log."""
    meter = Budget(passes)
    token = _present.set(meter)
    try:
        yield meter
    finally:
        _present.reset(token)


def charge(passes: float) -> None:
    """Count work; free outside a block of `limit_evaluations`.

    Raises OutOfWork where none is left.
    """
    meter = _present.get()
    if meter is None:
        return
    meter.left -= passes
    if meter.left < 0.0:
        raise BudgetExceeded(
            "the optimiser did not converge within its iteration limit: its start was too far off, "
            "or the model does not describe this log",
            REMEDY,
        )

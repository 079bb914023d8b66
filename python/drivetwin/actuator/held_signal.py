# SPDX-License-Identifier: MIT
"""Signals that are held between their changes, as a controller commands them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import InputError, Where


@dataclass(frozen=True, eq=False)
class HeldSignal:
    """Values (n,) that hold from their time (n,) [s] to the next; the first holds before it too.

    Raises InputError for times that do not increase and for values that are not finite.
    """

    time: FloatArray
    values: FloatArray

    def __post_init__(self) -> None:
        if self.time.size == 0 or self.time.shape != self.values.shape:
            self._refuse(f"{self.time.size} times and {self.values.size} values")
        if not np.all(np.diff(self.time) > 0.0):
            self._refuse("times that do not increase")
        if not (np.isfinite(self.values).all() and np.isfinite(self.time).all()):
            self._refuse("numbers that are not finite")

    @staticmethod
    def _refuse(what: str) -> None:
        raise InputError(
            f"a held signal has {what}",
            "give a finite value for each of its increasing times",
            Where(key="command"),
        )

    def drop_repeated(self) -> HeldSignal:
        """Return the signal with its changes alone."""
        changed = np.concatenate([[True], np.diff(self.values) != 0.0])
        return HeldSignal(self.time[changed], self.values[changed])

    def evaluate(self, at: FloatArray) -> FloatArray:
        """Values at the times `at` (m,) [s]."""
        index = np.searchsorted(self.time, at, side="right") - 1
        return np.asarray(self.values[np.clip(index, 0, None)], dtype=np.float64)

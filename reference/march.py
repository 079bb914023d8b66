# SPDX-License-Identifier: MIT
"""Integration with SciPy from event to event: DOP853, located events, restart at each."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
Gap = Callable[[float, Array], float]
"""A function of time and state that ends the motion when it falls through zero."""

RTOL, ATOL = 1e-11, 1e-13
LONGEST_STEP = 2e-3
"""Longest step [s] where nothing else is said: events closer than this may hide each other."""
LOOK_AHEAD = 1e-9
"""Time [s] after which the sign of a kink that starts at zero is read."""


class March:
    """A state that is carried on piece by piece and observed at chosen instants."""

    def __init__(
        self, state: Sequence[float], instants: Array, longest_step: float = LONGEST_STEP
    ) -> None:
        self.longest_step = longest_step
        self.t = 0.0
        self.x: Array = np.array(state, dtype=np.float64)
        self.instants = instants
        self.observed: list[list[float]] = []

    def advance(
        self,
        rate: Callable[[float, Array], Array],
        end: float,
        gaps: Sequence[Gap],
        observe: Callable[[float, Array], Sequence[float]],
        kinks: Sequence[Gap] = (),
    ) -> int | None:
        """Go on to `end` or to the first gap that closes; its index, None at `end`.

        `kinks` pass through zero where the rate has a corner: the integration starts anew there.
        """
        soon = self.t + LOOK_AHEAD
        ahead = self.x + LOOK_AHEAD * rate(self.t, self.x)
        sides = [1.0 if kink(soon, ahead) > 0.0 else -1.0 for kink in kinks]
        while True:
            corners = [_times(kink, side) for kink, side in zip(kinks, sides, strict=True)]
            fired = self._piece(rate, end, [*gaps, *corners], observe)
            if fired is None or fired < len(gaps):
                return fired
            sides[fired - len(gaps)] *= -1.0

    def _piece(
        self,
        rate: Callable[[float, Array], Array],
        end: float,
        gaps: Sequence[Gap],
        observe: Callable[[float, Array], Sequence[float]],
    ) -> int | None:
        done = solve_ivp(
            rate,
            (self.t, end),
            self.x,
            method="DOP853",
            rtol=RTOL,
            atol=ATOL,
            max_step=self.longest_step,
            dense_output=True,
            events=[_closing(gap) for gap in gaps],
        )
        self.t, self.x = float(done.t[-1]), done.y[:, -1]
        assert done.sol is not None
        while len(self.observed) < self.instants.size:
            instant = float(self.instants[len(self.observed)])
            if instant > self.t:
                break
            self.observed.append([float(v) for v in observe(instant, done.sol(instant))])
        fired = [i for i, times in enumerate(done.t_events or []) if times.size]
        return fired[0] if fired else None

    def columns(self) -> list[Array]:
        """The observed quantities, each (n,) on the instants."""
        return list(np.array(self.observed).T)


def _times(gap: Gap, factor: float) -> Gap:
    return lambda t, x: factor * gap(t, x)


def _closing(gap: Gap) -> Gap:
    def event(t: float, x: Array) -> float:
        return gap(t, x)

    event.terminal = True  # type: ignore[attr-defined]
    event.direction = -1.0  # type: ignore[attr-defined]
    return event

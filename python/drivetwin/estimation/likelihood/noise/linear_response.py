# SPDX-License-Identifier: MIT
"""Discrete linear response of a run to small disturbances of its states and inputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dtbtrs

from drivetwin._util.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class LinearResponse:
    """Discrete linear response on a time grid of N points.

    `transition` (N-1, S, S) takes the disturbance z of S states from one point to the next; `drive`
    (N-1, S) by input name is the effect over a step of that input's disturbance; `step` (N-1,) [s].
    """

    step: FloatArray
    transition: FloatArray
    drive: Mapping[str, FloatArray]

    @property
    def states(self) -> int:
        """Number of states."""
        return int(self.transition.shape[1])

    def propagate_inputs(self, disturbance: Mapping[str, FloatArray]) -> FloatArray:
        """Compute z (N, S) for disturbances (N-1,) of inputs by name, from z = 0.

        Not finite where the run itself is unstable, as with a law that falls steeply with slip.
        """
        if not self.finite:
            return np.full((len(self.transition) + 1, self.states), np.nan)
        push = np.zeros(self.transition.shape[:2])
        for name, values in disturbance.items():
            push += self.drive[name] * values[:, None]
        return self.propagate(push)

    def propagate(self, push: FloatArray) -> FloatArray:
        """Compute z (N, S) for changes `push` (N-1, S) over the steps, from z = 0."""
        return self.propagate_columns(push[:, :, None])[:, :, 0]

    def propagate_columns(self, push: FloatArray) -> FloatArray:
        """Compute z (N, S, q) for q changes `push` (N-1, S, q) over the steps, from z = 0."""
        start = np.zeros((1, *push.shape[1:]))
        pushed = np.concatenate([start, push])
        return self._substitute(pushed.reshape(-1, push.shape[-1]), "N").reshape(pushed.shape)

    def propagate_adjoint(self, pull: FloatArray) -> FloatArray:
        """Apply the transpose of `propagate_columns`: (N-1, S, q) from weights `pull` (N, S, q) on
        z.
        """
        columns = pull.reshape(len(pull) * self.states, -1)
        return self._substitute(columns, "T").reshape(pull.shape)[1:]

    def _substitute(self, columns: FloatArray, way: str) -> FloatArray:
        """Solve with the banded matrix of unit diagonal, or its transpose (`way` "T")."""
        with np.errstate(over="ignore", invalid="ignore"):
            found, _ = dtbtrs(self._banded, columns, uplo="L", trans=way, diag="U")
        return np.asarray(found)

    @cached_property
    def _banded(self) -> FloatArray:
        """z_{k+1} - transition_k·z_k as a banded matrix (2S, S·N) of unit diagonal."""
        count, states = len(self.transition) + 1, self.states
        banded = np.zeros((2 * states, states * count))
        banded[0] = 1.0
        for i in range(states):
            for j in range(states):
                entries = -self.transition[:, i, j]
                banded[states + i - j, j : states * (count - 1) : states] = entries
        return banded

    @property
    def finite(self) -> bool:
        """True if all transitions are finite numbers."""
        return bool(np.all(np.isfinite(self.transition)))

# SPDX-License-Identifier: MIT
"""Correction of a twin by logged shifts of one vehicle, in a Bayes step by Gauss-Newton.

The prior is the twin's covariance together with the spread of made units; the likelihood is that of
the measured torque and speeds of each shift, which is simulated from its logged inputs.

Source: C. M. Bishop, Pattern Recognition and Machine Learning (2006), section 4.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import notify_progress, scale_progress
from drivetwin.calibration.spread import Spread
from drivetwin.calibration.vehicle_unknowns import VehicleUnknowns, build_unknowns
from drivetwin.errors import IdentificationError
from drivetwin.estimation.result.validation import Validation
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import LoggedShift

_ROUNDS = 12
"""Largest number of Gauss-Newton steps."""
_SETTLED = 0.05
"""Step in standard deviations of the result below which the correction ends."""
_DIFFERENCE = 0.1
"""Step of the differences, in standard deviations of the prior."""
_CORRELATION = 0.02
"""Time [s] within which errors of the model are the same: samples in it count as one."""
_LEAST_STEP = 0.02
"""Share of a step below which the correction ends."""
_LEAST_RMS = 1e-6
"""Deviation (SI) below which a signal counts as exact."""


@dataclass(frozen=True, eq=False)
class Correction:
    """Corrected twin; RMS deviations (SI) by signal over all shifts, `before` and `after`."""

    twin: Twin
    before: dict[str, float]
    after: dict[str, float]


def correct_twin(twin: Twin, logged: Sequence[LoggedShift], spread: Spread) -> Correction:
    """Correct a twin by shifts of one vehicle between the same two gears.

    Shifts join one after the other, each fit from the last result: from the twin itself all of them
    together may be so far away that no step gains.
    Raises IdentificationError where a simulation of them does not reach its end, and what
    `simulate_shift` raises.
    """
    unknowns = build_unknowns(twin, logged[0].shift, spread)
    first = [one.simulate(twin) for one in logged]
    z, covariance = np.zeros(unknowns.root.shape[1]), np.eye(unknowns.root.shape[1])
    before = _Shown(unknowns, logged, first).require(z)
    for count in range(1, len(logged) + 1):
        shown = _Shown(unknowns, logged[:count], first[:count])
        with scale_progress(((count - 1) / len(logged)) ** 2, (count / len(logged)) ** 2):
            z, covariance = shown.fit(z)
    after = _Shown(unknowns, logged, first).require(z)
    return Correction(unknowns.build_twin(z, covariance), _compute_rms(before), _compute_rms(after))


_Deviations = dict[str, FloatArray]
"""Measured minus simulated samples (n,) of all shifts by signal."""


@dataclass(frozen=True, eq=False)
class _Shown:
    """Logged shifts, simulated once by the twin."""

    unknowns: VehicleUnknowns
    logged: Sequence[LoggedShift]
    first: Sequence[Validation]

    def fit(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the likeliest values (m,) from `z` on, and their covariance (m, m)."""
        deviations, covariance = self.require(z), np.eye(z.size)
        for number in range(_ROUNDS):
            notify_progress(number / _ROUNDS)
            step, covariance = self.solve(z, deviations)
            if float(np.max(np.abs(step) / np.sqrt(np.diag(covariance)))) < _SETTLED:
                break
            found = self.search(z, step, deviations)
            if found is None:
                break
            z, deviations = found
        return z, covariance

    def require(self, z: FloatArray) -> _Deviations:
        """Compute the deviations of standardised values (m,).

        Raises IdentificationError where they are impossible.
        """
        deviations = self.compute(z)
        if deviations is None:
            raise IdentificationError(
                "the simulation of a logged shift by the twin does not reach its end",
                "check that the logs are of this vehicle, and identify it again",
            )
        return deviations

    def compute(self, z: FloatArray) -> _Deviations | None:
        """Compute the deviations of standardised values (m,); None where they are impossible."""
        if not self.unknowns.is_possible(z):
            return None
        twin = self.unknowns.build_twin(z, np.eye(z.size))
        parts: dict[str, list[FloatArray]] = {}
        for one, begun in zip(self.logged, self.first, strict=True):
            run = one.rerun(begun, twin)
            if run.status != "completed":
                return None
            low, high = begun.phases["torque"][0], begun.phases["after"][1]
            for name, trace in run.traces.items():
                inside = (trace.time >= low) & (trace.time <= high)
                parts.setdefault(name, []).append((trace.measured - trace.simulated)[inside])
        return {name: np.concatenate(values) for name, values in parts.items()}

    def solve(self, z: FloatArray, deviations: _Deviations) -> tuple[FloatArray, FloatArray]:
        """Return the step (m,) of Gauss-Newton and the covariance (m, m) after it."""
        weights = self._weigh(deviations)
        base = _stack(deviations, weights)
        columns = []
        for direction in np.eye(z.size):
            moved = self.compute(z + _DIFFERENCE * direction)
            change = 0.0 * base if moved is None else _stack(moved, weights) - base
            columns.append(-change / _DIFFERENCE)
        slope = np.stack(columns, axis=1)
        covariance = np.linalg.inv(slope.T @ slope + np.eye(z.size))
        return np.asarray(covariance @ (slope.T @ base - z)), np.asarray(covariance)

    def search(
        self, z: FloatArray, step: FloatArray, deviations: _Deviations
    ) -> tuple[FloatArray, _Deviations] | None:
        """Shorten a step until the posterior density rises; None where it does not."""
        weights = self._weigh(deviations)
        best, share = float(np.sum(_stack(deviations, weights) ** 2) + z @ z), 1.0
        while share >= _LEAST_STEP:
            tried = z + share * step
            found = self.compute(tried)
            if found is not None:
                value = float(np.sum(_stack(found, weights) ** 2) + tried @ tried)
                if value < best:
                    return tried, found
            share *= 0.5
        return None

    def _weigh(self, deviations: _Deviations) -> dict[str, float]:
        """Weight of a sample by signal: its errors have the size of the present deviations."""
        found = {}
        for name, values in deviations.items():
            period = min(one.get_period(name) for one in self.logged if name in one.log)
            alike = max(1.0, _CORRELATION / period)
            rms = max(float(np.sqrt(np.mean(values**2))), _LEAST_RMS)
            found[name] = 1.0 / (float(np.sqrt(alike)) * rms)
        return found


def _stack(deviations: _Deviations, weights: dict[str, float]) -> FloatArray:
    return np.concatenate([weights[name] * values for name, values in deviations.items()])


def _compute_rms(deviations: _Deviations) -> dict[str, float]:
    return {name: float(np.sqrt(np.mean(one**2))) for name, one in deviations.items()}

# SPDX-License-Identifier: MIT
"""Tests of what the fit leaves over: whiteness, and correlation with the inputs.

Q per sample hardly notices a wrong model (ESTIMATION: 1.10 where intervals covered 15 %), since
the error is slow and the noise is not. Averages over blocks show it: white noise leaves 1/m of
its power in means over m samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.driveline import Signal
from drivetwin.identify.likelihood.fit import LikelihoodFit
from drivetwin.identify.signals import FloatArray

BLOCK = 0.02
"""Length of a block [s]: a quarter of a period of a driveline oscillation."""
EXCESS = 1.6
"""Power of block means over that of white noise above which a warning is due."""
SIGNIFICANT = 5.0
"""Correlation with an input, in standard deviations of that of white noise, worth a warning."""


@dataclass(frozen=True)
class ResidualTest:
    """Residual of one output: `excess` power of its block means over white noise's, and its
    correlation with each input in units of the standard deviation that white noise would give."""

    output: str
    excess: float
    correlation: dict[str, float]

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the test says against the model, in words."""
        name = self.output.replace("_", " ")
        texts = []
        if self.excess > EXCESS:
            texts.append(
                f"the residual of the {name} is not white: over {1e3 * BLOCK:.0f} ms it has "
                f"{self.excess:.1f} times the power of noise; some effect is not in the model"
            )
        texts += [
            f"the residual of the {name} goes with the {source} ({size:+.0f} standard deviations)"
            for source, size in self.correlation.items()
            if abs(size) > SIGNIFICANT
        ]
        return tuple(texts)


def white_residuals(fit: LikelihoodFit) -> dict[str, dict[str, tuple[FloatArray, FloatArray]]]:
    """Times (n,) and residuals (n,) over their noise, input noise taken out, by shift and output.

    Of a right model they are white with variance one.
    """
    found: dict[str, dict[str, tuple[FloatArray, FloatArray]]] = {}
    for part, residual in zip(fit.problem.parts, fit.normal.residuals, strict=True):
        white = (residual - part.weighting.driven(residual)) / part.record.sigma
        first, outputs = 0, {}
        for out in part.record.outputs:
            e = white[first : first + out.values.size]
            first += out.values.size
            outputs[out.name] = (part.record.time[out.place], e)
        found[part.structure.label] = outputs
    return found


def block_means(time: FloatArray, white: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Middle times and means over blocks of `BLOCK`, scaled: white noise gives variance one."""
    size = max(2, round(BLOCK / float(np.median(np.diff(time)))))
    count = white.size // size
    means = white[: count * size].reshape(count, size).mean(axis=1)
    return time[: count * size].reshape(count, size).mean(axis=1), np.sqrt(size) * means


def residual_tests(fit: LikelihoodFit) -> dict[str, tuple[ResidualTest, ...]]:
    """Tests of every output by label of the shift."""
    found = {}
    for part, outputs in zip(fit.problem.parts, white_residuals(fit).values(), strict=True):
        inputs = {"engine torque": part.record.engine_torque} | {
            f"pressure of {name}": signal for name, signal in part.record.pressures.items()
        }
        found[part.structure.label] = tuple(
            _test(name, time, white, inputs) for name, (time, white) in outputs.items()
        )
    return found


def _test(
    name: str, time: FloatArray, white: FloatArray, inputs: dict[str, Signal]
) -> ResidualTest:
    _, means = block_means(time, white)
    excess = float(np.mean(means**2) / np.mean(white**2))
    correlation = {}
    for source, signal in inputs.items():
        x = np.interp(time, signal.time, signal.values)
        x = x - x.mean()
        norm = float(np.linalg.norm(x) * np.sqrt(np.mean(white**2)))
        correlation[source] = float(x @ white) / norm if norm > 0.0 else 0.0
    return ResidualTest(name, excess, correlation)

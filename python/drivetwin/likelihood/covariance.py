# SPDX-License-Identifier: MIT
"""Covariance of the unknowns, and directions that measurements do not identify."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.findings import Code, Finding, report
from drivetwin.likelihood.coloured_noise import compute_long_run_excess
from drivetwin.likelihood.objective import LikelihoodObjective
from drivetwin.likelihood.point import NormalEquations

MAX_RELATIVE_STD = 0.2
"""Relative standard deviation from which a direction counts as not identifiable."""
SHARE = 0.3
"""Share of a parameter in a direction from which it is named."""


def compute_covariance(
    problem: LikelihoodObjective[Any], normal: NormalEquations, chi2: float
) -> FloatArray:
    """Compute the covariance (p, p) at a minimum, widened by residual power beyond sensor noise.

    The whole is widened where `chi2` exceeds 1, and by slow errors where an output shows them, as
    far as the unknowns hang on that output.
    """
    inverse, counted = invert_information(normal.information), max(chi2, 1.0)
    return counted * inverse + inverse @ compute_long_run_excess(problem, normal, counted) @ inverse


def invert_information(matrix: FloatArray) -> FloatArray:
    """Invert an information matrix (p, p) after scaling to a unit diagonal."""
    scale = np.sqrt(np.diag(matrix))
    inverse = np.linalg.pinv(matrix / np.outer(scale, scale), rcond=1e-14, hermitian=True)
    return np.asarray(inverse / np.outer(scale, scale))


def report_null_directions(
    data: FloatArray, sizes: FloatArray, shown: Mapping[int, str], stated: str
) -> list[Finding]:
    """Return a finding for each direction that `data` (p, p) does not identify.

    `sizes` (p,) are those of the unknowns, `shown` the names of those that are reported, by
    number, `stated` what else determines them.
    """
    keep = list(shown)
    rest = [k for k in range(len(sizes)) if k not in shown]
    size = sizes[keep]
    relative = reduce_information(data, keep, rest) * np.outer(size, size)
    power, directions = np.linalg.eigh(relative)
    found = []
    for value, direction in zip(power, directions.T, strict=True):
        std = 1.0 / np.sqrt(max(float(value), 1e-12))
        if std < MAX_RELATIVE_STD:
            break
        strong = [k for k in np.argsort(-np.abs(direction)) if abs(direction[k]) > SHARE]
        named = " and ".join(shown[keep[k]] for k in strong)
        code = Code.NULL_DIRECTIONS if len(strong) > 1 else Code.NULL_DIRECTION
        found.append(report(code, parameters=named, stated=stated))
    return found


def reduce_information(matrix: FloatArray, keep: list[int], rest: list[int]) -> FloatArray:
    """Compute the information on `keep` with the `rest` unknown (Schur complement), after
    scaling."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    unit = matrix / np.outer(scale, scale)
    inner = np.linalg.pinv(unit[np.ix_(rest, rest)], rcond=1e-13, hermitian=True)
    cross = unit[np.ix_(keep, rest)]
    reduced = unit[np.ix_(keep, keep)] - cross @ inner @ cross.T
    return np.asarray(reduced * np.outer(scale[keep], scale[keep]))

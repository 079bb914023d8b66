# SPDX-License-Identifier: MIT
"""Joint distribution of estimates and friction laws, from which models are drawn."""

from __future__ import annotations

from dataclasses import dataclass

from drivetwin._util.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class JointCovariance:
    """Total `covariance` (n, n) over `ids`: parameters, and coefficients of friction laws by
    `make_law_id`."""

    ids: tuple[str, ...]
    covariance: FloatArray

# SPDX-License-Identifier: MIT
"""Parameters at a limit of the search: no minimum of theirs, but as far as one was looked for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin.display import in_units
from drivetwin.identify.likelihood.fit import LikelihoodFit
from drivetwin.identify.signals import FloatArray
from drivetwin.parameters import spec_of

AT = 1e-3
"""Distance from a bound, in standard deviations, within which an unknown stands on it."""


def at_limits(fit: LikelihoodFit, ids: Sequence[str], slopes: FloatArray) -> dict[str, str]:
    """What is said, by id, of parameters that are an unknown on one of its bounds.

    `slopes` (q, p) is the derivative of the parameters `ids` by the unknowns of the fit.
    """
    values, near = fit.point.values, AT * np.sqrt(np.diag(fit.covariance))
    below, above = values <= fit.problem.lower + near, values >= fit.problem.upper - near
    found = {}
    for name, row in zip(ids, slopes, strict=True):
        (acting,) = np.nonzero(row)
        if acting.size != 1 or not (below | above)[acting[0]]:
            continue
        side = "more" if above[acting[0]] else "less"
        limit = in_units(float(values[acting[0]]), spec_of(name).unit)
        found[name] = f"{limit} is the limit of the search: the log speaks for {side}"
    return found

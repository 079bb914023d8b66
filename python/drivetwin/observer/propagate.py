# SPDX-License-Identifier: MIT
"""The twin's uncertain parameters, as the observers take them."""

from __future__ import annotations

from collections.abc import Mapping

from drivetwin.errors import MissingParameterError, Where
from drivetwin.parameters import FINAL_DRIVE, make_ratio_id
from drivetwin.shifts.shift import Shift
from drivetwin.twin.distribution import ModelDistribution, describe_model
from drivetwin.twin.twin import Twin


def select_uncertain(
    twin: Twin,
    shift: Shift,
    stems: tuple[str, ...],
    more: Mapping[str, float] | None = None,
    *,
    laws: bool = False,
) -> ModelDistribution:
    """Describe the parameters `stems` of the twin and the ratios of the shift.

    `J_prime` stands for that of its `select_inertia_gear`. `more` are further standard deviations
    by id, of errors that are not the twin's. With `laws` the friction laws are part of it.
    Raises MissingParameterError where the twin has no value for one of them.
    """
    if twin.over_eta:
        raise MissingParameterError(
            "the twin has torques over η only, because its log had no output torque",
            "identify from a log that has one, or state eta on the vehicle card",
            Where(file=twin.name),
        )
    inertia = f"J_prime_{twin.select_inertia_gear(shift)}"
    ids = [inertia if stem == "J_prime" else stem for stem in stems]
    ratios = (make_ratio_id(shift.start_gear), make_ratio_id(shift.end_gear), FINAL_DRIVE)
    ids += [name for name in ratios if name in twin.covariance_ids]
    return describe_model(twin, shift, ids, more=more, laws=laws)

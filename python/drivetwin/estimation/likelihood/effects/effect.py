# SPDX-License-Identifier: MIT
"""Entry of an effect: meaning, prior size, columns of a fit, action in a synthetic log."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import SyntheticVehicle
from drivetwin.vehicle.effects import EffectId


@dataclass(frozen=True, eq=False)
class Disturbance:
    """Action of an effect on the driveline, or on the measured signals, over the steps of a run.

    `subject` is the element, gear or frequency to which the effect belongs; empty for one of the
    whole driveline. `force` (N-1, 4) acts on the speeds of engine, output and wheel [N m],
    `inputs` (N-1,) are changes of inputs by name, `outputs` (N,) direct changes of compared
    signals by name, `respond` computes a change (N, 4) of the state that is already a response.
    """

    subject: str = ""
    force: FloatArray | None = None
    inputs: Mapping[str, FloatArray] = field(default_factory=dict)
    outputs: Mapping[str, FloatArray] = field(default_factory=dict)
    respond: Callable[[], FloatArray] | None = None


Builder = Callable[[OperatingPoint, float], Sequence[Disturbance]]
"""Builds the columns of an effect at an operating point for one standard deviation of its prior,
given in the unit of the effect. Columns of one subject are independent; they form one group."""
Action = Callable[[SyntheticVehicle, float], SyntheticVehicle]
"""Applies an effect of a size above 0 to the vehicle of a synthetic log."""


@dataclass(frozen=True, eq=False)
class Effect:
    """One entry of the table of effects.

    `std` is the default standard deviation of its normal prior about zero in `unit`, `source` the
    reason for it. `meaning` completes "the log shows ..."; `remedy` is advice where it is found.
    A `random` effect is a sample of a random process: no single value of it can be stated.
    The columns grow with the `power` of the size, of which the amount has the sign. A `curved`
    effect is not proportional to that: a further step forms its column at the size found before,
    with the sign of that if the effect is `signed`.
    """

    id: EffectId
    meaning: str
    unit: str
    std: float
    source: str
    remedy: str
    build: Builder
    apply: Action
    random: bool = False
    power: float = 1.0
    curved: bool = False
    signed: bool = False
    has_columns: bool = True
    """False where no column at the minimum of the dual clutch describes the effect."""
    negative: str = ""
    """Meaning of a negative size, where its sign is not evident."""
    limit: float = math.inf
    """Size in a synthetic log from which a torque would reverse or a share exceed the whole."""
    on_sensor: bool = False
    """True where the effect changes the recorded output torque and leaves the motion as it is."""

    def scale_amount(self, amount: float, std: float) -> float:
        """Return the size of an `amount`, in units of the columns, of the stated size `std`."""
        return std * float(np.sign(amount) * np.abs(amount) ** (1.0 / self.power))

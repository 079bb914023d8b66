# SPDX-License-Identifier: MIT
"""Cause of a model mismatch that the log shows, and the spread of simulated signals it predicts."""

from __future__ import annotations

from dataclasses import dataclass

from drivetwin._util.arrays import FloatArray
from drivetwin.vehicle.effects import EffectId

EXPLAINED = 1.1
"""Residual power over that of noise up to which a model explains a log. A tenth is the uncertainty
of noise levels; beyond it something is missing from the model."""


@dataclass(frozen=True, eq=False)
class PredictedSpread:
    """Distribution at `time` (n,) [s] of a measured less a simulated signal if the model is right.

    `mean` (n,) is the action of the effects that the log shows and the simulation lacks, and of
    samples that are means over their period; `std` (n,) the standard deviation. Both are SI, speeds
    of the engine side those of the engine.
    """

    time: FloatArray
    mean: FloatArray
    std: FloatArray


SHOWN = 3.0
"""Log evidence from which an effect moves the values: odds of 20. Effects with less widen the
intervals, and the values stay those that simulate best without them."""
LEAD = 5.0
"""Log evidence from which a cause is named or an element put into the plant, and its lead over the
next cause from which it counts as found: odds of 150 to 1."""
WRONG_ENTRY = 10.0
"""Lead of log evidence of a wrong entry of the card over any effect: entries of a card are rarely
wrong (odds of e⁵ against it), and it must lead as a cause does (e⁵)."""


@dataclass(frozen=True)
class Group:
    """Columns that belong to one cause: an effect, and the element, gear or sensor that has it.

    `effect` is None for the stated tolerance of a sensor.
    """

    effect: EffectId | None
    subject: str = ""


@dataclass(frozen=True)
class Cause:
    """Cause that the log shows.

    `evidence` is the log evidence against its absence, `size` its estimate beside the other
    effects in its unit with `std`; for a random effect `size` is its root mean square in stated
    sizes and `std` None. `equivalent` are causes that the log cannot tell from it, `next_evidence`
    that of the best other one. `is_explained` is True where the fit with it explains the log by a
    plausible size of it; else the log shows something that resembles it.
    """

    group: Group
    evidence: float
    size: float
    std: float | None
    equivalent: tuple[Group, ...]
    next_evidence: float
    in_plant: bool = False
    """True for an element that the identified plant has beside the dual clutch."""
    is_explained: bool = True

    @property
    def is_alone(self) -> bool:
        """True if no other cause comes near in evidence."""
        return self.evidence - self.next_evidence >= LEAD

    @property
    def is_certain(self) -> bool:
        """True if it explains the log and no other cause comes near."""
        return self.is_explained and self.is_alone

# SPDX-License-Identifier: MIT
"""Values of a result: estimates, verdicts, friction curves, load law, suggested numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import DisplayMixin
from drivetwin.errors import suggest_spelling
from drivetwin.parameters import ParameterSpec, get_parameter_spec
from drivetwin.simulation.dual_clutch import RoadLoad, Stribeck
from drivetwin.vehicle.spec import Z95 as Z95  # the place where results look it up
from drivetwin.vehicle.spec import PriorValue

NARROWER = 0.9
"""Share of the present interval to which an experiment must narrow it to be worth recording."""


NONE_HELPS = "none of the known experiments narrows it by a tenth or more"


class CardNumberKind(StrEnum):
    """Kinds of numbers that a vehicle card can state."""

    PARAMETER = "parameter"
    EFFECT = "effect"
    SENSOR = "sensor error"


@dataclass(frozen=True)
class CardNumber:
    """Number of a vehicle card that would narrow the interval of a parameter if it were exact.

    `name` is a parameter id, the key of an effect, or `<role> gain`, `offset` or `delay` of a
    sensor; `subject` is the element or gear that has the effect. `share` is the width of the
    interval then over the present width.
    """

    kind: CardNumberKind
    name: str
    subject: str = ""
    share: float = 1.0

    def set_share(self, share: float) -> CardNumber:
        """Return the number with its gain."""
        return replace(self, share=share)

    @property
    def text(self) -> str:
        """The number as a phrase."""
        return f"{self.name} ({self.subject})" if self.subject else self.name


@dataclass(frozen=True)
class ExpectedPrecision:
    """Precision expected from an experiment: half width of the 95 % interval of a parameter, SI.

    `shift` names the gears of the shift on which the experiment is based; empty if all shifts of
    the log are between the same gears.
    """

    experiment: Experiment
    repeats: int
    half_width: float
    verdict: Verdict
    shift: str = ""


@dataclass(frozen=True)
class ExperimentRanking:
    """Experiments for one parameter, in order of worth, helpful or not.

    `half_width` is that of the present 95 % interval (noise and sensors), infinite without one.
    `limit` is the reason why no experiment helps; empty without one. `number` is the number of the
    card that narrows the parameter most.
    """

    parameter: str
    verdict: Verdict
    half_width: float
    prospects: tuple[ExpectedPrecision, ...]
    limit: str = ""
    number: CardNumber | None = None

    @property
    def best_number(self) -> CardNumber | None:
        """Number of the card, if it narrows the interval to `NARROWER` or less."""
        one = self.number
        return one if one is not None and one.share <= NARROWER else None

    @property
    def best(self) -> ExpectedPrecision | None:
        """First experiment that narrows the interval to `NARROWER` of its present width or less."""
        for one in self.prospects:
            is_identifiable = one.verdict is not Verdict.NOT_IDENTIFIABLE
            if is_identifiable and one.half_width <= NARROWER * self.half_width:
                return one
        return None

    @property
    def text(self) -> str:
        """Suggestion as a sentence, without units (those of the parameter)."""
        best = self.best
        if best is None:
            return self.limit or NONE_HELPS
        of = f" (shift {best.shift})" if best.shift else ""
        times = "" if best.repeats == 1 else f", {best.repeats} times"
        return f"{best.experiment}{of}{times}"


TORQUE_LEVEL = 0.6
"""Second torque level of a shift, in shares of the first."""


FIRMER, SOFTER = 1.3, 0.85
"""Pressures above P0 of the on-coming element, in shares of those of the log."""


class Experiment(StrEnum):
    """Kinds of recordings that can follow a log."""

    AGAIN = "the same shift again"
    THROTTLE_STEPS = "throttle steps in the lower gear"
    TORQUE_LEVEL = "a shift at 60 % of the engine torque"
    COAST_DOWN = "a coast-down of 6 s in gear"
    FIRMER = "the shift with 30 % more pressure"
    SOFTER = "the shift with 15 % less pressure, so that it slips longer"
    STILL_PEDAL = "the shift with the engine torque held still after lock-up"


OF_RATIO = ", μ over η"
"""Suffix of the method name for a friction curve that is μ/η."""


class Verdict(StrEnum):
    """Identifiability verdict of a parameter; DESIGN: the value is from the card, not the log."""

    IDENTIFIED = "identified"
    WEAK = "weak"
    NOT_IDENTIFIABLE = "not identifiable"
    DESIGN = "design value"


@dataclass(frozen=True)
class Estimate:
    """One parameter's value and uncertainty, SI.

    `std_noise` comes from the sensors' noise; `std_systematic` from the card's tolerances of gain,
    offset and delay, from delayed values in the log, and from effects that the model leaves out.
    `value` is None exactly when the verdict is `not identifiable`. `reason` contains the cause of
    a verdict other than `identified`, and the recording that would help. `spec` declares a quantity
    that is not in the parameter table.
    """

    id: str
    value: float | None
    std_noise: float | None
    verdict: Verdict
    method: str
    std_systematic: float | None = None
    reason: str = ""
    spec: ParameterSpec | None = None

    @property
    def unit(self) -> str:
        """SI unit from its declaration."""
        return (self.spec or get_parameter_spec(self.id)).unit

    @property
    def std_total(self) -> float | None:
        """Noise and systematic part together; None if the noise part is unknown."""
        if self.std_noise is None:
            return None
        return float(np.hypot(self.std_noise, self.std_systematic or 0.0))

    def _compute_interval(self, std: float | None) -> tuple[float, float] | None:
        if self.value is None or std is None:
            return None
        return (self.value - Z95 * std, self.value + Z95 * std)

    @property
    def ci95(self) -> tuple[float, float] | None:
        """95 % interval from noise alone."""
        return self._compute_interval(self.std_noise)

    @property
    def ci95_total(self) -> tuple[float, float] | None:
        """95 % interval with sensor tolerances and effects included; the one to show first."""
        return self._compute_interval(self.std_total)


class EstimatesMixin(DisplayMixin):
    """Base of results whose items are estimates by parameter id: `result["eta"]`."""

    estimates: Mapping[str, Estimate]

    def __getitem__(self, name: str) -> Estimate:
        """Return the estimate of a parameter. Raises KeyError that suggests a spelling."""
        if name not in self.estimates:
            raise KeyError(f"no parameter {name!r}{suggest_spelling(name, self.estimates)}")
        return self.estimates[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the parameter ids."""
        return iter(self.estimates)


@dataclass(frozen=True, eq=False)
class FrictionCurve(DisplayMixin):
    """μ over |slip| of one element, over the slip range seen; arrays (n,), slip in rad/s.

    `mu_lo`, `mu_hi` bound the 95 % band (total). `points_slip`, `points_mu` are the raw points
    behind it. `stribeck` is the fitted law, or None; `stribeck_covariance` (4, 4) is over its
    fields. `over_eta` marks a curve that is μ/η: no output torque gave μ its scale. μ holds for the
    `gain` N·D·A·r [m^3] of the vehicle card: the log determines μ times the gain. The band contains
    the standard deviation of the gain, the covariance of the law does not. `verdict` and `reason`
    are those of `mu_gain`; `design value` marks the law of a partner.
    """

    slip: FloatArray
    mu: FloatArray
    mu_lo: FloatArray
    mu_hi: FloatArray
    points_slip: FloatArray
    points_mu: FloatArray
    stribeck: Stribeck | None
    method: str
    stribeck_covariance: FloatArray | None = None
    over_eta: bool = False
    gain: PriorValue | None = None
    verdict: Verdict = Verdict.IDENTIFIED
    reason: str = ""

    @property
    def is_borrowed(self) -> bool:
        """True for the law of a partner: the log does not determine that of the element."""
        return self.verdict is Verdict.DESIGN

    @property
    def middle_slip(self) -> float:
        """Slip [rad/s] in the middle of the curve, at which `mu_gain` holds."""
        return 0.5 * float(self.slip[0] + self.slip[-1])

    @property
    def has_assumed_gain(self) -> bool:
        """True where μ is for a gain that nobody knows; μ times the gain is not affected."""
        return self.gain is not None and self.gain.assumed

    @property
    def verdict_text(self) -> str:
        """Verdict of μ, with what it depends on."""
        return self.verdict.value + (", for an assumed gain" if self.has_assumed_gain else "")

    @property
    def gain_spread(self) -> float:
        """Relative standard deviation of the gain; 0 where none is stated."""
        return 0.0 if self.gain is None else self.gain.std / self.gain.value

    def drop_gain_spread(self) -> FrictionCurve:
        """Return the curve as μ for an exact gain, with the band that μ times gain has."""
        if self.gain is None:
            return self
        spread = Z95 * self.mu * self.gain_spread
        below, above = (
            np.sqrt(np.maximum((end - self.mu) ** 2 - spread**2, 0.0))
            for end in (self.mu_lo, self.mu_hi)
        )
        exact = replace(self.gain, std=0.0)
        return replace(self, mu_lo=self.mu - below, mu_hi=self.mu + above, gain=exact)

    def add_gain_spread(self, gain: PriorValue) -> FrictionCurve:
        """Return the curve as μ for `gain`, whose standard deviation widens the band."""
        spread = Z95 * self.mu * gain.std / gain.value
        below, above = (np.hypot(end - self.mu, spread) for end in (self.mu_lo, self.mu_hi))
        return replace(self, mu_lo=self.mu - below, mu_hi=self.mu + above, gain=gain)

    @property
    def method_text(self) -> str:
        """The method as files and the report name it: with what the curve is over."""
        return self.method + OF_RATIO if self.over_eta else self.method

    @property
    def symbol(self) -> str:
        """Symbol of the curve in a formula."""
        return "μ/η" if self.over_eta else "μ"

    def scale(self, factor: float, std: float = 0.0) -> FrictionCurve:
        """Return μ times a factor, whose standard deviation widens the band."""
        mu, law = factor * self.mu, self.stribeck
        ends = (self.mu_lo, self.mu_hi)
        below, above = (np.hypot(factor * (end - self.mu), Z95 * std * self.mu) for end in ends)
        scale = np.array([factor, factor, 1.0, factor])
        covariance = self.stribeck_covariance
        if law is not None and covariance is not None:
            values = np.array([law.mu_c, law.mu_s, 0.0, law.mu_v])
            covariance = np.outer(scale, scale) * covariance + std**2 * np.outer(values, values)
        if law is not None:
            law = Stribeck(factor * law.mu_c, factor * law.mu_s, law.v_s, factor * law.mu_v)
        return replace(
            self,
            mu=mu,
            mu_lo=mu - below,
            mu_hi=mu + above,
            points_mu=factor * self.points_mu,
            stribeck=law,
            stribeck_covariance=covariance,
        )

    def scale_by_eta(self, eta: float, std: float = 0.0) -> FrictionCurve:
        """μ of a curve that is μ/η, from η and its standard deviation, which widens the band."""
        return replace(self.scale(eta, std), over_eta=False)


@dataclass(frozen=True)
class LoadLaw:
    """Load torque at the wheel as a function of the wheel's speed ω:

        T_v(ω) = i_f·(T_v/i_f) + aero·(ω·|ω| - mean_speed²)

    `aero` [N m s^2/rad^2] with its standard deviation (total); T_v/i_f, a parameter of its own,
    holds at `mean_speed` [rad/s], the wheel's mean over the fit. `divide_by_eta` marks a log
    without an output torque: `aero` is then divided by η, as T_v/i_f is.
    """

    aero: float
    std: float
    mean_speed: float
    over_eta: bool = False

    def scale_by_eta(self, eta: float, std: float = 0.0) -> LoadLaw:
        """The law of a log without an output torque, from η and its standard deviation."""
        spread = float(np.hypot(eta * self.std, std * self.aero))
        return replace(self, aero=eta * self.aero, std=spread, over_eta=False)

    def to_road_load(self, Tv_over_if: float, i_f: float) -> RoadLoad:
        """Convert the law to the parameters of the model."""
        constant = i_f * Tv_over_if - self.aero * self.mean_speed**2
        return RoadLoad(constant=constant, aero=self.aero)

# SPDX-License-Identifier: MIT
"""Values of a twin that logged shifts of one vehicle correct, with their prior distribution."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from drivetwin._util.arrays import FloatArray, propagate_variance
from drivetwin.calibration.scenarios import TwinDraws
from drivetwin.calibration.spread import Spread
from drivetwin.estimation.direct.friction_law import build_law_derivatives
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.estimation.result.estimate import Z95, Estimate, FrictionCurve, Verdict
from drivetwin.estimation.result.verdict import assess
from drivetwin.parameters import OVER_ETA, get_parameter_spec
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.added_elements import PROGRESSION, TYRE_SLIP
from drivetwin.twin.distribution import (
    build_partner_spread,
    collect_covariance,
    compute_friction_std,
    compute_law_covariance,
    has_possible_elements,
    to_law,
    to_values,
)
from drivetwin.twin.twin import (
    CAPACITY_SLOPE,
    PRESSURE_DELAY,
    SIMULATED,
    TORQUE_LAG,
    TORQUE_SHIFT,
    Twin,
)
from drivetwin.vehicle.effects import EffectId
from drivetwin.vehicle.spec import describe_partner_level


@dataclass(frozen=True, eq=False)
class FrictionUnknowns:
    """Values (k,) of the friction of an element, `mean` and `covariance` (k, k) before the logs.

    They are μ_c, μ_s - μ_c, μ_v and ln v_s of the law of `curve`; one scale of it without a law.
    """

    element: str
    curve: FrictionCurve
    mean: FloatArray
    covariance: FloatArray

    def is_possible(self, values: FloatArray) -> bool:
        """Return whether values (k,) make a friction above zero at rest and in slip."""
        return bool(values[0] > 0.0 and (values.size == 1 or values[0] + values[1] > 0.0))

    def build_curve(self, values: FloatArray, covariance: FloatArray, method: str) -> FrictionCurve:
        """Build the curve of values (k,) with their covariance (k, k), for the gain on the card."""
        exact = self.build_exact_curve(values, covariance, method)
        return exact if self.curve.gain is None else exact.add_gain_spread(self.curve.gain)

    def build_exact_curve(
        self, values: FloatArray, covariance: FloatArray, method: str
    ) -> FrictionCurve:
        """Build the curve of values (k,) with their covariance (k, k), for an exact gain."""
        curve, law, law_covariance = self.curve, None, None
        if curve.stribeck is None:
            scale, slopes = values[0] * np.ones_like(curve.mu), curve.mu[None]
        else:
            law = to_law(values)
            scale = law.evaluate(curve.slip) / curve.stribeck.evaluate(curve.slip)
            slopes = law.compute_slopes(curve.slip)
            back = build_law_derivatives(law.v_s)
            law_covariance = back @ covariance @ back.T
        half = Z95 * np.sqrt(propagate_variance(slopes.T, covariance))
        mu = scale * curve.mu
        place = np.interp(curve.points_slip, curve.slip, scale)
        return replace(
            curve.drop_gain_spread(),
            mu=mu,
            mu_lo=mu - half,
            mu_hi=mu + half,
            points_mu=place * curve.points_mu,
            stribeck=law,
            stribeck_covariance=law_covariance,
            method=method,
        )


def build_friction_unknowns(
    element: str, partner: str, twin: Twin, gain: float
) -> FrictionUnknowns:
    """Build the friction of an element of a made unit, whose gain has the spread `gain`.

    An element without a curve has that of its partner, from which it departs as in an
    identification of a clutch that only disengages.
    """
    own = twin.friction.get(element)
    curve = _borrow_curve(twin, element, partner) if own is None else own
    law, known = curve.stribeck, None if own is None else compute_law_covariance(own)
    mean = np.ones(1) if law is None else to_values(law)
    scaled = np.ones(1) if law is None else mean * np.array([1.0, 1.0, 1.0, 0.0])
    if own is None:
        gains = (twin.elements[name].gain_prior for name in (element, partner))
        covariance = _build_other_clutch(curve, describe_partner_level(*gains).std)
    elif known is not None:
        covariance = known
    else:
        covariance = compute_friction_std(curve) ** 2 * np.outer(scaled, scaled)
    return FrictionUnknowns(element, curve, mean, covariance + gain**2 * np.outer(scaled, scaled))


def _borrow_curve(twin: Twin, element: str, partner: str) -> FrictionCurve:
    """Return the friction curve of a partner as that of an element with a gain of its own."""
    curve = twin.friction[partner].drop_gain_spread()
    return curve if curve.gain is None else replace(curve, gain=twin.elements[element].gain_prior)


def _build_other_clutch(curve: FrictionCurve, level: float) -> FloatArray:
    """Covariance (k, k) of the friction of a clutch about that of another one; `level` is the
    standard deviation of their ratio."""
    if curve.stribeck is None:
        return np.array([[level**2]])
    return build_partner_spread(curve.stribeck, level)


METHOD = "logs of a calibration"
"""Name of the method in the estimates of a corrected twin."""
_LEAST = 1e-12
"""Variance below which a direction of the prior is fixed, over the largest one."""
_UNIT_STD = {"k_o": 0.03, "c_o": 0.2, "J_prime": 0.02, "J_vehicle": 0.02, "Tv_over_if": 0.05}
"""Relative standard deviations between made units, by stem, of what `Spread` leaves out:
engineering estimates (fuel and load of a vehicle; damping varies with oil and mounts)."""
_SHIFT_STD = 0.005
"""Standard deviation of the delay of the engine torque [s]: the request of a log is dated by its
pressures, which a bus shows up to a cycle of 10 ms late."""
_LEAST_LAG = 2e-5
"""Lag [s] that moves no signal by its noise."""
_SLOPE_STD = 0.10
"""Standard deviation of the change of μ over the pressure range of a shift; engineering estimate:
2 to 5 % per MPa of a lining, and springs and seals of the piston."""


@dataclass(frozen=True)
class LearnedValue:
    """Value of a parameter by id with its standard deviation, before and after the logs; SI."""

    id: str
    before: float
    before_std: float
    after: float
    after_std: float

    @property
    def unit(self) -> str:
        """SI unit."""
        return get_parameter_spec(self.id).unit

    @property
    def moved(self) -> float:
        """Change in standard deviations before the logs."""
        return (self.after - self.before) / self.before_std if self.before_std > 0.0 else 0.0


@dataclass(frozen=True)
class AddedUnknown:
    """Unknown that the twin's covariance does not contain: id, mean and standard deviation.

    Its values start from `lower`.
    """

    id: str
    mean: float
    std: float
    lower: float = -np.inf


ADDED_ELEMENTS = {
    TYRE_SLIP: AddedUnknown(TYRE_SLIP, 0.0, 0.005, 2e-4),
    PROGRESSION: AddedUnknown(PROGRESSION, 0.0, 0.10),
}
"""Sizes of elements that logs can add to a twin, by id.

Their standard deviations are the upper ends of typical ranges: a slip of 0.1 to 0.5 % at the
traction of a shift, and rubber couplings that stiffen by a tenth. Less slip than the lower bound
moves no signal by its noise.
"""


@dataclass(frozen=True, eq=False)
class VehicleUnknowns:
    """Values (n,) of one vehicle: parameters `ids` of the twin, then those of the friction.

    `mean` and `root` (n, m) are those of the prior: values are mean + root·z with z of the standard
    normal distribution, from `lower` (m,) on. The prior is the total covariance of the twin
    together with production scatter, of which the vehicle is one.
    """

    twin: Twin
    shift: Shift
    ids: tuple[str, ...]
    friction: tuple[FrictionUnknowns, ...]
    mean: FloatArray
    root: FloatArray
    lower: FloatArray

    @property
    def count(self) -> int:
        """Number m of standardised values."""
        return int(self.lower.size)

    def to_values(self, z: FloatArray) -> FloatArray:
        """Convert standardised values (m,) to values (n,)."""
        return np.asarray(self.mean + self.root @ z)

    def is_possible(self, z: FloatArray) -> bool:
        """Return whether parameters and friction are above zero; load and delay have any sign."""
        values = self.to_values(z)
        above = all(
            value > 0.0
            for name, value in zip(self.ids, values, strict=False)
            if get_parameter_spec(name).lower >= 0.0
        )
        above = above and has_possible_elements(dict(zip(self.ids, values.tolist(), strict=False)))
        return above and all(one.is_possible(values[part]) for one, part in self._pair_friction())

    def build_twin(self, z: FloatArray, covariance: FloatArray) -> Twin:
        """Build the twin with standardised values (m,) and their covariance (m, m).

        Parameters that no simulation depends on are left out: they belong to the old values.
        """
        values = self.to_values(z)
        total = self.root @ covariance @ self.root.T
        stds = np.sqrt(np.diag(total))
        twin, count = self.twin, len(self.ids)
        kept = {
            name: one
            for name, one in twin.parameters.items()
            if get_parameter_spec(name).stem in SIMULATED
        }
        changed = {
            name: _change(twin.parameters.get(name), name, float(value), float(std))
            for name, value, std in zip(self.ids, values, stds, strict=False)
        }
        moved = self._move_inertias({**kept, **changed})
        curves = {
            one.element: one.build_curve(values[part], total[part, part], METHOD)
            for one, part in self._pair_friction()
        }
        return replace(
            twin,
            parameters={**kept, **changed, **moved},
            friction={**twin.friction, **curves},
            covariance_ids=self.ids,
            covariance=np.asarray(total[:count, :count]),
        )

    def describe_values(self, z: FloatArray, covariance: FloatArray) -> tuple[LearnedValue, ...]:
        """Describe standardised values (m,) with their covariance (m, m) beside those before.

        The friction of an element is that at the middle slip of its curve, for an exact gain.
        """
        none, prior = np.zeros(z.size), self.root @ self.root.T
        total = self.root @ covariance @ self.root.T
        stds = [np.sqrt(np.diag(one)) for one in (prior, total)]
        pairs = zip(self.to_values(none), stds[0], self.to_values(z), stds[1], strict=True)
        count = len(self.ids)
        found = [
            LearnedValue(name, *map(float, row))
            for name, row in zip(self.ids, list(pairs)[:count], strict=True)
        ]
        for one, part in self._pair_friction():
            row: list[float] = []
            for values, spread in ((self.to_values(none), prior), (self.to_values(z), total)):
                curve = one.build_exact_curve(values[part], spread[part, part], METHOD)
                middle = curve.slip.size // 2
                mu = float(curve.mu[middle])
                row += [mu, (float(curve.mu_hi[middle]) - mu) / Z95]
            found.append(LearnedValue(f"mu.{one.element}", *row))
        return tuple(found)

    def _pair_friction(self) -> Iterator[tuple[FrictionUnknowns, slice]]:
        """Pair the friction of each element with the place of its values."""
        first = len(self.ids)
        for one in self.friction:
            yield one, slice(first, first + one.mean.size)
            first += one.mean.size

    def _move_inertias(self, changed: Mapping[str, Estimate]) -> dict[str, Estimate]:
        """Move J′ of the other gears: Je = J′ - Jo′/i_g² is the same in all."""
        twin, ending = self.twin, OVER_ETA if self.twin.over_eta else ""

        def read(parameters: Mapping[str, Estimate], name: str) -> float:
            one = parameters.get(name + ending)
            return float("nan") if one is None or one.value is None else one.value

        def measure(parameters: Mapping[str, Estimate], gear: str) -> float:
            share = read(parameters, "J_out") / twin.get_gear(gear).ratio ** 2
            return read(parameters, f"J_prime_{gear}") - share

        chosen = twin.select_inertia_gear(self.shift)
        rise = measure(changed, chosen) - measure(twin.parameters, chosen)
        found = {}
        for gear in twin.gears:
            name = f"J_prime_{gear}"
            value = read(changed, name) + rise + measure(twin.parameters, gear)
            value -= measure(changed, gear)
            if gear != chosen and np.isfinite(value):
                one = changed[name + ending]
                found[name + ending] = replace(one, value=value, method=METHOD)
        return found


def add_exact(twin: Twin, values: Mapping[str, float]) -> Twin:
    """Return the twin with exact values of parameters by id."""
    made = {
        name: Estimate(name, value, 0.0, Verdict.DESIGN, METHOD) for name, value in values.items()
    }
    return replace(twin, parameters={**twin.parameters, **made})


def list_added(twin: Twin, shift: Shift, *, commanded: bool) -> list[AddedUnknown]:
    """List the unknowns of the path from `commanded` profiles to the clutches; else there are none.

    A delay of the torque message and a lag of the torque cannot be separated, and a closed slip
    loop has no path.
    """
    if not commanded:
        return []
    slope = f"{CAPACITY_SLOPE}.{shift.oncoming}"
    lag, std = twin.get_value(TORQUE_LAG, 0.0), EFFECTS[EffectId.TORQUE_LAG].std
    return [
        AddedUnknown(slope, twin.get_value(slope, 0.0), _SLOPE_STD),
        AddedUnknown(TORQUE_LAG, lag, std, _LEAST_LAG),
        AddedUnknown(TORQUE_SHIFT, twin.get_value(TORQUE_SHIFT, 0.0), _SHIFT_STD),
    ]


def build_unknowns(
    twin: Twin, shift: Shift, spread: Spread, added: Sequence[AddedUnknown] = ()
) -> VehicleUnknowns:
    """Build the values of a vehicle that a shift depends on, with their prior."""
    elements = (shift.offgoing, shift.oncoming)
    contacts = tuple(
        name for name in (f"P0.{one}" for one in elements) if twin.get_value(name, 0.0) > 0.0
    )
    drawn = TwinDraws(twin, shift, spread).drawn_ids
    own_ids = {one.id for one in added}
    drawn = [name for name in drawn if name not in own_ids]
    ids = (*drawn, *(name for name in (*contacts, PRESSURE_DELAY) if name not in drawn))
    friction = tuple(
        build_friction_unknowns(one, partner, twin, spread.gain)
        for one, partner in (elements, elements[::-1])
    )
    own = [twin.get_value(name, 0.0) for name in ids]
    mean = np.concatenate([own, *(one.mean for one in friction)])
    known = collect_covariance(twin, ids)
    if PRESSURE_DELAY not in twin.covariance_ids:
        known[-1, -1] = EFFECTS[EffectId.PRESSURE_DELAY].std ** 2
    _add_spread(known, dict(zip(ids, own, strict=True)), spread)
    covariance = block_diag(known, *(one.covariance for one in friction))
    scale = np.where(mean == 0.0, 1.0, np.abs(mean))
    variances, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = variances > _LEAST * variances[-1]
    root = scale[:, None] * axes[:, kept] * np.sqrt(variances[kept])
    return VehicleUnknowns(
        twin,
        shift,
        (*ids, *(one.id for one in added)),
        friction,
        mean=np.insert(mean, len(ids), [one.mean for one in added]),
        root=_insert_axes(np.asarray(root), len(ids), [one.std for one in added]),
        lower=np.array(
            [-np.inf] * root.shape[1] + [(one.lower - one.mean) / one.std for one in added]
        ),
    )


def _insert_axes(root: FloatArray, place: int, stds: Sequence[float]) -> FloatArray:
    """Insert rows of independent values at `place` of a root (n, m), with axes of their own."""
    count, axes = len(stds), root.shape[1]
    found = np.zeros((root.shape[0] + count, axes + count))
    found[:place, :axes], found[place + count :, :axes] = root[:place], root[place:]
    found[place : place + count, axes:] = np.diag(stds)
    return found


def _add_spread(covariance: FloatArray, mean: Mapping[str, float], spread: Spread) -> None:
    """Add production scatter: the scale of the engine torque is one of η and of 1/J1.

    J′ is that of J1·η and stays. The contact pressure is common to both clutches.
    """
    direction = np.zeros(covariance.shape[0])
    for place, name in enumerate(mean):
        if name.removesuffix(OVER_ETA) == "eta":
            direction[place] = mean[name]
        std = _UNIT_STD.get(get_parameter_spec(name).stem, 0.0)
        covariance[place, place] += (std * mean[name]) ** 2
    covariance += spread.engine_torque**2 * np.outer(direction, direction)
    common = np.zeros(covariance.shape[0])
    common[[place for place, name in enumerate(mean) if name.startswith("P0.")]] = 1.0
    covariance += spread.contact_pressure**2 * np.outer(common, common)


def _change(before: Estimate | None, name: str, value: float, std: float) -> Estimate:
    if before is None:
        made = assess(name, value, std, METHOD)
        verdict = Verdict.WEAK if made.value is None else made.verdict
        return replace(made, value=value, std_noise=std, verdict=verdict)
    return replace(before, value=value, std_noise=std, std_systematic=None, method=METHOD)

# SPDX-License-Identifier: MIT
"""Values of a twin that logged shifts of one vehicle correct, with their prior distribution."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.scenarios import TwinDraws, compute_friction_std
from drivetwin.calibration.spread import Spread
from drivetwin.estimation.result.estimate import Z95, Estimate, FrictionCurve
from drivetwin.parameters import OVER_ETA, get_parameter_spec
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.dual_clutch import Stribeck
from drivetwin.twin.twin import SIMULATED, Twin

METHOD = "logs of a calibration"
"""Name of the method in the estimates of a corrected twin."""
_LEAST = 1e-12
"""Variance below which a direction of the prior is fixed, over the largest one."""


@dataclass(frozen=True, eq=False)
class VehicleUnknowns:
    """Values (n,) of one vehicle: parameters `ids` of the twin, then a scale of μ by element.

    `mean` and `root` (n, m) are those of the prior: values are mean + root·z with z of the standard
    normal distribution. The prior is the total covariance of the twin together with the spread of
    made units, of which the vehicle is one.
    """

    twin: Twin
    shift: Shift
    ids: tuple[str, ...]
    elements: tuple[str, ...]
    mean: FloatArray
    root: FloatArray

    def to_values(self, z: FloatArray) -> FloatArray:
        """Convert standardised values (m,) to values (n,)."""
        return np.asarray(self.mean + self.root @ z)

    def is_possible(self, z: FloatArray) -> bool:
        """Return whether all values are above zero; the load has any sign."""
        values = self.to_values(z)
        return all(
            value > 0.0
            for name, value in zip((*self.ids, *self.elements), values, strict=True)
            if not name.startswith("Tv_over_if")
        )

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
            name: _change(twin.parameters[name], float(value), float(std))
            for name, value, std in zip(self.ids, values, stds, strict=False)
        }
        moved = self._move_inertias({**kept, **changed})
        scales = zip(self.elements, values[count:], stds[count:], strict=True)
        curves = {
            name: _scale_curve(_find_curve(twin, name, self.elements), float(scale), float(std))
            for name, scale, std in scales
        }
        return replace(
            twin,
            parameters={**kept, **changed, **moved},
            friction={**twin.friction, **curves},
            covariance_ids=self.ids,
            covariance=np.asarray(total[:count, :count]),
        )

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


def build_unknowns(twin: Twin, shift: Shift, spread: Spread) -> VehicleUnknowns:
    """Build the values of a vehicle that a shift depends on, with their prior."""
    elements = (shift.offgoing, shift.oncoming)
    contacts = tuple(
        name for name in (f"P0.{one}" for one in elements) if twin.get_value(name, 0.0) > 0.0
    )
    drawn = TwinDraws(twin, shift, spread).drawn_ids
    ids = (*drawn, *(name for name in contacts if name not in drawn))
    mean = np.array([*(twin.get_value(name, 0.0) for name in ids), 1.0, 1.0])
    covariance = np.zeros((mean.size, mean.size))
    covariance[: len(ids), : len(ids)] = _collect_covariance(twin, ids)
    _add_spread(covariance, dict(zip(ids, mean, strict=False)), spread)
    for place, name in enumerate(elements, len(ids)):
        curve = _find_curve(twin, name, elements)
        covariance[place, place] = compute_friction_std(curve) ** 2 + spread.gain**2
    scale = np.where(mean == 0.0, 1.0, np.abs(mean))
    variances, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = variances > _LEAST * variances[-1]
    root = scale[:, None] * axes[:, kept] * np.sqrt(variances[kept])
    return VehicleUnknowns(twin, shift, ids, elements, mean, np.asarray(root))


def _collect_covariance(twin: Twin, ids: tuple[str, ...]) -> FloatArray:
    """Total covariance (n, n) of ids; zero where the twin has none."""
    found = np.zeros((len(ids), len(ids)))
    if twin.covariance is None:
        return found
    known = [k for k, name in enumerate(ids) if name in twin.covariance_ids]
    places = [twin.covariance_ids.index(ids[k]) for k in known]
    found[np.ix_(known, known)] = twin.covariance[np.ix_(places, places)]
    return found


def _add_spread(covariance: FloatArray, mean: Mapping[str, float], spread: Spread) -> None:
    """Add the spread of made units: the scale of the engine torque is one of η and of 1/J1.

    J′ is that of J1·η and stays. The contact pressure is common to both clutches.
    """
    direction = np.zeros(covariance.shape[0])
    for place, name in enumerate(mean):
        if name.removesuffix(OVER_ETA) == "eta":
            direction[place] = mean[name]
    covariance += spread.engine_torque**2 * np.outer(direction, direction)
    common = np.zeros(covariance.shape[0])
    common[[place for place, name in enumerate(mean) if name.startswith("P0.")]] = 1.0
    covariance += spread.contact_pressure**2 * np.outer(common, common)


def _find_curve(twin: Twin, name: str, elements: tuple[str, ...]) -> FrictionCurve | None:
    """Find the friction curve of an element, else that of its partner."""
    known = [twin.friction[one] for one in (name, *elements) if one in twin.friction]
    return known[0] if known else None


def _change(before: Estimate, value: float, std: float) -> Estimate:
    return replace(before, value=value, std_noise=std, std_systematic=None, method=METHOD)


def _scale_curve(curve: FrictionCurve | None, scale: float, std: float) -> FrictionCurve:
    """Scale a friction curve; its band is that of the scale."""
    assert curve is not None  # A twin without a curve has no model, and is refused before.
    mu, law = scale * curve.mu, curve.stribeck
    half = Z95 * std * np.abs(curve.mu)
    return replace(
        curve,
        mu=mu,
        mu_lo=mu - half,
        mu_hi=mu + half,
        points_mu=scale * curve.points_mu,
        stribeck=law and Stribeck(scale * law.mu_c, scale * law.mu_s, law.v_s, scale * law.mu_v),
        stribeck_covariance=None,
        method=METHOD,
    )

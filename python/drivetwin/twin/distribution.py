# SPDX-License-Identifier: MIT
"""Joint distribution of what the model of a shift depends on, its friction law included.

The one place from which drivelines are drawn: calibration and observer use it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag

from drivetwin._util.arrays import FloatArray, compute_directions, propagate_variance
from drivetwin.estimation.direct.friction_law import build_law_derivatives
from drivetwin.estimation.result.estimate import Z95, FrictionCurve
from drivetwin.parameters import LAW_KEYS, OVER_ETA, SPECS, make_law_id
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.added_elements import ADDED_ELEMENT_IDS, PROGRESSION
from drivetwin.simulation.dual_clutch import DualClutch, FrictionTable, ShiftElement, Stribeck
from drivetwin.twin.twin import Twin
from drivetwin.vehicle.spec import PARTNER_REST_STD, describe_partner_level


def to_values(law: Stribeck) -> FloatArray:
    """Return the values (4,) of a law."""
    return np.array([law.mu_c, law.mu_s - law.mu_c, law.mu_v, np.log(law.v_s)])


def to_law(values: FloatArray) -> Stribeck:
    """Return the law of values (4,)."""
    mu_c, drop, mu_v, ln_v_s = (float(one) for one in values)
    return Stribeck(mu_c, mu_c + drop, float(np.exp(ln_v_s)), mu_v)


def compute_law_covariance(curve: FrictionCurve) -> FloatArray | None:
    """Compute the covariance (4, 4) of the values of a curve; None where it has none."""
    if curve.stribeck is None or curve.stribeck_covariance is None:
        return None
    rows = np.asarray(np.linalg.inv(build_law_derivatives(curve.stribeck.v_s)), dtype=np.float64)
    return np.asarray(rows @ curve.stribeck_covariance @ rows.T)


def compute_friction_std(curve: FrictionCurve | None) -> float:
    """Relative standard deviation of μ times gain in the middle of its curve; 0 without one.

    That of the gain alone is left out: the motion depends on the product.
    """
    if curve is None:
        return 0.0
    curve = curve.drop_gain_spread()
    half = 0.5 * (curve.mu_hi - curve.mu_lo) / np.abs(curve.mu)
    half = half[np.isfinite(half)]
    return float(np.median(half)) / Z95 if half.size else 0.0


def compute_scale_std(curve: FrictionCurve | None) -> float:
    """Relative standard deviation of μ times gain beside the covariance of its law."""
    whole = compute_friction_std(curve)
    covariance = None if curve is None else compute_law_covariance(curve)
    if curve is None or curve.stribeck is None or covariance is None:
        return whole
    slopes = curve.stribeck.compute_slopes(curve.slip)
    variance = propagate_variance(slopes.T, covariance) / curve.mu**2
    return float(np.sqrt(max(whole**2 - float(np.median(variance)), 0.0)))


def build_partner_spread(law: Stribeck, level: float) -> FloatArray:
    """Build the covariance (4, 4) by which the values of an element's law depart from those of its
    partner's `law`, where the log does not determine them; `level` is the standard deviation of
    their ratio [-]."""
    scaled = to_values(law) * np.array([1.0, 1.0, 1.0, 0.0])
    rest = np.array([0.0, PARTNER_REST_STD, 0.0, 0.0])
    return level**2 * np.outer(scaled, scaled) + np.outer(rest, rest)


@dataclass(frozen=True, eq=False)
class ModelDistribution:
    """Normal distribution of parameters and friction laws of one shift.

    `values` (p,) and total `covariance` (p, p) are over `ids`: parameters, and coefficients of the
    friction laws by `make_law_id`. `scales` are relative standard deviations of μ by element that a
    friction curve has beside its law.
    """

    twin: Twin
    shift: Shift
    ids: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    scales: Mapping[str, float]

    @cached_property
    def directions(self) -> FloatArray:
        """Columns (p, r) of one standard deviation each, independent of each other."""
        return compute_directions(self.covariance)

    def to_named(self, values: FloatArray) -> dict[str, float]:
        """Return `values` (p,) by id."""
        return dict(zip(self.ids, values.tolist(), strict=True))

    def build_model(self, values: FloatArray) -> DualClutch:
        """Build the model at `values` (p,)."""
        named = self.to_named(values)
        used = self.twin.list_model_ids(self.shift)
        own = {
            plain: value
            for name, value in named.items()
            if (plain := name.removesuffix(OVER_ETA)) in used
        }
        model = self.twin.build_dual_clutch(self.shift, overrides=own)
        return replace(model, elements=tuple(_replace_law(one, named) for one in model.elements))

    def draw(self, random: np.random.Generator, directions: FloatArray) -> FloatArray:
        """Draw values (p,) along `directions` (p, r), which are those of this distribution."""
        return np.asarray(self.values + directions @ random.standard_normal(directions.shape[1]))

    def draw_model(self, values: FloatArray, random: np.random.Generator) -> DualClutch | None:
        """Build the model at drawn `values` (p,) and draw the scale of each friction curve.

        None where a value that must be positive is not, or one of an added element out of bounds.
        """
        named = self.to_named(values)
        signed = (*LAW_KEYS, "Tv_over_if", "te_delay", "p_delay", PROGRESSION)
        if any(value <= 0.0 and not name.startswith(signed) for name, value in named.items()):
            return None
        if not has_possible_elements(named):
            return None
        model = self.build_model(values)
        elements = tuple(
            scale_friction(one, float(random.normal(1.0, self.scales.get(one.name, 0.0))))
            for one in model.elements
        )
        laws = [one.friction for one in elements]
        if any(isinstance(law, Stribeck) and min(law.mu_c, law.mu_s) <= 0.0 for law in laws):
            return None
        return replace(model, elements=elements)


def has_possible_elements(named: Mapping[str, float]) -> bool:
    """Return whether the parameters of added elements in `named`, by id, are within bounds."""
    return all(abs(named.get(name, 0.0)) < SPECS[name].upper for name in ADDED_ELEMENT_IDS)


def describe_model(
    twin: Twin,
    shift: Shift,
    ids: Sequence[str],
    *,
    more: Mapping[str, float] | None = None,
    laws: bool = True,
) -> ModelDistribution:
    """Describe the parameters `ids` of a shift and, with `laws`, the friction of both elements.

    Parameters
    ----------
    twin, shift
        The identified model and the shift whose model is described.
    ids
        Parameter ids, those of a twin over η with that ending.
    more
        Further standard deviations by id, of errors that are not the twin's.
    laws
        False for a model whose friction laws do not act.
    """
    model = twin.build_dual_clutch(shift)
    fallback = {f"P0.{one.name}": one.P0 for one in model.elements}
    values = np.array([twin.get_value(name, fallback.get(name, 0.0)) for name in ids])
    covariance = collect_covariance(twin, ids)
    for k, name in enumerate(ids):
        estimate = twin.parameters.get(name)
        if covariance[k, k] == 0.0 and estimate is not None and estimate.std_total is not None:
            covariance[k, k] = estimate.std_total**2
        covariance[k, k] += (more or {}).get(name, 0.0) ** 2
    parameters = ModelDistribution(twin, shift, tuple(ids), values, covariance, {})
    return _add_laws(parameters, model, _collect_curves(twin)) if laws else parameters


def _add_laws(
    known: ModelDistribution, model: DualClutch, curves: Mapping[str, FrictionCurve]
) -> ModelDistribution:
    """Add the friction laws of the elements: by the joint covariance of the twin, else by that of
    the curve, else by the law of the partner."""
    twin, laws = known.twin, [one for one in model.elements if isinstance(one.friction, Stribeck)]
    law_ids = [make_law_id(one.name, key) for one in laws for key in LAW_KEYS]
    means = [to_values(one.friction) for one in laws if isinstance(one.friction, Stribeck)]
    scales = {one.name: compute_scale_std(curves.get(one.name)) for one in model.elements}
    level = describe_partner_level(*(twin.elements[one.name].gain_prior for one in model.elements))
    for one in model.elements:
        if one.name not in curves and not isinstance(one.friction, Stribeck):
            scales[one.name] = float(np.hypot(scales[one.name], level.std))
    ids = (*known.ids, *law_ids)
    if all(name in twin.covariance_ids for name in law_ids):
        eta = twin.get_value("eta", 1.0) if twin.over_eta else 1.0
        factor = np.array([eta, eta, eta, 1.0] * len(laws))
        scale = np.concatenate([np.ones(len(known.ids)), factor])
        covariance = np.outer(scale, scale) * collect_covariance(twin, ids)
        size = len(known.ids)
        covariance[:size, :size] = known.covariance
    else:
        blocks = [_describe_law(one, curves, level.std) for one in laws]
        covariance = block_diag(known.covariance, *blocks)
    values = np.concatenate([known.values, *means])
    return replace(known, ids=ids, values=values, covariance=covariance, scales=scales)


def _describe_law(
    one: ShiftElement, curves: Mapping[str, FrictionCurve], level: float
) -> FloatArray:
    """Covariance (4, 4) of the law of an element by itself; `level` is that of a partner's law."""
    own = curves.get(one.name)
    if own is None and isinstance(one.friction, Stribeck):
        return build_partner_spread(one.friction, level)
    covariance = None if own is None else compute_law_covariance(own)
    return np.zeros((4, 4)) if covariance is None else covariance


def collect_covariance(twin: Twin, ids: Sequence[str]) -> FloatArray:
    """Total covariance (n, n) of ids; zero where the twin has none."""
    found = np.zeros((len(ids), len(ids)))
    if twin.covariance is None:
        return found
    known = [k for k, name in enumerate(ids) if name in twin.covariance_ids]
    place = [twin.covariance_ids.index(ids[k]) for k in known]
    found[np.ix_(known, known)] = twin.covariance[np.ix_(place, place)]
    return found


def _collect_curves(twin: Twin) -> dict[str, FrictionCurve]:
    """Curves of μ by element; one over η is scaled as in the model."""
    eta = twin.get_value("eta", 1.0)
    return {
        name: curve.scale_by_eta(eta) if curve.over_eta else curve
        for name, curve in twin.friction.items()
    }


def _replace_law(one: ShiftElement, named: Mapping[str, float]) -> ShiftElement:
    """Return an element with the law that `named` contains for it."""
    values = [named.get(make_law_id(one.name, key)) for key in LAW_KEYS]
    if any(value is None for value in values):
        return one
    return replace(one, friction=to_law(np.array(values, dtype=float)))


def scale_friction(element: ShiftElement, scale: float) -> ShiftElement:
    """Return the element with its friction coefficient times `scale`."""
    law = element.friction
    if isinstance(law, FrictionTable):
        friction: Stribeck | FrictionTable = FrictionTable(
            law.slip, tuple(scale * value for value in law.mu)
        )
    else:
        friction = Stribeck(scale * law.mu_c, scale * law.mu_s, law.v_s, scale * law.mu_v)
    return replace(element, friction=friction)

# SPDX-License-Identifier: MIT
"""The twin's uncertain parameters: values, covariance, and the models they make."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.errors import MissingParameterError, Where
from drivetwin.observer.result import FloatArray
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.dual_clutch import DualClutch, ShiftElement, Stribeck
from drivetwin.twin.twin import Twin

LEVEL = 0.05
"""Relative standard deviation of the friction of an element whose own curve is not known."""


@dataclass(frozen=True, eq=False)
class Uncertain:
    """Parameters of a shift's model by id with `values` (p,) and `covariance` (p, p), total.

    A parameter without an interval of its own counts as known.
    """

    twin: Twin
    shift: Shift
    ids: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray

    def build_model(self, values: FloatArray) -> DualClutch:
        """The model at other `values` (p,) of the parameters."""
        named = self.to_named(values)
        own = {name: named[name] for name in self.ids if name != "te_delay"}
        return self.twin.build_dual_clutch(self.shift, overrides=own)

    def to_named(self, values: FloatArray) -> Mapping[str, float]:
        """Return the `values` (p,) by parameter id."""
        return dict(zip(self.ids, values.tolist(), strict=True))

    @property
    def directions(self) -> FloatArray:
        """Columns (p, r) of one standard deviation each, independent of each other."""
        scale = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        unit = self.covariance / np.outer(*(np.where(scale > 0.0, scale, np.inf),) * 2)
        power, axes = np.linalg.eigh(unit)
        kept = power > 1e-9 * max(1.0, float(power[-1]))
        return np.asarray(scale[:, None] * axes[:, kept] * np.sqrt(power[kept]))


def select_uncertain(
    twin: Twin, shift: Shift, stems: tuple[str, ...], more: Mapping[str, float] | None = None
) -> Uncertain:
    """The parameters `stems` of the twin; `J_prime` stands for that of its `select_inertia_gear`.

    `more` are further standard deviations by id, of errors that are not the twin's.
    Raises MissingParameterError where the twin has no value for one of them.
    """
    if twin.over_eta:
        raise MissingParameterError(
            "the twin has torques over η only, because its log had no output torque",
            "identify from a log that has one, or state eta on the vehicle card",
            Where(file=twin.name),
        )
    model = twin.build_dual_clutch(shift)
    inertia = f"J_prime_{twin.select_inertia_gear(shift)}"
    ids = tuple(inertia if stem == "J_prime" else stem for stem in stems)
    fallback = {f"P0.{one.name}": one.P0 for one in model.elements}
    values = np.array([twin.get_value(name, fallback.get(name, 0.0)) for name in ids])
    covariance = np.zeros((len(ids), len(ids)))
    if twin.covariance is not None:
        known = [k for k, name in enumerate(ids) if name in twin.covariance_ids]
        place = [twin.covariance_ids.index(ids[k]) for k in known]
        covariance[np.ix_(known, known)] = twin.covariance[np.ix_(place, place)]
    for k, name in enumerate(ids):
        estimate = twin.parameters.get(name)
        if covariance[k, k] == 0.0 and estimate is not None and estimate.std_total is not None:
            covariance[k, k] = estimate.std_total**2
        covariance[k, k] += (more or {}).get(name, 0.0) ** 2
    return Uncertain(twin, shift, ids, values, covariance)


def sample_friction(
    model: DualClutch, twin: Twin, rng: np.random.Generator
) -> tuple[ShiftElement, ...]:
    """Sample the friction of the elements of `model` from the twin's uncertainty."""
    drawn = []
    for one in model.elements:
        curve = twin.friction.get(one.name)
        law = one.friction
        if not isinstance(law, Stribeck):
            drawn.append(one)
            continue
        if curve is None or curve.stribeck_covariance is None:
            factor = 1.0 + LEVEL * rng.standard_normal()
            law = replace(law, mu_c=law.mu_c * factor, mu_s=law.mu_s * factor)
        else:
            mean = np.array([law.mu_c, law.mu_s, law.v_s, law.mu_v])
            mu_c, mu_s, v_s, mu_v = rng.multivariate_normal(
                mean, curve.stribeck_covariance, check_valid="ignore"
            ).tolist()
            law = Stribeck(mu_c, mu_s, max(v_s, 0.1 * law.v_s), mu_v)
        drawn.append(replace(one, friction=law))
    return tuple(drawn)

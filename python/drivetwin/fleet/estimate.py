# SPDX-License-Identifier: MIT
"""Joint estimates of a store: shared values with units' deviations, ageing, outliers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from drivetwin.fleet.mixed import (
    Drift,
    FloatArray,
    IntArray,
    JointEstimate,
    MixedFit,
    Observations,
    Outlier,
    Points,
    UnitValue,
    fit_mixed_model,
)
from drivetwin.fleet.observations import (
    LogFacts,
    Observed,
    attach_reasons,
    collect_facts,
    collect_observations,
)
from drivetwin.fleet.store import Store
from drivetwin.fleet.task import RowKind
from drivetwin.parameters import get_parameter_spec

Mask = NDArray[np.bool_]

_KNOWN_SHARE = 0.8
"""Share of logs that must have a field for it to count."""
_LOGS_PER_UNIT = 4.0
"""Logs per unit on average from which units may differ in their drift."""
_ALIKE = 0.98
"""Correlation of two fields beyond which their effects are not separable."""
_ROUNDS = 5
_MIXED = (
    "logs identified with {} different settings are taken together (card, channel mapping, method "
    "or version of the program; the tables 'logs' and 'settings' contain both)"
)


def estimate_fleet(store: Store, wanted: Sequence[str] = ()) -> list[JointEstimate]:
    """Estimate all parameters, or the `wanted` ones by id, over the fleet.

    Parameters with too few logs for that, fewer than four more than unknowns, are left out.
    """
    known = collect_facts(store)
    plain = {log: fact for log, (_, fact) in known.items()}
    found = []
    for seen in collect_observations(store, known):
        if not wanted or seen.parameter in wanted:
            one = estimate_parameter(seen, plain)
            if one is not None:
                found.append(one)
    return attach_reasons(store, found)


def list_missing_estimates(
    store: Store, found: Sequence[JointEstimate], wanted: Sequence[str] = ()
) -> list[str]:
    """List the parameters of a store, or the `wanted` ones, without a joint estimate, by id.

    A parameter has none if too few logs determine it, or if all have the card's design value.
    """
    names = store.read_rows(RowKind.PARAMETER).column("name").to_pylist()
    judged = {one.parameter for one in found}
    return [name for name in dict.fromkeys(wanted or names) if name not in judged]


@dataclass(frozen=True, eq=False)
class _Data:
    """The logs of a parameter with all fields known: `readings` (n, fields), `unit` (n,) in
    `names`; `notes` what could not be used.
    """

    logs: tuple[str, ...]
    value: FloatArray
    std: FloatArray
    unit: IntArray
    names: tuple[str, ...]
    fields: tuple[str, ...]
    readings: FloatArray
    notes: tuple[str, ...]

    @property
    def scaled(self) -> FloatArray:
        """Readings (n, fields) less their means, over their standard deviations."""
        middle, width = self.readings.mean(axis=0), self.readings.std(axis=0)
        return np.asarray((self.readings - middle) / width, dtype=np.float64)

    def make_design(self, group: IntArray) -> tuple[FloatArray, FloatArray]:
        """Fixed effects (n, p): level and drifts; random effects (n, q) of the groups."""
        ones = np.ones((self.value.size, 1))
        groups = int(group.max()) + 1
        if groups < 2:
            return np.hstack([ones, self.scaled]), ones[:, :0]
        own_drift = self.fields and self.value.size >= _LOGS_PER_UNIT * groups
        random = self.scaled[:, :1] if own_drift else ones[:, :0]
        return np.hstack([ones, self.scaled]), np.hstack([ones, random])


def estimate_parameter(seen: Observed, known: Mapping[str, LogFacts]) -> JointEstimate | None:
    """Estimate one parameter; None if there are too few logs."""
    data = _collect_data(seen, known)
    if data is None:
        return None
    sound = select_plausible(data.value, data.unit)
    found, sound = _fit_rejecting_outliers(data, sound)
    if found is None:
        return None
    outliers = _collect_outliers(data, found, sound, known)
    return replace(_assemble_estimate(seen, data, found, sound), outliers=outliers)


def _collect_data(seen: Observed, known: Mapping[str, LogFacts]) -> _Data | None:
    every = [known[log] for log in seen.logs]
    names = dict.fromkeys(name for fact in every for name in fact.fields)
    common = [n for n in names if sum(n in f.fields for f in every) >= _KNOWN_SHARE * len(every)]
    kept = [k for k, fact in enumerate(every) if all(name in fact.fields for name in common)]
    if len(kept) < 4:
        return None
    readings = np.array([[every[k].fields[name] for name in common] for k in kept], dtype=float)
    fields, notes = _select_usable_fields(common, readings.reshape(len(kept), len(common)))
    settings = {every[k].settings for k in kept}
    if len(settings) > 1:
        notes = (*notes, _MIXED.format(len(settings)))
    units = sorted({every[k].unit for k in kept})
    place = {name: k for k, name in enumerate(units)}
    return _Data(
        logs=tuple(seen.logs[k] for k in kept),
        value=seen.value[kept],
        std=seen.std[kept],
        unit=np.array([place[every[k].unit] for k in kept]),
        names=tuple(units),
        fields=tuple(common[k] for k in fields),
        readings=readings[:, fields],
        notes=notes,
    )


def _select_usable_fields(
    names: Sequence[str], readings: FloatArray
) -> tuple[list[int], tuple[str, ...]]:
    """Select the fields that vary and are separable from earlier ones; also return the rejects."""
    used: list[int] = []
    notes = []
    for k, name in enumerate(names):
        if np.ptp(readings[:, k]) == 0.0:
            notes.append(f"field {name!r} is the same in all logs")
            continue
        alike = [j for j in used if abs(np.corrcoef(readings[:, j], readings[:, k])[0, 1]) > _ALIKE]
        if alike:
            notes.append(f"field {name!r} runs with {names[alike[0]]!r}: only the latter is used")
        else:
            used.append(k)
    return used, tuple(notes)


def _fit(data: _Data, sound: Mask, *, intervals: bool = False) -> MixedFit | None:
    """Fit over the sound logs; residuals and variances of all. None with too few logs."""
    group = data.unit
    x, z = data.make_design(group)
    kept = np.flatnonzero(sound)
    present, inverse = np.unique(group[kept], return_inverse=True)
    if kept.size < x.shape[1] + z.shape[1] + 4:
        return None
    seen = Observations(data.value[kept], data.std[kept], inverse, x[kept], z[kept])
    found = fit_mixed_model(seen, intervals=intervals)
    groups = int(group.max()) + 1
    deviation = np.zeros((groups, z.shape[1]))
    error = np.tile(found.sigma, (groups, 1))
    deviation[present], error[present] = found.deviation, found.deviation_std
    residual = data.value - x @ found.beta - np.sum(z * deviation[group], axis=1)
    stated = data.std**2
    scale = found.excess**2
    variance = stated * scale if scale <= 1.0 else stated + (scale - 1.0) * np.median(stated[kept])
    return replace(
        found,
        deviation=deviation,
        deviation_std=error,
        residual=residual,
        variance=np.asarray(variance),
    )


def _fit_rejecting_outliers(data: _Data, sound: Mask) -> tuple[MixedFit | None, Mask]:
    """Fit, leave out what does not fit, and again until nothing changes."""
    bound = compute_outlier_limit(data.value.size)
    found = _fit(data, sound)
    for _ in range(_ROUNDS):
        if found is None:
            break
        fits = np.abs(found.residual) <= bound * np.sqrt(found.variance)
        if np.array_equal(fits, sound):
            break
        sound = fits
        found = _fit(data, sound)
    return _fit(data, sound, intervals=True), sound


def _assemble_estimate(seen: Observed, data: _Data, found: MixedFit, sound: Mask) -> JointEstimate:
    """Assemble the conclusions of a fit, in which the `sound` logs (n,) took part."""
    nothing = np.full(data.value.size, np.nan)
    spread = bool(found.sigma.size)
    return JointEstimate(
        parameter=seen.parameter,
        rule=seen.rule,
        si_unit=get_parameter_spec(seen.parameter).unit,
        logs=data.value.size,
        left_out=seen.left_out + len(seen.logs) - data.value.size,
        value=float(found.beta[0]),
        ci95=_scale_interval(found, 0, 1.0),
        spread=float(found.sigma[0]) if spread else None,
        spread_ci95=(float(found.sigma_ci[0, 0]), float(found.sigma_ci[0, 1])) if spread else None,
        excess=found.excess,
        drifts=_collect_drifts(data, found),
        units=_collect_units(data, found, sound),
        outliers=(),
        notes=data.notes,
        points=Points(
            data.readings[:, 0] if data.fields else nothing,
            data.value,
            data.std,
            tuple(data.names[k] for k in data.unit),
        ),
    )


def _scale_interval(found: MixedFit, place: int, scale: float) -> tuple[float, float]:
    middle, half = float(found.beta[place]), float(found.half[place])
    return (middle - half) / scale, (middle + half) / scale


def _collect_drifts(data: _Data, found: MixedFit) -> tuple[Drift, ...]:
    scales = data.readings.std(axis=0)
    return tuple(
        Drift(
            field=name,
            slope=float(found.beta[1 + k] / scales[k]),
            ci95=_scale_interval(found, 1 + k, float(scales[k])),
            reference=float(data.readings[:, k].mean()),
            spread=float(found.sigma[1] / scales[k]) if k == 0 and found.sigma.size > 1 else None,
        )
        for k, name in enumerate(data.fields)
    )


def _collect_units(data: _Data, found: MixedFit, sound: Mask) -> tuple[UnitValue, ...]:
    """Collect the deviations of the units."""
    if not found.sigma.size:
        return ()
    deviation, unit = found.deviation[:, 0], data.unit
    scores = compute_unit_scores(deviation)
    bound = compute_unit_limit(deviation.size)
    return tuple(
        UnitValue(
            unit=name,
            logs=int(np.sum((unit == k) & sound)),
            deviation=float(deviation[k]),
            std=float(found.deviation_std[k, 0]),
            score=float(scores[k]) if np.isfinite(scores[k]) else None,
            odd=bool(abs(scores[k]) > bound),
        )
        for k, name in enumerate(data.names)
    )


def _collect_outliers(
    data: _Data, found: MixedFit, sound: Mask, known: Mapping[str, LogFacts]
) -> tuple[Outlier, ...]:
    """Logs that were left out, the farthest first."""
    score = found.residual / np.sqrt(found.variance)
    places = sorted(np.flatnonzero(~sound), key=lambda k: -abs(score[k]))
    return tuple(
        Outlier(
            log=data.logs[k],
            path=known[data.logs[k]].path,
            unit=data.names[data.unit[k]],
            value=float(data.value[k]),
            expected=float(data.value[k] - found.residual[k]),
            score=float(score[k]),
            reason="",
        )
        for k in places
    )


FALSE_ALARMS = 0.05
"""Probability of one outlier found in a fleet that has none."""
_LEAST_LIMIT = 4.0
_LEAST_UNITS = 5
_FEW_UNITS = (5, 6, 7, 8, 9, 10, 12, 14, 16, 20)
_FEW_LIMITS = (8.0, 5.6, 5.9, 5.0, 5.1, 4.6, 4.4, 4.3, 4.2, _LEAST_LIMIT)
"""Scores that the farthest of so few units goes beyond in FALSE_ALARMS of 400,000 simulated fleets
of normally distributed units: the middle and the scatter of few units are themselves uncertain, and
those of an odd number more.
"""
_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""
_ROUGH = 8.0
"""Robust standard deviations beyond which a log does not take part in the first fit."""


def compute_outlier_limit(count: int) -> float:
    """Standard deviations beyond which one of `count` is an outlier."""
    return max(_LEAST_LIMIT, float(norm.isf(0.5 * FALSE_ALARMS / max(count, 1))))


def compute_unit_limit(count: int) -> float:
    """Score beyond which one of `count` units is more than chance makes."""
    return max(compute_outlier_limit(count), float(np.interp(count, _FEW_UNITS, _FEW_LIMITS)))


def select_plausible(values: FloatArray, unit: IntArray) -> NDArray[np.bool_]:
    """Return the mask of the values (n,) near their unit's median, usable in a first fit."""
    middles = np.array([np.median(values[unit == k]) for k in range(int(unit.max()) + 1)])
    away = np.abs(values - middles[unit])
    scale = _TO_SIGMA * float(np.median(away))
    return np.asarray(away <= _ROUGH * scale) if scale > 0.0 else np.ones(values.size, np.bool_)


def compute_unit_scores(deviation: FloatArray) -> FloatArray:
    """Return the robust z-score (units,) of each unit's deviation.

    NaN if there are too few units.
    """
    away = deviation - np.median(deviation)
    scale = _TO_SIGMA * float(np.median(np.abs(away)))
    if deviation.size < _LEAST_UNITS or scale == 0.0:
        return np.full(deviation.size, np.nan)
    return away / scale

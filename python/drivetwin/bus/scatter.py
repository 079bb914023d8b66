# SPDX-License-Identifier: MIT
"""One value from several shifts, with an interval that includes the scatter between shifts.

Random-effects model: shift k has its own value θ_k ~ N(θ, T) with T = diag(τ²), and its samples
give an estimate of θ_k with information H_k. Marginally the estimate has the information

    W_k = (H_k⁻¹ + T)⁻¹ = (1 + H_k T)⁻¹ H_k

which exists for a singular H_k as well: a shift may determine some directions only. T maximises the
restricted likelihood (DerSimonian and Laird 1986; Jackson et al. 2011 for several dimensions). The
degrees of freedom of an interval are those of T, as far as T contributes (Satterthwaite 1946).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import chdtrc, stdtrit

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.estimation.result.verdict import assess, join_reasons
from drivetwin.findings import Code, explain
from drivetwin.parameters import BUS_SPECS, ParameterSpec
from drivetwin.vehicle.spec import Z95

CONTRADICTION = 0.01
"""Probability of a test of agreement below which shifts contradict each other, as between logs."""
_SMALLEST = 1e-12
"""Relative eigenvalue below which a direction carries no information."""


@dataclass(frozen=True, eq=False)
class ShiftValue:
    """Estimate (p,) of one shift with its information (p, p): inverse covariance, maybe singular.

    `label` names log and shift, `kind` its kind; empty where it is not known.
    """

    label: str
    value: FloatArray
    information: FloatArray
    kind: str = ""


@dataclass(frozen=True, eq=False)
class Combined:
    """Value (p,) over all shifts.

    `covariance` (p, p) includes the scatter `tau` (p,) between the shifts (one standard deviation).
    `freedom` (p,) are the degrees of freedom of the intervals. `p_values` by label are those of the
    tests that a shift agrees with the others, scatter left out; `p_value` is that of all together.
    `groups` are the values by kind of shift where they differ: a shift is then compared with those
    of its kind.
    """

    value: FloatArray
    covariance: FloatArray
    tau: FloatArray
    freedom: FloatArray
    count: int
    p_value: float
    p_values: dict[str, float]
    groups: dict[str, Combined] = field(default_factory=dict)

    @property
    def std(self) -> FloatArray:
        """Standard deviation (p,) whose normal 95 % interval is the t interval."""
        quantile = stdtrit(self.freedom, 0.975)
        return np.asarray(np.sqrt(np.diag(self.covariance)) * quantile / Z95)

    @property
    def contradicting(self) -> tuple[str, ...]:
        """Shifts that contradict the others, each tested at the level shared by all tests."""
        limit = CONTRADICTION / max(len(self.p_values), 1)
        return tuple(label for label, p in self.p_values.items() if p < limit)


def combine(
    shifts: Sequence[ShiftValue],
    prior: FloatArray | None = None,
    centre: FloatArray | None = None,
    fixed: Sequence[int] = (),
) -> Combined | None:
    """Combine the estimates of several shifts; None if a direction is not determined.

    Parameters
    ----------
    shifts : estimates with information, in common units
    prior : information (p, p) on the common value about `centre` (p,), None for none; without a
        `centre` it is about zero
    fixed : coordinates that are the same in all shifts, without scatter
    """
    used = [one for one in shifts if np.all(np.isfinite(one.value)) and one.information.any()]
    if not used:
        return None
    scale = _choose_scale(used)
    origin = np.zeros(scale.size) if centre is None else centre
    values = np.array([(one.value - origin) / scale for one in used])
    infos = np.array([one.information * np.outer(scale, scale) for one in used])
    extra = np.zeros_like(infos[0]) if prior is None else prior * np.outer(scale, scale)
    if _is_singular(infos.sum(axis=0) + extra):
        return None
    tau = _fit_scatter(values, infos, extra, fixed)
    mean, covariance = _average(values, infos, tau, extra)
    within = _average(values, infos, np.zeros_like(tau), extra)[1]
    between = np.maximum(np.diag(covariance) - np.diag(within), 0.0) / np.diag(covariance)
    freedom = max(len(used) - 1, 1) / np.maximum(between, 1e-9) ** 2
    groups = _split(used)
    p_value, p_values = _test_agreement(used, values, infos, extra)
    for each in groups.values():
        p_values |= each.p_values
    return Combined(
        origin + mean * scale,
        covariance * np.outer(scale, scale),
        tau * scale,
        freedom,
        len(used),
        p_value,
        p_values,
        groups,
    )


def _split(used: Sequence[ShiftValue]) -> dict[str, Combined]:
    """Combine the shifts of two kinds separately; empty where the kinds agree."""
    parts: dict[str, list[ShiftValue]] = {}
    for one in used:
        if one.kind:
            parts.setdefault(one.kind, []).append(replace(one, kind=""))
    found = {kind: combine(part) for kind, part in parts.items() if len(part) > 1}
    known = {kind: one for kind, one in found.items() if one is not None}
    if len(known) != 2:
        return {}
    first, second = known.values()
    apart = first.value - second.value
    far = apart @ np.linalg.solve(first.covariance + second.covariance, apart)
    return known if chdtrc(apart.size, far) < CONTRADICTION else {}


def _choose_scale(used: Sequence[ShiftValue]) -> FloatArray:
    """Return sizes (p,) that make the coordinates alike: one over the root of the information."""
    total = np.diag(sum(one.information for one in used))
    return np.asarray(1.0 / np.sqrt(np.where(total > 0.0, total, 1.0)))


def _is_singular(total: FloatArray) -> bool:
    size = np.linalg.eigvalsh(total)
    return bool(size[0] <= _SMALLEST * size[-1])


def _average(
    values: FloatArray, infos: FloatArray, tau: FloatArray, extra: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Weighted mean (p,) and its covariance (p, p) for the scatter `tau` (p,)."""
    weights = _weigh(infos, tau)
    covariance = np.linalg.inv(weights.sum(axis=0) + extra)
    pulled = np.einsum("kij,kj->i", weights, values)
    return np.asarray(covariance @ pulled), np.asarray(covariance)


def _weigh(infos: FloatArray, tau: FloatArray) -> FloatArray:
    """Marginal information (k, p, p) of each shift."""
    weights = np.linalg.solve(np.eye(tau.size) + infos * tau**2, infos)
    return np.asarray(0.5 * (weights + weights.transpose(0, 2, 1)))


def _fit_scatter(
    values: FloatArray, infos: FloatArray, extra: FloatArray, fixed: Sequence[int]
) -> FloatArray:
    """Scatter (p,) of the greatest restricted likelihood; zero for a single shift."""
    count, size = values.shape
    free = [one for one in range(size) if one not in fixed]
    if count < 2 or not free:
        return np.zeros(size)

    def cost(logs: FloatArray) -> float:
        tau = np.zeros(size)
        tau[free] = np.exp(logs)
        weights = _weigh(infos, tau)
        whole = weights.sum(axis=0) + extra
        mean = np.linalg.solve(whole, np.einsum("kij,kj->i", weights, values))
        left = values - mean
        total = np.linalg.slogdet(whole)[1]
        total += np.linalg.slogdet(np.eye(size) + infos * tau**2)[1].sum()
        return float(total + np.einsum("ki,kij,kj->", left, weights, left))

    low, high = np.log(1e-3), np.log(1e4)
    starts = (np.full(len(free), 0.5 * np.log(count)), np.full(len(free), low))
    found = [
        minimize(
            cost,
            start,
            method="Nelder-Mead",
            bounds=[(low, high)] * len(free),
            options={"xatol": 1e-3, "fatol": 1e-4},
        )
        for start in starts
    ]
    best = np.exp(min(found, key=lambda one: one.fun).x)
    tau = np.zeros(size)
    tau[free] = np.where(best > 2e-3, best, 0.0)
    return tau


def _test_agreement(
    used: Sequence[ShiftValue],
    values: FloatArray,
    infos: FloatArray,
    extra: FloatArray,
) -> tuple[float, dict[str, float]]:
    """Probability of the deviations between shifts by noise, together and shift by shift."""
    none = np.zeros(values.shape[1])
    mean, _ = _average(values, infos, none, extra)
    ranks = np.linalg.matrix_rank(infos, hermitian=True)
    rank = int(ranks.sum()) - mean.size
    square = float(np.einsum("ki,kij,kj->", values - mean, infos, values - mean))
    p_value = float(chdtrc(rank, square)) if rank > 0 else 1.0
    p_values: dict[str, float] = {}
    rest = list(range(len(used)))
    while len(rest) > 1:
        tested = {k: _test_one(values, infos, ranks, extra, k, rest) for k in rest}
        worst = min(tested, key=lambda k: tested[k])
        if tested[worst] >= CONTRADICTION / len(used):
            return p_value, p_values | {used[k].label: p for k, p in tested.items()}
        # One that contradicts makes the others seem to: they are tested without it.
        p_values[used[worst].label] = tested[worst]
        rest.remove(worst)
    return p_value, p_values


def _test_one(
    values: FloatArray,
    infos: FloatArray,
    ranks: NDArray[np.intp],
    extra: FloatArray,
    tested: int,
    among: Sequence[int],
) -> float:
    """Probability that a shift deviates as much from the others `among` by noise alone."""
    others = [k for k in among if k != tested]
    if _is_singular(infos[others].sum(axis=0) + extra):
        return 1.0
    size = values.shape[1]
    mean, spread = _average(values[others], infos[others], np.zeros(size), extra)
    info = infos[tested]
    weight = np.linalg.solve(np.eye(size) + info @ spread, info)
    far = (values[tested] - mean) @ weight @ (values[tested] - mean)
    return float(chdtrc(ranks[tested], far))


METHOD = "bus, joint over shifts"
"""Method of an estimate."""
_SPEEDS = {"output_speed": "output speed", "engine_speed": "engine speed"}

RATIO, FREQUENCY, DAMPING = "ratio", "f_d", "zeta"
DELAY, DEAD_TIME, ENGINE, TOTAL = "speed_delay", "torque_delay", "J_engine", "J_total"
VEHICLE, MASS, LOAD = "J_vehicle_out", "mass_over_eta", "road_load"


def get_spec(stem: str, suffix: str = "") -> ParameterSpec | None:
    """Declaration of a quantity of bus logs alone, for a gear or channel; None for others."""
    found = BUS_SPECS.get(stem)
    if found is None or not suffix:
        return found
    name = f"{found.name}, {_SPEEDS.get(suffix, f'gear {suffix}')}"
    return replace(found, name=name, symbol=f"{found.symbol} ({_SPEEDS.get(suffix, suffix)})")


def make_id(stem: str, suffix: str = "") -> str:
    """Id of a quantity for a gear or channel."""
    separator = "." if suffix in _SPEEDS else "_"
    return f"{stem}{separator}{suffix}" if suffix else stem


def make_estimate(
    stem: str, suffix: str, value: float, std: float, combined: Combined, note: str = ""
) -> Estimate:
    """Estimate with a verdict from the interval; it is weak at best from one shift alone, and where
    the shifts contradict each other. Shifts cannot differ in a ratio, a number of teeth: their
    scatter is an error of measurement, which the interval includes."""
    name = make_id(stem, suffix)
    found = assess(name, value, std, METHOD, note=note, spec=get_spec(stem, suffix))
    p, is_single = combined.p_value, combined.count == 1
    is_unsure = is_single or (p < CONTRADICTION and stem != RATIO)
    if found.verdict is Verdict.NOT_IDENTIFIABLE or not is_unsure:
        return found
    cause = explain(Code.BUS_ONE_SHIFT) if is_single else explain(Code.BUS_SCATTERS, p=p)
    return replace(found, verdict=Verdict.WEAK, reason=join_reasons(cause, found.reason))


def refuse(stem: str, suffix: str, reason: str) -> Estimate:
    """Estimate without a value, and why."""
    spec = get_spec(stem, suffix)
    name = make_id(stem, suffix)
    return Estimate(name, None, None, Verdict.NOT_IDENTIFIABLE, METHOD, reason=reason, spec=spec)

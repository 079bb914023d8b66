# SPDX-License-Identifier: MIT
"""Absolute values of a log without an output torque, from values on the vehicle card.

Such a log determines r = p/η of each torque-like parameter p. A stated η is the scale itself, and a
stated p, such as J_vehicle from a weighbridge, gives η = p/r. Several of them are combined by least
squares with their joint covariance. With the derivatives s of η by all r, and the standard
deviation o of η that does not come from the log, the absolute values η·r have the covariance

    G·C·Gᵀ + o²·r·rᵀ,  G = η·I + r·sᵀ

so that the stated p keeps its own standard deviation and quotients of two p keep that of the log.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.data.shift_data import KnownDriveline
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.estimation.result.estimate_set import JointCovariance
from drivetwin.estimation.result.prior_conflict import PRIOR, Contradiction
from drivetwin.estimation.result.verdict import (
    VERDICT,
    assess,
    assess_with_prior,
    from_prior,
    refuse_parameter,
    reject_identified,
)
from drivetwin.findings import Code, Finding, explain
from drivetwin.parameters import LAW_KEYS, OVER_ETA, SPECS
from drivetwin.vehicle.spec import PriorValue

ETA = "eta"
METHOD = "likelihood"
WITH_ETA = "likelihood over η, times η from design"
"""Method of a torque-like parameter of a log without an output torque, where η is on the card."""
WITH_SCALE = "likelihood over η, scale from the vehicle card"
"""Method of absolute values whose scale is another absolute value on the card."""
_UNSCALED_LAW = LAW_KEYS[3]
"""Coefficient of a friction law that is no friction: ln v_s."""


@dataclass(frozen=True, eq=False)
class TorqueScale:
    """η of a log without an output torque.

    `slopes` (k,) are its derivatives by the values of `ids`, `own` is the part of its standard
    deviation that does not come from these. `stated` are the absolute values on the card.
    """

    ids: tuple[str, ...]
    eta: float
    own: float
    slopes: FloatArray
    stated: tuple[str, ...]

    @property
    def method(self) -> str:
        """Method of the values that it makes absolute."""
        return WITH_ETA if self.stated == (ETA,) else WITH_SCALE

    def compute_std(self, row: FloatArray, ratio: float, covariance: FloatArray) -> float:
        """Standard deviation of η·ratio by a `covariance` (k, k) of the values; `row` (k,) is the
        derivative of the ratio by them."""
        slope = self.eta * row + ratio * self.slopes
        return float(np.sqrt(max(float(slope @ covariance @ slope), 0.0)))


@dataclass(frozen=True, eq=False)
class OverEta:
    """Values (k,) by id of a fit over η: their covariances (k, k), by noise and in total, and their
    estimates."""

    values: Mapping[str, float]
    noise: FloatArray
    total: FloatArray
    estimates: Mapping[str, Estimate]


def find_scale(
    found: OverEta, known: Mapping[str, PriorValue]
) -> tuple[TorqueScale | None, list[Finding]]:
    """Find the scale of a log by what is `known` on the card, and report what contradicts it.

    None where nothing gives a scale. A value that no efficiency explains gives none.
    """
    ids, values = tuple(found.values), np.array([*found.values.values()])
    rows, own, scales, stated = [], [], [], []
    findings: list[Finding] = []
    if ETA in known:
        rows.append(np.zeros(len(ids)))
        scales.append(known[ETA].value)
        own.append(known[ETA].std)
        stated.append(ETA)
    for k, name in enumerate(ids):
        one = known.get(name.removesuffix(OVER_ETA))
        if not name.endswith(OVER_ETA) or one is None or values[k] == 0.0:
            continue
        if not SPECS[ETA].lower <= one.value / values[k] <= SPECS[ETA].upper:
            log = PriorValue(float(values[k]), float(np.sqrt(found.total[k, k])))
            apart = abs(log.value - one.value) / max(float(np.hypot(log.std, one.std)), 1e-300)
            absolute = name.removesuffix(OVER_ETA)
            findings.append(Contradiction(absolute, one, log, apart, {}).finding)
            continue
        scales.append(one.value / values[k])
        rows.append(-scales[-1] / values[k] * np.eye(len(ids))[k])
        own.append(one.std / abs(values[k]))
        stated.append(name.removesuffix(OVER_ETA))
    if not stated:
        return None, findings
    slopes, each = np.array(rows), np.array(own)
    spread = np.diag(each**2) + slopes @ found.total @ slopes.T
    weights = _weight(spread)
    scale = TorqueScale(
        ids,
        float(weights @ np.array(scales)),
        float(np.linalg.norm(weights * each)),
        weights @ slopes,
        tuple(stated),
    )
    return scale, [*findings, *_report_conflict(known, scales, spread, stated)]


def _weight(spread: FloatArray) -> FloatArray:
    """Return the weights (m,) of values of one quantity with a joint covariance (m, m)."""
    exact = np.diag(spread) == 0.0
    if exact.any():
        return np.asarray(exact / np.count_nonzero(exact), dtype=np.float64)
    weights = np.linalg.solve(spread, np.ones(len(spread)))
    return np.asarray(weights / weights.sum())


def _report_conflict(
    known: Mapping[str, PriorValue],
    scales: Sequence[float],
    spread: FloatArray,
    stated: Sequence[str],
) -> list[Finding]:
    """Report an η on the card that contradicts the other absolute values there."""
    if stated[0] != ETA or len(stated) == 1:
        return []
    rest = spread[1:, 1:]
    weights = _weight(rest)
    other = PriorValue(
        float(weights @ np.array(scales[1:])), float(np.sqrt(weights @ rest @ weights))
    )
    total = float(np.hypot(other.std, known[ETA].std))
    apart = abs(other.value - known[ETA].value) / total if total > 0.0 else 0.0
    if apart <= PRIOR.contradiction:
        return []
    return [Contradiction(ETA, known[ETA], other, apart, {}).finding]


def estimate_absolute(
    names: Sequence[str], found: OverEta, scale: TorqueScale | None, driveline: KnownDriveline
) -> dict[str, Estimate]:
    """Estimate absolute values by id; not identifiable without a scale, or if the log contradicts
    each value that the card states as one."""
    if scale is None:
        reason = explain(
            Code.LOG_CONTRADICTS_CARD
            if any(one + OVER_ETA in found.values for one in driveline.known)
            else Code.NO_TORQUE_SCALE
        )
        return {name: refuse_parameter(name, METHOD, reason) for name in names}
    ratios = [name.removesuffix(OVER_ETA) for name in scale.ids if name.endswith(OVER_ETA)]
    every = dict.fromkeys((*names, *ratios))
    made = {name: _estimate_one(name, found, scale, driveline) for name in every if name != ETA}
    return {ETA: _estimate_eta(found, scale, driveline), **made}


def _estimate_eta(found: OverEta, scale: TorqueScale, driveline: KnownDriveline) -> Estimate:
    design = driveline.known.get(ETA)
    if design is not None and scale.stated == (ETA,):
        return from_prior(ETA, design)
    nothing = np.zeros(len(scale.ids))
    noise, total = (scale.compute_std(nothing, 1.0, one) for one in (found.noise, found.total))
    noise, total = min(noise, total), float(np.hypot(total, scale.own))
    if design is not None and total >= VERDICT.prior_share * design.std:
        return from_prior(ETA, PriorValue(scale.eta, total), Code.CARD_DOMINATES)
    systematic = float(np.sqrt(total**2 - noise**2))
    one = assess(ETA, scale.eta, noise, scale.method, systematic)
    bases = [found.estimates[name + OVER_ETA] for name in scale.stated if name != ETA]
    if all(base.verdict in (Verdict.IDENTIFIED, Verdict.DESIGN) for base in bases):
        return one
    return reject_identified(one, bases[0].reason)


def _estimate_one(
    name: str, found: OverEta, scale: TorqueScale, driveline: KnownDriveline
) -> Estimate:
    """Estimate a torque-like parameter: the ratio times η, with the spread of η as a systematic
    part."""
    ratio = found.estimates.get(name + OVER_ETA)
    if ratio is None or ratio.value is None or ratio.std_noise is None:
        reason = explain(Code.NO_TORQUE_SCALE)
        refused = refuse_parameter(name, METHOD, reason)
        return refused if ratio is None else replace(ratio, id=name)
    row = (np.array(scale.ids) == ratio.id).astype(float)
    noise, total = (scale.compute_std(row, ratio.value, one) for one in (found.noise, found.total))
    # A verdict may have widened the ratio beyond the covariance.
    wider = max((ratio.std_total or 0.0) ** 2 - float(row @ found.total @ row), 0.0)
    total = float(np.sqrt(total**2 + (scale.own * ratio.value) ** 2 + scale.eta**2 * wider))
    value, noise = scale.eta * ratio.value, min(noise, total)
    spread = float(np.sqrt(total**2 - noise**2))
    design = driveline.find_prior(name)
    if name in scale.stated and design is not None:
        if total >= VERDICT.prior_share * design.std:
            return from_prior(name, PriorValue(value, total), Code.CARD_DOMINATES)
        design = None
    if ratio.verdict is Verdict.DESIGN:
        return replace(ratio, id=name, value=value, std_noise=noise, std_systematic=spread)
    if design is not None:
        one = assess_with_prior((name, value, noise), design, scale.method, spread, ratio.reason)
    else:
        one = assess(name, value, noise, scale.method, spread, ratio.reason)
    return one if ratio.verdict is Verdict.IDENTIFIED else reject_identified(one, "")


def scale_covariance(
    joint: JointCovariance, values: Mapping[str, float], scale: TorqueScale
) -> JointCovariance:
    """Return the joint covariance of absolute values with η, from that of `values` over η by id."""
    count = len(joint.ids)
    change, own = np.eye(count + 1, count), np.zeros(count + 1)
    slopes = np.zeros(count)
    slopes[[joint.ids.index(name) for name in scale.ids]] = scale.slopes
    for k, name in enumerate(joint.ids):
        is_law = name.startswith(LAW_KEYS) and not name.startswith(_UNSCALED_LAW)
        if is_law or name.endswith(OVER_ETA):
            change[k] = values[name] * slopes
            change[k, k] += scale.eta
            own[k] = values[name]
    change[count], own[count] = slopes, 1.0
    covariance = change @ joint.covariance @ change.T + scale.own**2 * np.outer(own, own)
    return JointCovariance((*(one.removesuffix(OVER_ETA) for one in joint.ids), ETA), covariance)

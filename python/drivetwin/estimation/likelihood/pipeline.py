# SPDX-License-Identifier: MIT
"""Likelihood method over all shifts of a log, started from the linear method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.progress import TimedStages
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import DesignData, KnownDriveline, ShiftSignals
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.effects.expansion import admit_excluded
from drivetwin.estimation.likelihood.estimates import build_estimates
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.mechanism import Mechanism, is_enabled
from drivetwin.estimation.likelihood.optimize.initial_guess import (
    estimate_initial_values,
    estimate_without_torque,
)
from drivetwin.estimation.likelihood.parametrization import LOAD_DEVIATION, build_load_deviations
from drivetwin.estimation.likelihood.priors import build_problem
from drivetwin.estimation.likelihood.selection.candidates import try_plants
from drivetwin.estimation.likelihood.selection.lower_gear_search import (
    fit_from_lower_gear,
    fit_with_backlash,
)
from drivetwin.estimation.likelihood.selection.plants import build_plant_priors
from drivetwin.estimation.likelihood.selection.sampling_mode import report_modes
from drivetwin.estimation.likelihood.selection.select_model import select_model
from drivetwin.estimation.linear.load_balance import AERO
from drivetwin.estimation.linear.pipeline import IntegralShift
from drivetwin.estimation.result.estimate_set import EstimateSet
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.simulation.dual_clutch import LossLaw
from drivetwin.vehicle.effects import EffectId


@dataclass(frozen=True)
class LinearStartSettings:
    """Limits of the use of the linear method as initial value and comparison."""

    disagreement: float = 5.0
    """Difference of the two methods from which a finding is due [standard deviations]."""
    max_outside: float = 10.0
    """Factor beyond the design range of J3 from which the linear value is no initial value
    [ratio]."""


LINEAR_START = LinearStartSettings()
_STAGES = TimedStages("likelihood", ("guess", "selection", "plant", "conclusions"))


BEHIND_GEARBOX = ("J_vehicle", "Tv_over_if", "k_o", "c_o")
"""Unknowns whose initial value depends on the linear method's J3."""
OF_A_CONSTANT_LOAD = frozenset({"J_vehicle", "Tv_over_if"})
"""Parameters that depend on whether the load is modelled as constant."""


def estimate_without_linear(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    design: DesignData,
    *,
    with_plants: bool = True,
) -> tuple[EstimateSet, LikelihoodFit]:
    """Fit without the linear method.

    For a log without an output torque, which gives ratios over η and no absolute values, and for a
    log without an equation for the linear method. Raises IdentificationError if the fit does not
    reach a plausible minimum.
    """
    with _STAGES.enter("guess"):
        guess = _compute_own_guess(signals, drivelines, design)
    priors = EffectPriors(design.effects, design.sensors)
    best = _fit(signals, drivelines, design.loss_law, guess, priors, with_plants=with_plants)
    with _STAGES.enter("conclusions", "intervals"):
        found = build_estimates(best.fit, signals, drivelines, {}, best.priors)
    return replace(found, findings=(*found.findings, *best.findings)), best.fit


def _compute_own_guess(
    signals: Sequence[ShiftSignals], drivelines: Sequence[KnownDriveline], design: DesignData
) -> dict[str, float]:
    """Compute an initial value of every unknown without the linear method."""
    guess: dict[str, float] = {}
    loads = []
    for s, d in zip(signals, drivelines, strict=True):
        found = estimate_without_torque(s, d, design)
        loads.append(found["Tv_over_if"])
        guess = found | guess
    return guess | build_load_deviations(loads)


def _compute_guess(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    shifts: Sequence[IntegralShift],
    design: DesignData,
) -> dict[str, float]:
    """Compute an initial value of every unknown from the linear method, unless its J3 is
    impossible.

    Without a wheel speed that method takes the output speed for it, and where the shaft is soft
    its swing hides how little the vehicle's speed changes.
    """
    found = estimate_initial_values(shifts, drivelines)
    low, high = design.J_vehicle_range
    if low / LINEAR_START.max_outside < found["J_vehicle"] < high * LINEAR_START.max_outside:
        return found
    own = _compute_own_guess(signals, drivelines, design)
    behind = {n: own[n] for n in own if n in BEHIND_GEARBOX or n.endswith(f".{LOAD_DEVIATION}")}
    return {name: value for name, value in found.items() if name != AERO} | behind


def estimate_likelihood(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    linear: tuple[EstimateSet, Sequence[IntegralShift]],
    design: DesignData,
    *,
    with_plants: bool = True,
) -> tuple[EstimateSet, LikelihoodFit]:
    """Fit all shifts together and assess the result; `linear` is the result of the linear method.

    With `with_plants` elements beside the dual clutch are tried.
    Raises IdentificationError where the fit does not reach a plausible minimum.
    """
    found, shifts = linear
    with _STAGES.enter("guess"):
        guess = _compute_guess(signals, drivelines, shifts, design)
    priors = EffectPriors(design.effects, design.sensors)
    best = _fit(signals, drivelines, design.loss_law, guess, priors, with_plants=with_plants)
    with _STAGES.enter("conclusions", "intervals"):
        estimates = build_estimates(best.fit, signals, drivelines, found.friction, best.priors)
    findings = (*estimates.findings, *best.findings, *_find_disagreements(estimates, found))
    return replace(estimates, findings=findings), best.fit


@dataclass(frozen=True, eq=False)
class _SelectedFit:
    """Fit of the selected plant, and the statements on effects that the log does not contradict."""

    fit: LikelihoodFit
    priors: EffectPriors
    findings: tuple[Finding, ...]


def _fit(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    loss_law: LossLaw,
    guess: Mapping[str, float],
    priors: EffectPriors,
    *,
    with_plants: bool,
) -> _SelectedFit:
    """Fit the dual clutch, or a plant with an element beside it that the log supports.

    Raises IdentificationError where no plant reaches a plausible minimum.
    """
    with _STAGES.enter("selection"):
        try:
            best, notes = select_model(signals, drivelines, loss_law, guess, priors)
        except IdentificationError:
            found = (
                _search_again(signals, drivelines, loss_law, guess, priors)
                if is_enabled(Mechanism.LOWER_GEAR)
                else None
            )
            if found is None:
                raise
            best, notes = found, tuple(report_modes(found.problem.modes))
    with _STAGES.enter("plant", "elements of the plant"):
        admits = is_enabled(Mechanism.ADMISSION)
        admitted, warnings = admit_excluded(best, priors) if admits else (priors, ())
        if with_plants and is_enabled(Mechanism.PLANTS):
            best = try_plants(best, admitted)
        return _SelectedFit(best, admitted, (*notes, *warnings))


def _search_again(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    loss_law: LossLaw,
    guess: Mapping[str, float],
    priors: EffectPriors,
) -> LikelihoodFit | None:
    """Fit with a constant load from the lower gear, with backlash where that fails; None where no
    plant reaches a minimum."""
    constant = {name: value for name, value in guess.items() if name != AERO}
    problem, start = build_problem(signals, drivelines, loss_law, constant, hilly=len(signals) > 1)
    shifts = [s.shift for s in signals]
    found = fit_from_lower_gear(problem, start, shifts)
    stated = priors.get_prior(EffectId.BACKLASH, drivelines[0])
    if found is not None or not (stated.std or stated.value):
        return found
    own = build_plant_priors(EffectId.BACKLASH, priors, drivelines[0])
    return fit_with_backlash(problem, start, shifts, own)


def _find_disagreements(found: EstimateSet, linear: EstimateSet) -> list[Finding]:
    """Return a finding for each parameter on which both methods differ by more than their noise.

    Nothing is compared where an effect moves the values of one method. `OF_A_CONSTANT_LOAD` is not
    compared if only one method has a load that grows with speed: the difference is then expected,
    and the load is reported elsewhere.
    """
    if found.cause is not None:
        return []
    alike = (found.load is None) == (linear.load is None)
    explained = frozenset() if alike else OF_A_CONSTANT_LOAD
    differ = []
    for name, estimate in found.estimates.items():
        other = linear.estimates.get(name)
        if other is None or other.value is None or estimate.value is None or name in explained:
            continue
        spread = float(np.hypot(estimate.std_noise or 0.0, other.std_noise or 0.0))
        if spread > 0.0 and abs(estimate.value - other.value) > LINEAR_START.disagreement * spread:
            a, b = (Number(value, estimate.unit) for value in (estimate.value, other.value))
            differ.append(report(Code.METHODS_DIFFER, name, likelihood=a, linear=b))
    return differ

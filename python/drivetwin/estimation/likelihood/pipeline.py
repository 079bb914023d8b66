# SPDX-License-Identifier: MIT
"""Likelihood method over all shifts of a log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from drivetwin._util.progress import TimedStages
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import DesignData, KnownDriveline, ShiftSignals
from drivetwin.estimation.direct.load_balance import AERO
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.effects.expansion import admit_excluded
from drivetwin.estimation.likelihood.estimates import build_estimates
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.initial_guess import estimate_initial_values
from drivetwin.estimation.likelihood.mechanism import Mechanism, is_enabled
from drivetwin.estimation.likelihood.priors import build_problem
from drivetwin.estimation.likelihood.selection.candidates import try_plants
from drivetwin.estimation.likelihood.selection.plants import build_plant_priors
from drivetwin.estimation.likelihood.selection.sampling_mode import get_modes, report_modes
from drivetwin.estimation.likelihood.selection.select_model import (
    fit_with_backlash,
    select_model,
)
from drivetwin.estimation.result.estimate_set import EstimateSet
from drivetwin.findings import Finding
from drivetwin.simulation.dual_clutch import LossLaw
from drivetwin.vehicle.effects import EffectId

_STAGES = TimedStages("likelihood", ("guess", "selection", "plant", "conclusions"))


def estimate_likelihood(
    signals: Sequence[ShiftSignals], drivelines: Sequence[KnownDriveline], design: DesignData
) -> tuple[EstimateSet, LikelihoodFit]:
    """Fit all shifts together and assess the result.

    A log without an output torque gives ratios over η and no absolute values. Raises
    IdentificationError where the fit does not reach a plausible minimum.
    """
    with _STAGES.enter("guess"):
        guess = estimate_initial_values(signals, drivelines, design)
    priors = EffectPriors(design.effects, design.sensors)
    best = _fit(signals, drivelines, design.loss_law, guess, priors)
    with _STAGES.enter("conclusions", "intervals"):
        found = build_estimates(best.fit, signals, drivelines, best.priors)
    return replace(found, findings=(*found.findings, *best.findings)), best.fit


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
) -> _SelectedFit:
    """Fit the dual clutch, or a plant with an element beside it that the log supports.

    Raises IdentificationError where no plant reaches a plausible minimum.
    """
    with _STAGES.enter("selection"):
        try:
            best, notes = select_model(signals, drivelines, loss_law, guess)
        except IdentificationError:
            found = (
                _search_with_backlash(signals, drivelines, loss_law, guess, priors)
                if is_enabled(Mechanism.BACKLASH_FIRST)
                else None
            )
            if found is None:
                raise
            best, notes = found, tuple(report_modes(get_modes(found.problem)))
    with _STAGES.enter("plant", "elements of the plant"):
        admits = is_enabled(Mechanism.ADMISSION)
        admitted, warnings = admit_excluded(best, priors) if admits else (priors, ())
        if is_enabled(Mechanism.PLANTS):
            best = try_plants(best, admitted)
        return _SelectedFit(best, admitted, (*notes, *warnings))


def _search_with_backlash(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    loss_law: LossLaw,
    guess: Mapping[str, float],
    priors: EffectPriors,
) -> LikelihoodFit | None:
    """Fit with a constant load and backlash in the plant; None without a minimum, and where the
    card excludes backlash."""
    stated = priors.get_prior(EffectId.BACKLASH, drivelines[0])
    if not (stated.std or stated.value):
        return None
    constant = {name: value for name, value in guess.items() if name != AERO}
    problem, start = build_problem(signals, drivelines, loss_law, constant, hilly=len(signals) > 1)
    return fit_with_backlash(
        problem, start, build_plant_priors(EffectId.BACKLASH, priors, drivelines[0])
    )

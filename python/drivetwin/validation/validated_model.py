# SPDX-License-Identifier: MIT
"""Identification with the simulation over the measurement, of one log, several logs or shifts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

from drivetwin._util.arrays import FloatArray
from drivetwin._util.check_arguments import check_arguments
from drivetwin._util.progress import TimedStages
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import DrivetwinError, IdentificationError, InputError, Where
from drivetwin.estimation.data.prepare import prepare_shift
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.multi_log.fit import extract_log
from drivetwin.estimation.multi_log.prediction_bounds import ShiftPrediction, predict_shifts
from drivetwin.estimation.result.estimate import Estimate, EstimatesMixin, Verdict
from drivetwin.estimation.result.method import DEFAULT_METHOD, Method
from drivetwin.estimation.result.validation import HeldOut, PredictionInterval, Validation
from drivetwin.estimation.result.verdict import assess
from drivetwin.findings import Code, Finding, report
from drivetwin.parameters import OVER_ETA
from drivetwin.pipeline import identify, identify_jointly
from drivetwin.shifts.detect import FoundShifts, detect_shifts, trim_to_recorded, trim_to_window
from drivetwin.shifts.lockup_clutch import refer_to_turbine, require_locked_converter
from drivetwin.shifts.shift import Shift, split_shared_gears
from drivetwin.twin.build import build_twin
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import attach_fit, attach_validation, simulate_shift
from drivetwin.vehicle.card import VehicleCard

_STAGES = TimedStages("validated model", ("identification", "simulation"))


@dataclass(frozen=True, eq=False, repr=False)
class ValidatedModel(EstimatesMixin):
    """A `result` with the verdict on the model, and the `twin` with its values and verdicts."""

    result: Identification
    twin: Twin

    @property
    def estimates(self) -> Mapping[str, Estimate]:  # type: ignore[override] # read-only
        """Estimates of the result by parameter id."""
        return self.result.estimates

    def draw(self, count: int, *, seed: int = 0) -> dict[str, FloatArray]:
        """Draw values of the parameters, as `Identification.draw`."""
        return self.result.draw(count, seed=seed)

    def simulate(self, log: ShiftLog, **changed: float) -> tuple[Validation, ...]:
        """Simulate the shifts of a log, driven by its measured inputs.

        Parameters
        ----------
        log
            The log of the identification, or another one of the same vehicle.
        changed
            Values that replace those of the twin, by parameter id, SI: `J_vehicle=7000.0`.

        Returns
        -------
        tuple of Validation
            Simulation beside measurement of each shift in the order of time.

        Raises
        ------
        DrivetwinError
            As `simulate_shift`, and InputError for a value on which no shift depends.
        """
        found = detect_shifts(log, self.twin.build_card()).shifts
        models = (self.twin.build_dual_clutch(shift, overrides=changed) for shift in found)
        pairs = zip(found, models, strict=True)
        return tuple(simulate_shift(self.twin, log, shift, model) for shift, model in pairs)

    def __repr__(self) -> str:
        return f"<ValidatedModel: {self.result!r}>"


@check_arguments
def identify_validated(
    log: ShiftLog,
    card: VehicleCard,
    shifts: FoundShifts | None = None,
    method: Method = DEFAULT_METHOD,
    *,
    fixed: Mapping[str, float] = MappingProxyType({}),
    priors: Mapping[str, tuple[float, float]] = MappingProxyType({}),
    bounds: Mapping[str, tuple[float, float]] = MappingProxyType({}),
) -> ValidatedModel:
    """Identify a log, simulate its shifts, and set the verdict, as the command `identify` does.

    Parameters
    ----------
    log, card : the channels of a recording and the design data of its vehicle
    shifts : result of `detect_shifts`; None: they are detected
    method, fixed, priors, bounds : as in `identify`

    Returns
    -------
    ValidatedModel
        The validated result and its twin.

    Raises
    ------
    DrivetwinError
        As `identify`, and MissingParameterError where the model cannot be simulated.
    """
    found = detect_shifts(log, card) if shifts is None else shifts
    with _STAGES.enter("identification"):
        result = identify(log, card, found, method, fixed=fixed, priors=priors, bounds=bounds)
    with _STAGES.enter("simulation", "simulating the shifts"):
        result = attach_validation(result, build_twin(result, card), log)
    return ValidatedModel(result, build_twin(result, card))  # with the verdicts of the gate


BEFORE = "likelihood, from the gear held before the shift"
"""Method name of the estimates for a log that was not fitted."""


def predict_held_shifts(
    found: Identification,
    card: VehicleCard,
    log: ShiftLog,
    shifts: Sequence[Shift],
    number: int,
) -> tuple[HeldOut, ...]:
    """Predict `shifts` of a log that `found` was not fitted to.

    `number` is that of the log in a fit of several, 0 where `found` is of other shifts of this log
    alone, and the next free one (from 1) for a log that the fit has not seen.
    """
    return tuple(_predict_shift(found, card, log, shift, number) for shift in shifts)


def _predict_shift(
    found: Identification, card: VehicleCard, log: ShiftLog, shift: Shift, number: int
) -> HeldOut:
    fit = found.evidence.likelihood
    try:
        require_locked_converter(log, card, shift)
        log = refer_to_turbine(log, card, shift)
        fills = {name: card.get_element(name).P0 for name in (shift.offgoing, shift.oncoming)}
        shift = trim_to_window(trim_to_recorded(log, shift, fills, card.i_in.value))
        predicted = _predict_misfit(fit, card, log, shift, number)
        mine, own = _select_log_estimates(found, log, number, predicted)
        mine, findings = _ensure_friction_law(mine, shift)
        twin = build_twin(mine, card)
        start = None if predicted is None else (predicted.time, predicted.start)
        run = simulate_shift(twin, log, shift, start=start)
    except DrivetwinError as fault:
        return HeldOut(
            log.source, shift, None, findings=(report(Code.NOT_PREDICTED, why=fault.what),)
        )
    bounds = {} if predicted is None else _map_signal_bounds(predicted.bounds, run, log, card)
    return HeldOut(log.source, shift, run, own, bounds, (*findings, *run.findings))


def _predict_misfit(
    fit: LikelihoodFit | None, card: VehicleCard, log: ShiftLog, shift: Shift, number: int
) -> ShiftPrediction | None:
    """Predict the misfit expected by the likelihood; None for another method."""
    if fit is None:
        return None
    data = prepare_shift(log, card, shift)
    return predict_shifts(fit, [replace(data, signals=replace(data.signals, log=number))])[0]


def _select_log_estimates(
    found: Identification, log: ShiftLog, number: int, predicted: ShiftPrediction | None
) -> tuple[Identification, dict[str, Estimate]]:
    """Return the identification with the log-specific parameters, of the fit or of `predicted`.

    The second value contains the estimates from `predicted` alone, in the order of the estimates;
    it is empty for a fitted log. Raises IdentificationError for a log that was not fitted if the
    method is not the likelihood method.
    """
    several = found.evidence.several
    if number == 0:
        return found, {}
    if several is not None and number <= len(several.logs):
        return extract_log(found, several.logs[number - 1]), {}
    if predicted is None:
        raise IdentificationError(
            "only the likelihood method estimates load and engine-torque delay of a log that was "
            "not fitted",
            "use --method likelihood, or hold out a shift of a log whose other shifts are fitted",
            Where(file=log.source),
        )
    base = found if several is None else extract_log(found, several.logs[0])
    load = None if base.load is None else replace(base.load, mean_speed=predicted.mean_speed)
    own = _collect_log_specific(base, predicted)
    estimates = {**base.estimates, **own}
    ordered = {name: one for name, one in estimates.items() if name in own}
    return replace(base, estimates=estimates, load=load), ordered


def _collect_log_specific(base: Identification, predicted: ShiftPrediction) -> dict[str, Estimate]:
    """Estimates of what the log has of its own; where η is from design also times η."""
    made: dict[str, Estimate] = {}
    for name, (value, std) in predicted.own.items():
        ratio = name + OVER_ETA
        if ratio in base.estimates:
            made[ratio] = _build_estimate(ratio, value, std)
            eta = base.estimates["eta"].value
            if eta is not None:
                made[name] = _build_estimate(name, eta * value, eta * std)
        elif name in base.estimates:
            made[name] = _build_estimate(name, value, std)
    return made


def _build_estimate(name: str, value: float, std: float) -> Estimate:
    """The best value that there is before the shift, be it as weak as it may."""
    wide = assess(name, value, std, BEFORE).verdict is not Verdict.IDENTIFIED
    return Estimate(name, value, std, Verdict.WEAK if wide else Verdict.IDENTIFIED, BEFORE)


def _map_signal_bounds(
    bounds: Mapping[str, PredictionInterval], run: Validation, log: ShiftLog, card: VehicleCard
) -> dict[str, PredictionInterval]:
    """Bounds by compared signal; the fit sees the engine's speed where it has the input's."""
    found = dict(bounds)
    if "engine_speed" in found and "engine_speed" not in log:
        one = found.pop("engine_speed")
        found["input_speed"] = PredictionInterval(
            one.usual / card.i_in.value, one.largest / card.i_in.value
        )
    return {name: one for name, one in found.items() if name in run.fit}


def _ensure_friction_law(
    found: Identification, shift: Shift
) -> tuple[Identification, tuple[Finding, ...]]:
    """The identification with a law for the on-coming element, and whose it is if another's.

    That of the off-going element if it has one, else that of any other: facings are alike.
    """
    own = [name for name in found.friction if found.has_own_friction(name)]
    if shift.oncoming in own or not own:
        return found, ()
    other = shift.offgoing if shift.offgoing in own else own[0]
    friction = {**found.friction, shift.oncoming: found.friction[other]}
    finding = report(Code.FRICTION_LAW_SUBSTITUTED, element=shift.oncoming, other=other)
    return replace(found, friction=friction), (finding,)


@dataclass(frozen=True, eq=False)
class Source:
    """A log with its usable shifts; `held` are the numbers, from 1, of those to be predicted."""

    log: ShiftLog
    shifts: FoundShifts
    held: frozenset[int] = frozenset()

    def split_shifts(self) -> tuple[FoundShifts, FoundShifts]:
        """Shifts to fit and shifts to predict, which share no sample.

        Raises InputError for a number that no shift has.
        """
        unknown = self.held - set(range(1, len(self.shifts.shifts) + 1))
        if unknown:
            raise InputError(
                f"no shift {min(unknown)} to hold out: the log has "
                f"{len(self.shifts.shifts)} usable",
                "count from 1 as 'drivetwin shifts' lists them",
                Where(file=self.log.source),
            )
        if not self.held:
            return self.shifts, FoundShifts((), ())
        numbered = list(enumerate(split_shared_gears(self.shifts.shifts), 1))
        kept = tuple(shift for k, shift in numbered if k not in self.held)
        return (
            FoundShifts(kept, self.shifts.rejected),
            FoundShifts(tuple(shift for k, shift in numbered if k in self.held), ()),
        )


_JOINT_STAGES = TimedStages("joint model", ("identification", "simulation", "prediction"))


@dataclass(frozen=True, eq=False)
class JointIdentification:
    """Result of a joint identification: the identification, the fitted logs, a twin by source."""

    found: Identification
    fitted: tuple[ShiftLog, ...]
    twins: Mapping[str, Twin]


@check_arguments
def identify_together(
    sources: Sequence[Source], card: VehicleCard, method: Method = DEFAULT_METHOD
) -> JointIdentification:
    """Identify one driveline from the shifts of all `sources` that are not held out.

    The identification is simulated over the logs (`fit`); `evidence.held_out` has every shift
    that was predicted. Only the likelihood method joins several logs (`evidence.several`).
    Raises InputError where nothing is left to fit or several logs are asked of another method,
    and what `identify` and `identify_jointly` raise.
    """
    splits = [source.split_shifts() for source in sources]
    fitted = [k for k, (kept, _) in enumerate(splits) if kept.shifts]
    if not fitted:
        raise InputError(
            "every shift is held out: nothing is left to identify from",
            "leave out a --hold-out, or add a log",
        )
    logs, shifts = [sources[k].log for k in fitted], [splits[k][0] for k in fitted]
    with _JOINT_STAGES.enter("identification"):
        if len(fitted) == 1:
            found = identify(logs[0], card, shifts[0], method)
            numbers = {fitted[0]: 0}
        else:
            _require_likelihood(method)
            found = identify_jointly(logs, card, shifts)
            numbers = {k: number for number, k in enumerate(fitted, 1)}
    with _JOINT_STAGES.enter("simulation", "simulating the shifts"):
        found, twins = _attach_simulations(found, card, logs)
    with _JOINT_STAGES.enter("prediction", "predicting what was held out"):
        held = _predict_held_shifts(
            found, card, sources, [late.shifts for _, late in splits], numbers
        )
    if held:
        found = replace(found, evidence=replace(found.evidence, held_out=held))
    read = [*(source.log.inputs for source in sources), card.inputs]
    found = replace(found, inputs={name: sha for one in read for name, sha in one.items()})
    return JointIdentification(found, tuple(logs), twins)


def _require_likelihood(method: Method) -> None:
    if method is not Method.LIKELIHOOD:
        raise InputError(
            f"the {method} method takes one log at a time",
            "use the likelihood method, or identify the logs one by one",
        )


def _attach_simulations(
    found: Identification, card: VehicleCard, logs: Sequence[ShiftLog]
) -> tuple[Identification, dict[str, Twin]]:
    """The identification with the fit over all logs, each with what it has of its own."""
    several = found.evidence.several
    if several is None:
        found = attach_validation(found, build_twin(found, card), logs[0])
        return found, {logs[0].source: build_twin(found, card)}  # with the verdicts of the gate
    twins, views = {}, []
    for share, log in zip(several.logs, logs, strict=True):
        mine = extract_log(replace(found, findings=()), share)
        twins[log.source] = build_twin(mine, card)
        views.append(attach_validation(mine, twins[log.source], log))
    shares = tuple(
        replace(share, fit=view.fit) for share, view in zip(several.logs, views, strict=True)
    )
    runs = [run for view in views for run in view.evidence.validation]
    missing = [
        one.set_file(Path(share.source).name)
        for share, view in zip(several.logs, views, strict=True)
        if not view.fit
        for one in view.findings
    ]
    found = attach_fit(replace(found, findings=(*found.findings, *missing)), runs)
    evidence = replace(found.evidence, several=replace(several, logs=shares))
    return replace(found, evidence=evidence), twins


def _predict_held_shifts(
    found: Identification,
    card: VehicleCard,
    sources: Sequence[Source],
    held: Sequence[Sequence[Shift]],
    numbers: Mapping[int, int],
) -> tuple[HeldOut, ...]:
    """All shifts held out; a log that the fit has not seen takes the next free number."""
    free = max(numbers.values()) + 1
    return tuple(
        one
        for k, (source, shifts) in enumerate(zip(sources, held, strict=True))
        for one in predict_held_shifts(found, card, source.log, shifts, numbers.get(k, free))
    )

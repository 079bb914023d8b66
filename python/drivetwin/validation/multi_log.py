# SPDX-License-Identifier: MIT
"""Several logs of one vehicle, or several shifts: some are fitted together, others predicted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from drivetwin._util.check_arguments import check_arguments
from drivetwin._util.timed_stages import TimedStages
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import InputError, Where
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.multi_log.fit import extract_log
from drivetwin.estimation.result.method import DEFAULT_METHOD, Method
from drivetwin.estimation.result.validation import HeldOut
from drivetwin.pipeline import identify, identify_jointly
from drivetwin.shifts.detect import FoundShifts
from drivetwin.shifts.shift import Shift
from drivetwin.shifts.split_gears import split_shared_gears
from drivetwin.twin.build import build_twin
from drivetwin.twin.twin import Twin
from drivetwin.validation.cross_validation import predict_held_shifts
from drivetwin.validation.simulate_log import attach_fit, attach_validation
from drivetwin.vehicle.vehicle_card import VehicleCard


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


_STAGES = TimedStages("joint model", ("identification", "simulation", "prediction"))


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
    with _STAGES.enter("identification"):
        if len(fitted) == 1:
            found = identify(logs[0], card, shifts[0], method)
            numbers = {fitted[0]: 0}
        else:
            _require_likelihood(method)
            found = identify_jointly(logs, card, shifts)
            numbers = {k: number for number, k in enumerate(fitted, 1)}
    with _STAGES.enter("simulation", "simulating the shifts"):
        found, twins = _attach_simulations(found, card, logs)
    with _STAGES.enter("prediction", "predicting what was held out"):
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
        twin = build_twin(found, card)
        return attach_validation(found, twin, logs[0]), {logs[0].source: twin}
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

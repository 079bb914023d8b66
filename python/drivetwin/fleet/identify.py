# SPDX-License-Identifier: MIT
"""One log of a fleet, or the bus logs of one vehicle: `drivetwin identify` down to the rows.

A design prior pulls the estimate of every log in the same direction: averaged over a fleet it would
count once for each log and hide ageing. It is therefore removed from friction and fill pressure.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.mapping_file import read_mapping
from drivetwin.channels.roles import ReadOptions
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import (
    DrivetwinError,
    FileFormatError,
    InputError,
    MissingChannelError,
    StoreError,
    Where,
)
from drivetwin.estimation.direct.friction_law import P0, evaluate_stribeck
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.mechanism import quick
from drivetwin.estimation.likelihood.parametrization import LAW
from drivetwin.estimation.result.estimate import Z95, FrictionCurve, Verdict
from drivetwin.estimation.result.prior_conflict import remove_prior
from drivetwin.estimation.result.verdict import assess, reject_identified
from drivetwin.fleet.parts import convert_write_errors
from drivetwin.fleet.rules import name_members
from drivetwin.fleet.scan import compute_input_hashes
from drivetwin.fleet.task import (
    MU,
    Found,
    Row,
    RowKind,
    ShiftRow,
    Task,
    TaskSpec,
    make_estimate_row,
)
from drivetwin.likelihood.covariance import invert_information
from drivetwin.logs.formats.detect import NOTHING_STATED, open_recording
from drivetwin.logs.read import read_log
from drivetwin.parameters import get_parameter_spec
from drivetwin.pipeline import identify
from drivetwin.report.blocks import Page
from drivetwin.report.bus import BusOutcome, identify_vehicle
from drivetwin.report.html import build_report_page, save_library, save_page
from drivetwin.shifts.detect import FoundShifts, require_shifts
from drivetwin.twin.build import build_twin
from drivetwin.validation.simulate_log import attach_validation
from drivetwin.vehicle.card import VehicleCard, load_card, load_ratio_card

LIBRARY = "plotly.js"


def _save_page(path: Path, page: Page) -> None:
    library = path.with_name(LIBRARY)
    if not library.is_file():
        save_library(library)
    save_page(path, page, LIBRARY)


_LAW_SIZE = P0


@dataclass(frozen=True)
class FreeFriction:
    """μ at a slip, and P0 [Pa], with their standard deviations, of the log alone."""

    mu: float
    mu_std: float
    P0: float
    P0_std: float


def remove_friction_prior(
    found: Identification, card: VehicleCard, element: str, slip: float
) -> FreeFriction | None:
    """Friction at `slip` [rad/s] and P0 of an element without the card's prior of P0.

    None if the method yields no covariance of the two, or the log has no data on P0 itself.
    """
    posterior = _get_posterior(found, element)
    if posterior is None:
        return None
    theta, covariance, total = posterior
    mu, slopes = evaluate_stribeck(theta, np.array([slip]))
    to_pair = np.zeros((2, _LAW_SIZE + 1))
    to_pair[0, :_LAW_SIZE] = slopes[:, 0]
    to_pair[1, P0] = 1.0
    pair = np.array([float(mu[0]), theta[P0]])
    prior = card.elements[element].P0
    pairs = (to_pair @ one @ to_pair.T for one in (covariance, total))
    freed = remove_prior(pair, next(pairs), 1, prior, next(pairs))
    if freed is None:
        return None
    values, spread = freed
    stds = np.sqrt(np.diag(spread))
    return FreeFriction(float(values[0]), float(stds[0]), float(values[1]), float(stds[1]))


def _get_posterior(
    found: Identification, element: str
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Friction law and P0 (5,) of an element with two covariances: that of log and priors, and
    the one widened by all else."""
    fit = found.evidence.likelihood
    wanted = [f"{element}.{key}" for key in (*LAW, "P0")]
    if fit is None or not set(wanted) <= set(fit.point.names):
        return None
    place = [fit.point.names.index(name) for name in wanted]
    inverse = invert_information(fit.normal.information)
    rows = np.ix_(place, place)
    return fit.point.values[place], inverse[rows], fit.covariance[rows]


_CARDS = 64
"""Cards that a worker keeps at hand."""


def identify_log(task: Task) -> Found:
    """Identify one log, and write its report where one is wanted.

    Raises the typed errors of each stage for a log that cannot be used, StoreError where the report
    cannot be written or the card is another by now, OSError where the drive fails that the log is
    on.
    """
    recipe = task.recipe
    _check_inputs(recipe)  # before, for what is broken by now is not the log's fault
    mapping = None if recipe.channels is None else Path(recipe.channels)
    if task.members:
        found_together = identify_members(task, mapping)
        _check_inputs(recipe)
        means = [*_average_means(task, mapping), *found_together.rows]
        return replace(found_together, rows=means)
    card = _load_card(recipe)
    log = read_log(Path(task.path), card, mapping or NOTHING_STATED)
    _check_inputs(recipe)
    if log.sha256 != task.content:
        raise FileFormatError(
            "the file changed while the fleet was at work",
            "run the same command again when it is complete",
            Where(file=task.path),
        )
    found_shifts = require_shifts(log, card)
    with quick(recipe.quick):
        found = identify(log, card, found_shifts, recipe.method)
    twin = build_twin(found, card)
    found = attach_validation(found, twin, log)
    if task.report is not None:
        with convert_write_errors():
            _save_page(Path(task.report), build_report_page(found, [log]))
    rows = [*_compute_channel_means(task, mapping), *make_result_rows(found, card, recipe.mu_slip)]
    return Found(rows, make_shift_rows(found_shifts))


@lru_cache(_CARDS)
def _load_card(recipe: TaskSpec) -> VehicleCard:
    """The card of a recipe, which holds the file's hash: a changed card is another recipe."""
    return load_card(Path(recipe.vehicle))


def _check_inputs(recipe: TaskSpec) -> None:
    """Raise StoreError if card or mapping changed after the log's key was computed."""
    try:
        same = compute_input_hashes(recipe.vehicle, recipe.channels) == recipe.inputs
    except (OSError, InputError):
        same = False
    if not same:
        raise StoreError(
            "the vehicle card or the channel mapping changed while the fleet was at work",
            "run the same command again: logs identified with the old ones are identified anew",
            Where(file=recipe.vehicle),
        )


def _compute_channel_means(task: Task, mapping: Path | None) -> Iterator[Row]:
    """Mean of each channel that is a field of the log, in the file's unit.

    A channel without any value has no mean and gets a warning. Raises MissingChannelError.
    """
    if not task.recipe.means:
        return
    options = ReadOptions() if mapping is None else read_mapping(mapping).options
    with open_recording(Path(task.path), options) as recording:
        names = [column.name for column in recording.columns]
        for field, channel in task.recipe.means:
            if channel not in names:
                raise MissingChannelError(
                    f"no channel {channel!r}, whose mean is the field {field!r}",
                    "correct [fields] of the rules, or leave such logs to another rule",
                    Where(file=task.path),
                )
            column = names.index(channel)
            values = recording.load(column).values
            known = values[np.isfinite(values)]
            if not known.size:
                text = f"channel {channel!r} holds no value, so the log has no field {field!r}"
                yield Row(RowKind.WARNING, "", reason=text)
                continue
            unit = recording.columns[column].unit or ""
            yield Row(RowKind.FIELD, field, float(np.mean(known)), si_unit=unit)


def _average_means(task: Task, mapping: Path | None) -> Iterator[Row]:
    """Average the means of channels over the bus logs of a vehicle; repeat all other rows."""
    means: dict[str, list[Row]] = {}
    for path, _ in task.members:
        for row in _compute_channel_means(replace(task, path=path), mapping):
            if row.kind is RowKind.FIELD:
                means.setdefault(row.name, []).append(row)
            else:
                yield row
    for rows in means.values():
        mean = float(np.mean([row.value for row in rows if row.value is not None]))
        yield replace(rows[0], value=mean)


def make_shift_rows(found: FoundShifts) -> list[ShiftRow]:
    """Used shifts, then refused ones."""
    used = [
        ShiftRow(
            used=True,
            start=shift.torque_phase[0],
            end=shift.lockup_time,
            start_gear=shift.start_gear,
            end_gear=shift.end_gear,
            kind=shift.kind.value,
            offgoing=shift.offgoing,
            oncoming=shift.oncoming,
        )
        for shift in found.shifts
    ]
    refused = [ShiftRow(False, *one.time, reason=one.reason) for one in found.rejected]
    return [*used, *refused]


def make_result_rows(found: Identification, card: VehicleCard, mu_slip: float) -> list[Row]:
    """All rows of an identification; `mu_slip` [rad/s] is where friction is compared."""
    return [
        *_make_parameter_rows(found, card, mu_slip),
        *(
            row
            for name, curve in found.friction.items()
            if not curve.is_borrowed
            for row in _make_friction_rows(name, curve)
        ),
        *_make_fit_rows(found),
        *(
            Row(RowKind.QUALITY, name, float(value), shift=number)
            for number, shift in enumerate(found.shifts)
            for name, value in shift.quality.items()
        ),
        *(Row(RowKind.WARNING, one.code.value, reason=one.text) for one in found.findings),
    ]


def _make_parameter_rows(found: Identification, card: VehicleCard, slip: float) -> list[Row]:
    """All estimates, with μ at one slip of every element whose curve reaches it."""
    rows = {one.id: make_estimate_row(one) for one in found.estimates.values()}
    own = {name: curve for name, curve in found.friction.items() if not curve.is_borrowed}
    for element, curve in own.items():
        mu, fill = MU + element, f"P0.{element}"
        free = remove_friction_prior(found, card, element, slip)
        if curve.slip[0] <= slip <= curve.slip[-1]:
            rows[mu] = _make_mu_row(mu, curve, slip)
            if free is not None:
                rows[mu] = replace(rows[mu], free_value=free.mu, free_std=free.mu_std)
        if free is not None and fill in rows:
            rows[fill] = replace(rows[fill], free_value=free.P0, free_std=free.P0_std)
    return list(rows.values())


def _make_mu_row(name: str, curve: FrictionCurve, slip: float) -> Row:
    """μ at one slip of a curve, judged like any estimate by the width of its band.

    The band contains all errors but that of the gain on the card, which all logs share. A curve
    has no part by noise alone.
    """
    curve = curve.drop_gain_spread()
    spec = get_parameter_spec(name)
    mu, low, high = (
        float(np.interp(slip, curve.slip, values))
        for values in (curve.mu, curve.mu_lo, curve.mu_hi)
    )
    if not np.isfinite([low, high]).all():
        verdict = Verdict.WEAK.value
        return Row(
            RowKind.PARAMETER, name, mu, si_unit=spec.unit, verdict=verdict,
            method=curve.method_text, at=slip,
        )  # fmt: skip
    std = (high - low) / (2.0 * Z95)
    one = assess(name, mu, std, curve.method_text)
    if curve.verdict is not Verdict.IDENTIFIED:
        one = reject_identified(one, curve.reason)
    return replace(make_estimate_row(one), std_noise=None, at=slip)


def _make_friction_rows(element: str, curve: FrictionCurve) -> Iterator[Row]:
    bands = zip(curve.slip, curve.mu, curve.mu_lo, curve.mu_hi, strict=True)
    for slip, mu, low, high in bands:
        ends = (float(low), float(high)) if np.isfinite([low, high]).all() else (None, None)
        yield Row(
            RowKind.FRICTION, element, float(mu), ci95_lo=ends[0], ci95_hi=ends[1],
            si_unit="1", method=curve.method_text, at=float(slip),
        )  # fmt: skip


def _make_fit_rows(found: Identification) -> Iterator[Row]:
    for signal, phases in found.fit.items():
        for phase, fit in phases.items():
            for figure, value in vars(fit).items():
                number = float(value) if np.isfinite(value) else None
                yield Row(RowKind.FIT, f"{signal}.{phase}.{figure}", number)


def identify_members(task: Task, mapping: Path | None) -> Found:
    """Identify a vehicle from its bus logs, and write its report where one is wanted.

    A log that cannot be read is left out with a warning. Raises the error of the last one if none
    can be read, FileFormatError for a log that changed, StoreError where the report cannot be
    written, OSError where the drive fails that a log is on.
    """
    names = name_members([path for path, _ in task.members])
    logs: list[ShiftLog] = []
    rows: list[Row] = []
    for (path, content), name in zip(task.members, names, strict=True):
        try:
            log = read_log(Path(path), None, mapping or NOTHING_STATED)
        except DrivetwinError as error:
            if len(rows) + 1 == len(task.members):
                raise
            text = f"{name} is left out: {error.what}"
            rows.append(Row(RowKind.WARNING, "", reason=text))
            continue
        if log.sha256 != content:
            raise FileFormatError(
                "the file changed while the fleet was at work",
                "run the same command again when it is complete",
                Where(file=path),
            )
        logs.append(replace(log, source=name))
    outcome = identify_vehicle(logs, load_ratio_card(Path(task.recipe.vehicle)))
    if task.report is not None:
        with convert_write_errors():
            (_save_page(Path(task.report), outcome.build_page()))
    return Found([*_make_rows(outcome), *rows], list(_make_shift_rows(outcome)))


def _make_rows(outcome: BusOutcome) -> Iterator[Row]:
    """Yield the rows of all estimates and findings."""
    yield from map(make_estimate_row, outcome.found.estimates.values())
    for one in (*outcome.remarks, *outcome.found.findings):
        yield Row(RowKind.WARNING, one.code.value, reason=one.text)


def _make_shift_rows(outcome: BusOutcome) -> Iterator[ShiftRow]:
    for shift in outcome.found.shifts:
        span = shift.phases[0][1][0], shift.phases[-1][1][1]
        yield ShiftRow(True, *span, start_gear=shift.start_gear, end_gear=shift.end_gear)

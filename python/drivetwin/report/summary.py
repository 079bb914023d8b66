# SPDX-License-Identifier: MIT
"""Sections on simulation over measurement, the log with its shift phases, and friction."""

from __future__ import annotations

import math
from collections.abc import Mapping

from drivetwin._util.display_units import (
    BAR,
    NM,
    RAD_PER_S,
    RPM,
    Display,
    format_significant,
    format_uncertainty,
    format_with_unit,
)
from drivetwin._util.optional_dependencies import get_program_version
from drivetwin.actuator.model import (
    QUANTITIES,
    ActuatorQuantity,
    ActuatorSource,
    IdentifiedActuator,
)
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.identification import OIL_TEMPERATURE, Identification
from drivetwin.estimation.result.estimate import Z95, FrictionCurve
from drivetwin.estimation.result.validation import Validation
from drivetwin.findings import render
from drivetwin.likelihood.output import SignalFit
from drivetwin.report.blocks import (
    Block,
    Cell,
    FigureBlock,
    Section,
    TableBlock,
    Tone,
    make_link,
    make_notes,
    make_number,
    make_table,
)
from drivetwin.report.figure import get_channel_display, get_channel_label
from drivetwin.report.validation import (
    plot_friction,
    plot_further_signals,
    plot_log,
    plot_shift_phases,
    plot_validation,
)
from drivetwin.shifts.shift import Shift, make_shift_labels
from drivetwin.twin.build import list_borrowed_friction
from drivetwin.validation.simulate_log import EXTRA_SIGNALS, SIGNALS, pool_fits
from drivetwin.vehicle.spec import ShiftKind

Fits = Mapping[str, SignalFit]
"""Fit by phase."""

PHASES = {
    "all": "whole",
    "before": "1 before",
    "torque": "2 torque phase",
    "inertia": "3 inertia phase",
    "after": "4 after lock-up",
}

FITS = 80.0
"""Fit [%] from which the simulation counts as one of the signal ..."""
UNEVEN = 1.5
"""... in every phase too that has an error so many times that of the whole."""


FIT_CAPTION = (
    "Simulation against measurement: fit % = 100·(1 − ‖y − ŷ‖ / ‖y − mean(y)‖). The mean is over "
    "the whole log in each phase. Below is the root mean square error. If a signal hardly moves, "
    "fit % is low although only noise is left: use the error in its unit."
)


def build_fit_table(fit: Mapping[str, Fits], caption: str = FIT_CAPTION) -> TableBlock:
    """Fit % and rmse by signal and phase; the phase that the simulation misses is marked."""
    return build_labelled_fits({"": fit}, caption)


def build_labelled_fits(
    fits: Mapping[str, Mapping[str, Fits]], caption: str, label: str = ""
) -> TableBlock:
    """Table of several fits, by name in a first column with the head `label`, if it has one."""
    rows = [
        (*([name] if label else ()), get_channel_label(signal), *_make_phase_cells(signal, phases))
        for name, fit in fits.items()
        for signal, phases in fit.items()
    ]
    columns = (*([label] if label else ()), "signal", *map(make_number, PHASES.values()))
    return make_table(caption, columns, rows)


def _make_phase_cells(signal: str, fits: Fits) -> list[Cell]:
    missed = find_missed_phase(fits) if "all" in fits else ""
    return [make_fit_cell(fits.get(one), signal, doubtful=one == missed) for one in PHASES]


def make_fit_cell(fit: SignalFit | None, signal: str, *, doubtful: bool = False) -> Cell:
    """Format the fit in % with the error in its unit below; a dash without a fit."""
    if fit is None:
        return make_number("–")
    display = get_channel_display(signal)
    note = f"{format_significant(fit.rmse * display.factor, 3)} {display.label}"
    text = f"{fit.fit_percent:z.1f} %" if math.isfinite(fit.fit_percent) else "–"
    tone = Tone.DOUBTFUL if doubtful else Tone.PLAIN
    return Cell(text, number=True, badge=doubtful, tone=tone, note=note)


def find_missed_phase(fits: Fits) -> str:
    """Phase of a signal that the simulation misses: "all", else the worst; empty for none.

    A phase in which the signal hardly moves has a low fit although only noise is left, of which it
    has no more than the others.
    """
    whole = fits["all"]
    if not whole.fit_percent >= FITS:
        return "all"
    uneven = [phase for phase, one in fits.items() if one.rmse > UNEVEN * whole.rmse]
    low = [phase for phase in uneven if fits[phase].fit_percent < FITS]
    return min(low, key=lambda phase: fits[phase].fit_percent, default="")


_TORQUE_PHASE = {
    ShiftKind.POWER_ON_UP: "the on-coming element takes over torque, the output torque dips",
    ShiftKind.POWER_OFF_DOWN: "the on-coming element takes over torque",
    ShiftKind.POWER_OFF_UP: "empty where the on-coming element takes hold only later",
    ShiftKind.POWER_ON_DOWN: "empty where the on-coming element takes hold only later",
    ShiftKind.POWER_UNKNOWN_UP: "the on-coming element takes over torque where the power is on",
    ShiftKind.POWER_UNKNOWN_DOWN: "the on-coming element takes over torque where the power is off",
}

OF_TORQUE = (
    "The clutch torque follows from the output torque (eq. 16, with the output side's inertia), "
    "the slip from both speeds (eq. 15); μ = T_c / (N·D·A·r·(P − P0))."
)
OF_SPEEDS = (
    "The log has no output torque: the clutch torque follows from engine torque and speeds, and is "
    "known over η only. The curve is therefore "
    "μ/η = T_c/η / (N·D·A·r·(P − P0)), the slip from both speeds (eq. 15); the twin has μ where "
    "the vehicle card states η."
)

_OF_SIMULATION = (
    "inputs, then each output as measured (thin) and simulated, with the residual below. While an "
    "element slips, the noise of its pressure sensor passes into the simulated torque and output "
    "speed, and moves the lock-up by a millisecond or two: the residual then rings after it."
)


def describe_phases(kind: ShiftKind) -> str:
    """Describe the numbers of the four phases in a shift of this kind."""
    return (
        f"1 gear held before the shift · 2 torque phase: {_TORQUE_PHASE[kind]} · 3 inertia phase: "
        f"the input speed {'falls' if kind.is_up else 'rises'} to that of the new gear · "
        "4 new gear locked, lock-up oscillation."
    )


def build_shift_section(found: Identification, log: ShiftLog) -> Section:
    """Measured signals with the detected phases, one figure per shift."""
    blocks: list[Block] = []
    if len(found.shifts) > 1:
        text = "The whole log; each button shows one shift of those that were used."
        blocks.append(FigureBlock(plot_log(log, found.shifts), text))
    for name, shift in zip(make_shift_labels(found.shifts), found.shifts, strict=True):
        title = f"Shift {name}, {shift.kind.value}. "
        blocks.append(
            FigureBlock(
                plot_shift_phases(log, shift),
                title + describe_phases(shift.kind),
                make_link(shift),
            )
        )
        blocks.append(build_phase_table(name, shift))
        blocks += make_notes("About this shift", render(shift.findings), Tone.DOUBTFUL)
    texts = [f"{r.time[0]:z.2f} to {r.time[1]:z.2f} s: {r.reason}" for r in found.rejected]
    blocks += make_notes("Not used", texts)
    return Section(
        "shift",
        "The log and its phases",
        "Measured signals with the phases of the shift.",
        blocks,
    )


def build_phase_table(name: str, shift: Shift) -> TableBlock:
    """Phases of a shift, with the 95 % interval of the start of each."""
    spans = (
        (f"1 gear {shift.start_gear} held", shift.before, ""),
        ("2 torque phase", shift.torque_phase, "torque_start"),
        ("3 inertia phase", shift.inertia_phase, "inertia_start"),
        (f"4 gear {shift.end_gear} locked", (shift.lockup_time, shift.after[1]), "lockup"),
    )
    rows = []
    for label, (start, end), boundary in spans:
        sigma = shift.sigma.get(boundary)
        doubt = f"± {format_significant(1e3 * Z95 * sigma, 2)} ms" if sigma else ""
        rows.append((label, start, doubt, end, 1e3 * (end - start)))
    columns = (
        "phase",
        ("starts [s]", "z.3f"),
        ("± 95 %", "s"),
        ("ends [s]", "z.3f"),
        ("lasts [ms]", "z.0f"),
    )
    elements = f"{shift.kind}, {shift.offgoing} off-going, {shift.oncoming} on-coming."
    return make_table(f"Phases of shift {name}: {elements}", columns, rows)


def build_friction_section(found: Identification) -> Section:
    """μ over slip of every element, for the gain on the card, with its verdict."""
    blocks: list[Block] = []
    for element, curve in found.friction.items():
        caption = f"Friction of {element}, {_describe_verdict(curve).rstrip('.')}. "
        blocks.append(FigureBlock(plot_friction(element, curve), caption + _format_law(curve)))
    if found.friction:
        blocks.append(build_friction_table(found.friction))
    over_eta = any(curve.over_eta for curve in found.friction.values())
    return Section(
        "friction",
        "Friction over slip",
        f"{OF_SPEEDS if over_eta else OF_TORQUE} A log determines only the "
        "product of μ and the gain N·D·A·r, the parameter μ·gain: μ is for the gain on the vehicle "
        "card, and a wrong gain scales the whole curve. Points that "
        "scatter at one slip belong to the torque phase, in which the element transmits little.",
        blocks,
    )


def _describe_verdict(curve: FrictionCurve) -> str:
    """Describe method, gain and verdict of a curve."""
    if curve.is_borrowed:
        return f"{curve.verdict.value}: {curve.reason}"
    gain = ""
    if curve.gain is not None:
        article = "an assumed" if curve.has_assumed_gain else "a"
        size = format_with_unit(curve.gain.value, "m^3", curve.gain.std)
        gain = f" for {article} gain of {size}"
    return f"{curve.verdict.value}{gain}, method: {curve.method_text}"


def _format_law(curve: FrictionCurve) -> str:
    if (law := curve.stribeck) is None:
        return "No Stribeck law fits within the range seen; the smoothed curve is used."
    return (
        f"Stribeck law {curve.symbol} = μ_c + (μ_s − μ_c)·exp(−|s|/v_s) + μ_v·|s| with "
        f"μ_c = {format_significant(law.mu_c)}, μ_s = {format_significant(law.mu_s)}, "
        f"v_s = {format_significant(law.v_s, 3)} rad/s, μ_v = "
        f"{format_significant(law.mu_v, 3)} s/rad."
    )


def build_validation_section(validations: tuple[Validation, ...]) -> Section:
    """Fit by phase, and simulation over measurement (Fig. 11)."""
    blocks: list[Block] = []
    if validations:
        fit = pool_fits(validations, (*SIGNALS, *EXTRA_SIGNALS))
        blocks.append(build_fit_table(fit))
    names = make_shift_labels([one.shift for one in validations])
    for name, one in zip(names, validations, strict=True):
        text = f"Shift {name}: {_OF_SIMULATION}"
        blocks.append(FigureBlock(plot_validation(one), text, make_link(one.shift)))
        figure = plot_further_signals(one)
        if figure.panels:
            text = f"Shift {name}: slip of the shift elements, and speeds beyond those of the fit."
            blocks.append(FigureBlock(figure, text, make_link(one.shift)))
        blocks.append(_build_event_table(one))
    return Section(
        "validation",
        "Simulation over measurement",
        "Measured engine torque and pressures drive the identified model. It has no other input "
        "after the start.",
        blocks,
    )


def _build_event_table(validation: Validation) -> TableBlock:
    """Changes of friction mode; filling and venting repeat with every ripple of the pressure."""
    rows = [
        (event.time, event.element, event.kind.replace("_", " "))
        for event in validation.trajectory.events
        if event.kind not in ("fill", "vent")
    ]
    caption = f"Events of the simulation (status: {validation.status})."
    return make_table(caption, (("time [s]", "z.4f"), "element", "event"), rows)


def build_friction_table(friction: Mapping[str, FrictionCurve]) -> TableBlock:
    """μ with its 95 % band at the ends and the middle of the slip range seen, and its verdict."""
    rows = []
    for name, curve in friction.items():
        first = (f"{name} ({curve.symbol})" if curve.over_eta else name, curve.verdict_text)
        for index in (0, curve.slip.size // 2, curve.slip.size - 1):
            half = 0.5 * float(curve.mu_hi[index] - curve.mu_lo[index])
            value, width = format_uncertainty(float(curve.mu[index]), half)
            rows.append((first[0], curve.slip[index], value, width, first[1]))
            first = ("", "")
    columns = ("element", ("slip [rad/s]", "z.1f"), ("μ", "s"), ("± 95 %", "s"), "verdict")
    return make_table("Friction, for the gains on the vehicle card", columns, rows)


_RANGES: dict[str, tuple[str, Display]] = {
    "slip": ("slip", RAD_PER_S),
    "pressure": ("pressure", BAR),
    "torque": ("engine torque", NM),
    "speed": ("engine speed", RPM),
    OIL_TEMPERATURE: ("oil temperature", Display("K")),
}


def build_provenance_section(found: Identification) -> Section:
    """Assumptions, range of validity, versions, hashes; the settings are in the result file."""
    blocks = make_notes("Assumed", (*found.assumptions, *list_borrowed_friction(found)))
    inputs = make_table("Inputs.", ("file", "SHA-256"), found.inputs.items())
    blocks += [_build_validity_table(found), inputs]
    return Section(
        "provenance",
        "Assumptions and origin",
        f"Made with drivetwin {get_program_version()}. All settings are in the result file.",
        blocks,
    )


def _build_validity_table(found: Identification) -> TableBlock:
    rows = []
    for name, ends in found.validity.items():
        stem, *gears = name.split(" ")
        label, display = _RANGES.get(stem, (stem, Display("SI")))
        label = f"{label} at the begin of {gears[0]}" if gears else label
        rows.append((label, *(end * display.factor for end in ends), display.label))
    return make_table(
        "Range covered by the log; the model is not validated outside it.",
        ("quantity", ("from", "4"), ("to", "4"), "unit"),
        rows,
    )


def build_actuator_section(found: Identification) -> Section:
    """One table of parameters with 95 % intervals for each element whose command is in the log."""
    blocks = [_build_table(name, one) for name, one in found.actuators.items()]
    return Section(
        "actuators",
        "Actuators",
        "Commanded to clutch pressure: hysteresis of the valve, dead time, fill of the clutch "
        "against its spring, second-order lag. The dead time includes that of a "
        "pressure sensor.",
        blocks,
    )


def _build_table(name: str, one: IdentifiedActuator) -> TableBlock:
    values, stds = one.model.values.tolist(), one.std.tolist()
    rows = [
        _build_row(spec, value, std)
        for spec, value, std in zip(QUANTITIES.values(), values, stds, strict=True)
    ]
    if one.source is ActuatorSource.SPEEDS:
        caption = f"Actuator of {name}, from command and speeds"
    else:
        rms = format_with_unit(one.rms, "Pa", digits=3)
        caption = f"Actuator of {name}: {one.samples} samples, residual {rms} rms"
    return make_table(caption, ("parameter", ("value, 95 %", "s")), rows)


def _build_row(spec: ActuatorQuantity, value: float, std: float) -> tuple[object, ...]:
    label = Cell(f"{spec.label} {spec.symbol}", note=spec.meaning)
    return label, format_with_unit(value, spec.unit, Z95 * std)

# SPDX-License-Identifier: MIT
"""Section on the hydraulics between command and clutch pressure."""

from __future__ import annotations

from math import isinf

from drivetwin._util.display_units import format_with_unit
from drivetwin.actuator.identify import ActuatorSource, IdentifiedActuator
from drivetwin.actuator.model import QUANTITIES, ActuatorQuantity
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Z95
from drivetwin.report.blocks import Cell, Section, TableBlock, Tone, make_table


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
    if one.source is ActuatorSource.TORQUE:
        caption = f"Actuator of {name}, from command and clutch torque: {one.samples} values, "
        caption += f"residual {one.rms:.2g} times the noise; usual ranges are priors"
    else:
        rms = format_with_unit(one.rms, "Pa", digits=3)
        caption = f"Actuator of {name}: {one.samples} samples, residual {rms} rms"
    return make_table(caption, ("parameter", ("value, 95 %", "s")), rows)


def _build_row(spec: ActuatorQuantity, value: float, std: float) -> tuple[object, ...]:
    label = Cell(f"{spec.label} {spec.symbol}", note=spec.meaning)
    if isinf(std):
        text = format_with_unit(value, spec.unit, digits=3)
        return label, Cell(text, number=True, note="assumed, not determined", tone=Tone.UNKNOWN)
    return label, format_with_unit(value, spec.unit, Z95 * std)

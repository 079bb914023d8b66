# SPDX-License-Identifier: MIT
"""`twin.toml`: the records of an identified model on disk, and their conversion to a twin."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, FiniteFloat

from drivetwin._util.arrays import to_plain_values
from drivetwin._util.check_arguments import check_arguments
from drivetwin._util.toml import Fault, parse_toml, raise_faults
from drivetwin.channels.roles import (
    BusOptions,
    ChannelSpec,
    ReadOptions,
    RememberedChannel,
    RememberedMapping,
    TimeColumn,
)
from drivetwin.errors import InputError, ResultFileError, Where, suggest_spelling
from drivetwin.estimation.result.estimate import LoadLaw
from drivetwin.estimation.result.method import Method
from drivetwin.files.records import (
    ActuatorRecord,
    CovarianceRecord,
    FrictionRecord,
    Interval,
    OptionalFloat,
    ParameterRecord,
    Record,
    SchemaName,
    read_record,
    write_toml,
)
from drivetwin.parameters import get_parameter_spec
from drivetwin.simulation.added_elements import Converter
from drivetwin.simulation.dual_clutch import LossLaw
from drivetwin.simulation.shift_control import SpeedSensor
from drivetwin.twin.twin import Twin, TwinElement, TwinGear
from drivetwin.vehicle.card import RATIO_TOLERANCE

TWIN_SCHEMA = "drivetwin/twin-2"
_HEADER = (
    "An identified driveline model; written by drivetwin. All values in SI units:",
    "rad, s, N*m, kg*m^2, Pa. A parameter without 'value' could not be determined from the log.",
)


class ChannelRecord(Record):
    """Reading of a role from a log: sign*(scale*column + offset) in `unit`, shifted in time.

    `file_unit` is the unit that the log named; `unit` overrides it.
    """

    source: str
    unit: str | None = None
    sign: int = 1
    scale: FiniteFloat = 1.0
    offset: FiniteFloat = 0.0
    time_shift: FiniteFloat = 0.0
    group: str | None = None
    file_unit: str | None = None

    def to_channel(self) -> RememberedChannel:
        """Return the channel as a mapping remembers it."""
        spec = self.model_dump(exclude={"file_unit"})
        return RememberedChannel(ChannelSpec(**spec), self.file_unit)


class LogRecord(Record):
    """Reading of whole logs: time column, reference torque, DBC files, ignored columns."""

    time_source: str | None = None
    time_unit: str | None = None
    simultaneous: bool = False
    reference_torque_Nm: OptionalFloat = None
    dbc: list[str] = Field(default_factory=list)
    ignored: list[str] = Field(default_factory=list)

    def to_options(self) -> ReadOptions:
        """Return the options of reading; DBC files by their names alone."""
        time = TimeColumn(self.time_source, self.time_unit, self.simultaneous)
        names = tuple(Path(Path(name).name) for name in self.dbc)
        bus = BusOptions(names, self.reference_torque_Nm)
        return ReadOptions(time, bus, tuple(self.ignored))


class TransmissionRecord(Record):
    """Transmission design data from the vehicle card."""

    i_in: FiniteFloat = Field(gt=0)
    final_drive: FiniteFloat = Field(gt=0)
    J_prime_range: Interval = Field(alias="J_prime_range_kgm2")
    J_vehicle_range: Interval = Field(alias="J_vehicle_range_kgm2")
    gears: dict[str, TwinGear]
    elements: dict[str, TwinElement]
    channels: dict[str, ChannelRecord] = Field(default_factory=dict)
    converter: Converter | None = None
    wheel_radius: FiniteFloat | None = Field(default=None, gt=0, alias="wheel_radius_m")


class TwinParameterRecord(ParameterRecord):
    """A parameter in TOML, which knows no null: without `value` where the log could not tell it."""

    value: OptionalFloat = None


class IdentifiedFile(Record):
    """Common part of a result and of a twin: method, laws, and where they come from."""

    schema_name: SchemaName
    version: str
    method: Method
    loss_law: LossLaw
    friction: dict[str, FrictionRecord]
    load: LoadLaw | None = None
    actuators: dict[str, ActuatorRecord] = Field(default_factory=dict)
    validity: dict[str, Interval]
    inputs: dict[str, str]
    settings: dict[str, Any]
    assumptions: list[str]


class TwinFile(IdentifiedFile):
    """The whole of `twin.toml`."""

    name: str
    transmission: TransmissionRecord
    log: LogRecord | None = None
    parameters: dict[str, TwinParameterRecord]
    covariance: CovarianceRecord | None = None
    sensors: dict[str, SpeedSensor] = Field(default_factory=dict)


TCU_TWIN_SCHEMA = "drivetwin/tcu-twin-1"
"""Schema of a twin from the log of a gearbox control."""
_MARK = f'schema = "{TCU_TWIN_SCHEMA.rpartition("-")[0]}-'
_HEAD = 2000
"""Characters in which a file names its schema."""


def is_tcu_twin(path: Path | str) -> bool:
    """Return True if a file is a twin from the log of a gearbox control."""
    try:
        if not Path(path).is_file():  # a pipe would keep the reader waiting
            return False
        with Path(path).open(encoding="utf-8", errors="replace") as file:
            return _MARK in file.read(_HEAD)
    except (OSError, ValueError):
        return False


def read_twin_file(path: Path | str) -> TwinFile:
    """Read and check `twin.toml`.

    Raises ResultFileError where the file is missing, damaged or of a newer schema, or where its
    tables contradict each other, and for a twin from the log of a gearbox control.
    """
    if is_tcu_twin(path):
        raise ResultFileError(
            "this twin is of all shifts of a gearbox with converter, from the log of its control",
            "give the file shift_GEAR-GEAR.toml beside it, the twin of one kind of shift, or "
            "simulate this one: 'drivetwin simulate TWIN LOG'",
            Where(file=str(path)),
        )
    content = read_record(path, parse_toml, TWIN_SCHEMA, TwinFile)
    raise_faults(
        find_twin_faults(content),
        ResultFileError,
        str(path),
        "correct these entries, or write the file again with 'drivetwin identify'",
    )
    return content


_ABOVE_ZERO = ("eta", "k_o")
"""Stems of what models and their starts divide by."""


def find_twin_faults(content: TwinFile) -> list[Fault]:
    """Return all faults of a file whose tables have the right form each."""
    checks = (_check_gears, _check_parameters, _check_friction, _check_actuators)
    return [fault for check in checks for fault in check(content)]


def _check_gears(content: TwinFile) -> Iterator[Fault]:
    """Gears are held by elements of the file, by whose ratios theirs is made."""
    transmission = content.transmission
    elements = transmission.elements
    held = Counter(gear.element for gear in transmission.gears.values())
    for name, gear in transmission.gears.items():
        key = f"transmission.gears.{name}"
        element = elements.get(gear.element)
        if element is None:
            text = f"no element {gear.element!r}{suggest_spelling(gear.element, elements)}"
            yield Fault(f"{key}.element", text)
            continue
        product = transmission.i_in * element.i_c * element.i_out
        # An element that holds several gears has the ratios of one of them.
        if held[gear.element] == 1 and abs(product - gear.ratio) > RATIO_TOLERANCE * gear.ratio:
            text = f"{gear.ratio:.6g}, but i_in·i_c·i_out of {gear.element} is {product:.6g}"
            yield Fault(f"{key}.ratio", text)


def _check_parameters(content: TwinFile) -> Iterator[Fault]:
    """Ids and units are those of the parameter table."""
    for name, one in content.parameters.items():
        key = f"parameters.{name}"
        try:
            spec = get_parameter_spec(name)
        except InputError as error:
            yield Fault(key, error.what)
            continue
        if one.unit != spec.unit:
            yield Fault(f"{key}.unit", f"{one.unit!r}, but the value is read in {spec.unit!r}")
        if spec.stem in _ABOVE_ZERO and one.value is not None and one.value <= 0.0:
            yield Fault(f"{key}.value", f"{one.value:g} is impossible; it must be above zero")


def _check_friction(content: TwinFile) -> Iterator[Fault]:
    """Curves belong to elements of the file and run over slips that increase."""
    elements = content.transmission.elements
    for name, curve in content.friction.items():
        key = f"friction.{name}"
        if name not in elements:
            yield Fault(key, f"no element {name!r}{suggest_spelling(name, elements)}")
        if any(a >= b for a, b in zip(curve.slip, curve.slip[1:], strict=False)):
            yield Fault(f"{key}.slip", "the slips do not increase")


def _check_actuators(content: TwinFile) -> Iterator[Fault]:
    """Actuators belong to elements of the file."""
    elements = content.transmission.elements
    for name in content.actuators:
        if name not in elements:
            text = f"no element {name!r}{suggest_spelling(name, elements)}"
            yield Fault(f"actuators.{name}", text)


_TWIN_FIELDS = (
    *("version", "name", "method", "loss_law", "parameters", "friction", "validity", "inputs"),
    *("settings", "assumptions", "actuators", "sensors"),
)
_GEARBOX_FIELDS = (
    *("i_in", "final_drive", "gears", "elements", "J_prime_range", "J_vehicle_range"),
    *("converter", "wheel_radius"),
)


def load_twin(path: Path | str) -> Twin:
    """Read `twin.toml`. Raises ResultFileError where it is damaged or of a newer schema."""
    return restore_twin(read_twin_file(path))


@check_arguments
def save_twin(path: Path | str, twin: Twin) -> None:
    """Write `twin.toml` atomically."""
    write_toml(path, _HEADER, build_twin_file(twin))


def build_twin_file(twin: Twin) -> TwinFile:
    """Records of a twin, ready to be written."""
    covariance = {"ids": twin.covariance_ids, "matrix": to_plain_values(twin.covariance)}
    return TwinFile.from_result(
        {name: getattr(twin, name) for name in _TWIN_FIELDS}
        | {
            "schema": TWIN_SCHEMA,
            "transmission": {
                **{name: getattr(twin, name) for name in _GEARBOX_FIELDS},
                "channels": {
                    role: {**vars(one.spec), "file_unit": one.file_unit}
                    for role, one in twin.mapping.channels.items()
                },
            },
            "log": _flatten_options(twin.mapping.options),
            "load": twin.load_law,
            "covariance": None if twin.covariance is None else covariance,
            "settings": to_plain_values(dict(twin.settings)),
        }
    )


def _flatten_options(options: ReadOptions) -> dict[str, Any] | None:
    """Record of the options; None where none was stated."""
    if options == ReadOptions():
        return None
    return {
        "time_source": options.time.source,
        "time_unit": options.time.unit,
        "simultaneous": options.time.simultaneous,
        "reference_torque_Nm": options.bus.reference_torque,
        "dbc": [path.name for path in options.bus.databases],
        "ignored": list(options.ignored),
    }


def restore_twin(content: TwinFile) -> Twin:
    """Build a twin from its records; `version` is that of the program that identified it."""
    gearbox, covariance = content.transmission, content.covariance
    same = {name: getattr(content, name) for name in _TWIN_FIELDS}
    design = {name: getattr(gearbox, name) for name in _GEARBOX_FIELDS}
    return Twin(
        **same
        | design
        | {
            "mapping": RememberedMapping(
                {role: one.to_channel() for role, one in gearbox.channels.items()},
                ReadOptions() if content.log is None else content.log.to_options(),
            ),
            "parameters": {name: one.to_estimate(name) for name, one in content.parameters.items()},
            "friction": {name: one.to_curve() for name, one in content.friction.items()},
            "assumptions": tuple(content.assumptions),
            "actuators": {name: one.to_actuator() for name, one in content.actuators.items()},
            "load_law": content.load,
            "covariance_ids": () if covariance is None else tuple(covariance.ids),
            "covariance": None if covariance is None else np.asarray(covariance.matrix),
        }
    )

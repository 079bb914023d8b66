# SPDX-License-Identifier: MIT
"""Conversion between a twin and its records in `twin.toml`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from drivetwin._util.check_arguments import check_arguments
from drivetwin._util.plain_values import to_plain_values
from drivetwin.channels.channel_spec import RememberedChannel, RememberedMapping
from drivetwin.channels.read_options import ReadOptions
from drivetwin.files.twin_file import TWIN_SCHEMA, TwinFile, read_twin_file, write_twin_file
from drivetwin.twin.twin import Twin, TwinElement, TwinGear

_TWIN_FIELDS = (
    *("version", "name", "method", "loss_law", "parameters", "friction", "validity", "inputs"),
    *("settings", "assumptions", "actuators"),
)
_GEARBOX_FIELDS = (
    *("i_in", "final_drive", "gears", "J_prime_range", "J_vehicle_range", "converter"),
)
_KEYS = {
    "gain": "gain_m3", "P0": "P0_Pa", "drum": "drum_inertia_kgm2",
    "J_prime_range": "J_prime_range_kgm2", "J_vehicle_range": "J_vehicle_range_kgm2",
}  # fmt: skip
"""Keys of the file by the attribute that they hold, where the two differ."""
_NAMES = {key: name for name, key in _KEYS.items()}


def load_twin(path: Path | str) -> Twin:
    """Read `twin.toml`. Raises ResultFileError where it is damaged or of a newer schema."""
    return restore_twin(read_twin_file(path))


@check_arguments
def save_twin(path: Path | str, twin: Twin) -> None:
    """Write `twin.toml` atomically."""
    write_twin_file(path, build_twin_file(twin))


def build_twin_file(twin: Twin) -> TwinFile:
    """Records of a twin, ready to be written."""
    covariance = {"ids": twin.covariance_ids, "matrix": to_plain_values(twin.covariance)}
    return TwinFile.from_result(
        {name: getattr(twin, name) for name in _TWIN_FIELDS}
        | {
            "schema": TWIN_SCHEMA,
            "transmission": {
                **_add_units({name: getattr(twin, name) for name in _GEARBOX_FIELDS}),
                "elements": {name: _add_units(vars(one)) for name, one in twin.elements.items()},
                "channels": {
                    role: _flatten_channel(one) for role, one in twin.mapping.channels.items()
                },
            },
            "log": _flatten_options(twin.mapping.options),
            "load": twin.load_law,
            "covariance": None if twin.covariance is None else covariance,
            "settings": to_plain_values(dict(twin.settings)),
        }
    )


def _flatten_channel(channel: RememberedChannel) -> dict[str, Any]:
    return {**vars(channel.spec), "file_unit": channel.file_unit}


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


def _add_units(fields: dict[str, Any]) -> dict[str, Any]:
    return {_KEYS.get(name, name): value for name, value in fields.items()}


def restore_twin(content: TwinFile) -> Twin:
    """Build a twin from its records; `version` is that of the program that identified it."""
    gearbox, covariance = content.transmission, content.covariance
    same = {name: getattr(content, name) for name in _TWIN_FIELDS}
    design = {name: getattr(gearbox, _KEYS.get(name, name)) for name in _GEARBOX_FIELDS}
    return Twin(
        **same
        | design
        | {
            "gears": {name: TwinGear(**dict(one)) for name, one in gearbox.gears.items()},
            "elements": {
                name: TwinElement(**{_NAMES.get(key, key): value for key, value in one})
                for name, one in gearbox.elements.items()
            },
            "mapping": RememberedMapping(
                {role: one.to_channel() for role, one in gearbox.channels.items()},
                ReadOptions() if content.log is None else content.log.to_options(),
            ),
            "converter": None if gearbox.converter is None else gearbox.converter.to_converter(),
            "parameters": {name: one.to_estimate(name) for name, one in content.parameters.items()},
            "friction": {name: one.to_curve() for name, one in content.friction.items()},
            "assumptions": tuple(content.assumptions),
            "actuators": {name: one.to_actuator() for name, one in content.actuators.items()},
            "load_law": None if content.load is None else content.load.to_law(),
            "covariance_ids": () if covariance is None else tuple(covariance.ids),
            "covariance": None if covariance is None else np.asarray(covariance.matrix),
        }
    )

# SPDX-License-Identifier: MIT
"""Labels of parameters and channels in tables and figures."""

from __future__ import annotations

from drivetwin._util.display_units import Display, get_display_unit
from drivetwin.channels.roles import get_command_element, get_pressure_element, get_quantity
from drivetwin.estimation.result.estimate import Estimate
from drivetwin.parameters import OVER_ETA, get_parameter_spec


def get_parameter_label(parameter_id: str) -> str:
    """Symbol with the gear or element it belongs to, e.g. `J′ (2)`."""
    spec = get_parameter_spec(parameter_id)
    suffix = parameter_id.removeprefix(spec.stem).removesuffix(OVER_ETA).lstrip("_.")
    return f"{spec.symbol} ({suffix})" if suffix else spec.symbol


def get_parameter_name(parameter_id: str) -> str:
    """Name before symbol, e.g. `Efficiency η` or `Inertia at engine J′ (2)`."""
    name = get_parameter_spec(parameter_id).name
    return f"{name[0].upper()}{name[1:]} {get_parameter_label(parameter_id)}"


def get_estimate_name(estimate: Estimate) -> str:
    """Name of an estimate: that of its parameter, or its own where the table has none."""
    return estimate.spec.name if estimate.spec else get_parameter_name(estimate.id)


def get_estimate_label(estimate: Estimate) -> str:
    """Symbol of an estimate: that of its parameter, or its own where the table has none."""
    return estimate.spec.symbol if estimate.spec else get_parameter_label(estimate.id)


def get_channel_label(role: str) -> str:
    """Role of a channel in words, e.g. `output torque` or `pressure B2`."""
    return role.replace("_", " ").replace(".", " ")


_SYMBOLS = {
    "engine_torque": "T_e",
    "output_torque": "T_o",
    "input_speed": "n_in",
    "engine_speed": "n_e",
    "output_speed": "n_out",
    "wheel_speed": "n_w",
}


def get_channel_symbol(role: str) -> str:
    """Return the symbol of a channel, e.g. `T_o` or `P B2`; the role itself without a symbol."""
    if (commanded := get_command_element(role)) is not None:
        return f"P* {commanded}"
    element = get_pressure_element(role)
    return _SYMBOLS.get(role, role) if element is None else f"P {element}"


def get_channel_display(role: str) -> Display:
    """Display unit of a channel by its role. Raises KeyError for a role that does not exist."""
    return get_display_unit(get_quantity(role).unit)

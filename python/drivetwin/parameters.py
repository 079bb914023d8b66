# SPDX-License-Identifier: MIT
"""The parameter table: every identified quantity is declared once, here.

Result tables, reports, exports and documentation derive from it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from drivetwin.errors import InputError


@dataclass(frozen=True)
class ParameterSpec:
    """One identified quantity.

    `stem` is the id without its gear or element suffix; `name` is in words, without an article, as
    tables show it before the symbol; `unit` is SI and ASCII;
    `lower` and `upper` bound every fit; `weak_above` is the relative half width of
    the 95 % interval from which the verdict is `weak`.
    """

    stem: str
    name: str
    symbol: str
    unit: str
    meaning: str
    lower: float
    upper: float
    suffix: str = ""
    """`gear`, `element`, `channel` or `log` where one value exists for each, else empty. Of one log
    alone the id is the stem itself; of several fitted together the number of the log, from 1,
    follows."""
    weak_above: float = 0.25


_SPECS = (
    ParameterSpec("eta", "efficiency", "η", "1", "lumped gear efficiency (eq. 3, 10)", 0.3, 1.2),
    ParameterSpec(
        "J_prime",
        "inertia at engine",
        "J′",
        "kg*m^2",
        "lumped inertia at the engine in a gear (eq. 10)",
        0.0,
        1e4,
        "gear",
    ),
    ParameterSpec(
        "J_out", "output inertia", "Jo′", "kg*m^2", "output side before the shaft (eq. 7)", 0.0, 1e4
    ),
    ParameterSpec(
        "J_vehicle",
        "vehicle inertia",
        "J_vehicle",
        "kg*m^2",
        "vehicle inertia at the wheel (eq. 9, 11)",
        0.0,
        1e7,
    ),
    ParameterSpec(
        "Tv_over_if", "load torque", "T_v/i_f", "N*m", "load torque over final drive", -1e6, 1e6,
        "log",
    ),
    ParameterSpec(
        "k_o", "shaft stiffness", "k_o", "N*m/rad", "output shaft stiffness (eq. 8, 14)", 0.0, 1e9
    ),
    ParameterSpec(
        "c_o", "shaft damping", "c_o", "N*m*s/rad", "output shaft damping (eq. 8, 14)", 0.0, 1e7
    ),
    ParameterSpec(
        "f_d", "lock-up frequency", "f_d", "Hz", "frequency of the lock-up oscillation", 0.0, 1e3,
        "gear",
    ),
    ParameterSpec(
        "zeta", "lock-up damping", "ζ", "1", "damping ratio of the lock-up oscillation", 0.0, 1.0,
        "gear",
    ),
    ParameterSpec(
        "P0", "fill pressure", "P0", "Pa", "pressure at which the clutch fill ends", 0.0, 1e7,
        "element",
    ),
    ParameterSpec(
        "mu_gain", "friction times gain", "μ·gain", "m^3",
        "friction times gain N·D·A·r, at the middle slip of the friction curve", 0.0, 10.0,
        "element",
    ),
    ParameterSpec(
        "ratio", "gear ratio", "i", "1",
        "input over output speed of a gear, without the input gear", 0.01, 100.0, "gear",
    ),
    ParameterSpec(
        "i_f", "final drive", "i_f", "1", "output over wheel speed", 0.01, 1000.0,
    ),
    ParameterSpec(
        "mu", "friction", "μ", "1", "friction at the slip where a fleet compares", 0.0, 1.0,
        "element",
    ),
    ParameterSpec(
        "drum", "drum inertia", "I_d", "kg*m^2",
        "inertia of the clutch drum, which rotates at slip speed (THEORY §2)", 0.0, 1e4, "element",
    ),
    ParameterSpec(
        "te_delay", "engine torque delay", "τ_e", "s",
        "delay of the engine torque signal", -1.0, 1.0, "log",
    ),
    ParameterSpec(
        "p_delay", "pressure delay", "τ_p", "s",
        "delay of the acting clutch pressures behind the logged ones", -1.0, 1.0,
    ),
    ParameterSpec(
        "mode_frequency", "input-shaft frequency", "f_s", "Hz",
        "frequency of the engine's share of J1 on the input shaft, with the gearbox held", 0.0, 1e3,
    ),
    ParameterSpec(
        "mode_share", "input-shaft share", "s_1", "1", "share of J1 in front of the input shaft",
        0.0, 1.0,
    ),
    ParameterSpec(
        "mode_damping", "input-shaft damping", "ζ_s", "1",
        "damping ratio of the engine's share of J1 on the input shaft", 0.0, 1.0,
    ),
    ParameterSpec("backlash", "backlash", "δ", "rad", "play of the output shaft", 0.0, 1.0),
    ParameterSpec(
        "tyre_slip", "tyre slip", "s_t", "1", "slip of the driven tyres at the reference torque",
        0.0, 0.5,
    ),
    ParameterSpec(
        "shaft_progression", "shaft progression", "a_o", "1",
        "factor a of the output shaft's torque k φ (1 + a ((k φ / T_r)² - 1/2))", -1.0, 1.0,
    ),
    ParameterSpec(
        "shaft_reference", "reference torque", "T_r", "N*m",
        "largest output torque of the log, to which tyre slip and progression refer", 0.0, 1e7,
    ),
)  # fmt: skip

SPECS: dict[str, ParameterSpec] = {spec.stem: spec for spec in _SPECS}

_BUS = (
    ParameterSpec(
        "speed_delay", "Delay relative to the input speed", "τ", "s",
        "delay of a speed on the bus relative to the input speed", -1.0, 1.0, "channel",
    ),
    ParameterSpec(
        "torque_delay", "Dead time of the torque message", "d", "s",
        "time by which the bus shows the engine torque later than it acts", -1.0, 1.0,
    ),
    ParameterSpec(
        "J_engine", "Engine inertia, clutch open", "J_e", "kg*m^2",
        "inertia of the engine side with the clutch open", 0.0, 1e3,
    ),
    ParameterSpec(
        "J_total", "Total inertia over η", "J/η", "kg*m^2",
        "J_v/η + i²·J_e at the gearbox output, in a gear", 0.0, 1e9, "gear",
    ),
    ParameterSpec(
        "J_vehicle_out", "Vehicle inertia over η", "J_v/η", "kg*m^2",
        "inertia of the vehicle at the gearbox output over the efficiency", 0.0, 1e9,
    ),
    ParameterSpec(
        "mass_over_eta", "Vehicle mass over η", "m/η", "kg",
        "mass of the vehicle over the efficiency, by final drive and wheel radius", 0.0, 1e9,
    ),
    ParameterSpec(
        "road_load", "Road load over η", "T_L/η", "N*m",
        "mean load torque at the gearbox output over the efficiency", -1e6, 1e6,
    ),
)  # fmt: skip

BUS_SPECS: dict[str, ParameterSpec] = {spec.stem: spec for spec in _BUS}
"""Quantities of bus logs alone."""


FINAL_DRIVE = "i_f"
"""Id of the final drive."""
OVER_ETA = "_over_eta"
"""Suffix of the id of a torque-like quantity divided by η. Without an output torque only this ratio
is identifiable."""


def make_ratio_id(gear: str) -> str:
    """Return the id of the ratio of a gear."""
    return f"ratio_{gear}"


def is_ratio(parameter_id: str) -> bool:
    """Return True for the ratio of a gear or of the final drive."""
    return parameter_id == FINAL_DRIVE or parameter_id.startswith(make_ratio_id(""))


def describe_ratio_id(parameter_id: str) -> str:
    """Return a ratio in words: `ratio of gear 2`, `final drive`."""
    if parameter_id == FINAL_DRIVE:
        return "final drive"
    return f"ratio of gear {parameter_id.removeprefix(make_ratio_id(''))}"


LAW_KEYS = ("mu_c", "mu_drop", "mu_v", "ln_v_s")
"""Coefficients of a friction law in which covariances are stated: μ_c, μ_s - μ_c, μ_v, ln v_s."""


def make_law_id(element: str, key: str) -> str:
    """Return the id of a coefficient of a friction law in the joint covariance of a twin."""
    return f"{key}.{element}"


def get_parameter_spec(parameter_id: str) -> ParameterSpec:
    """Return the declaration behind an id: `J_prime_2`, `P0.B3`, `te_delay.1`, `k_o_over_eta`.

    Raises InputError for an id that no declaration covers.
    """
    exact = SPECS.get(parameter_id) or BUS_SPECS.get(parameter_id)
    if exact is not None:
        return exact
    if parameter_id.endswith(OVER_ETA):
        whole = get_parameter_spec(parameter_id.removesuffix(OVER_ETA))
        return replace(whole, symbol=f"{whole.symbol}/η", meaning=f"{whole.meaning}, over η")
    for spec in (*_SPECS, *_BUS):
        separator = {"gear": "_", "element": ".", "channel": ".", "log": "."}.get(spec.suffix)
        if separator and parameter_id.startswith(spec.stem + separator):
            return spec
    raise InputError(
        f"unknown parameter id {parameter_id!r}", f"use one of {', '.join(sorted(SPECS))}"
    )


def split_log_number(parameter_id: str) -> tuple[str, int]:
    """The id without the number of its log, and that number; 0 where it has none.

    Raises InputError for an id that no declaration covers.
    """
    ending = OVER_ETA if parameter_id.endswith(OVER_ETA) else ""
    stem, _, number = parameter_id.removesuffix(ending).partition(".")
    if get_parameter_spec(parameter_id).suffix != "log" or not number.isdecimal():
        return parameter_id, 0
    return stem + ending, int(number)

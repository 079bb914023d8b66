# SPDX-License-Identifier: MIT
"""Smooth models of three problems for CasADi: friction and contact regularised by tanh.

They are written from the equations, independent of the simulator. A clutch carries
capacity · tanh(slip/WIDTH), so it creeps where the exact one holds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

WIDTH = 0.01
"""Slip over which the friction torque reverses [rad/s]."""
SOFT = 2.0
"""Torque over which a contact closes [N·m]."""

Symbols = Mapping[str, Any]


@dataclass(frozen=True)
class SmoothModel:
    """Equations of a problem.

    `rates(states, unknowns, inputs)` returns the derivatives of the states by name;
    `read(states, unknowns)` the outputs; `begin(unknowns, start)` the start of the states by the
    start values of the problem.
    """

    states: tuple[str, ...]
    rates: Callable[[Symbols, Symbols, Symbols], Symbols]
    read: Callable[[Symbols, Symbols], Symbols]
    begin: Callable[[Symbols, Symbols], Symbols]


def clutch_torque(
    slip: Any, pressure: Any, law: tuple[Any, Any, float, float], plates: tuple[float, float]
) -> Any:
    """Return the torque on the driven side.

    `law` is mu_c, mu_s, v_s, mu_v, and `plates` gain and p0.
    """
    import casadi

    mu_c, mu_s, v_s, mu_v = law
    gain, p0 = plates
    size = casadi.sqrt(slip**2 + WIDTH**2)
    mu = mu_c + (mu_s - mu_c) * casadi.exp(-size / v_s) + mu_v * size
    return mu * gain * casadi.fmax(pressure - p0, 0.0) * casadi.tanh(slip / WIDTH)


def _rate_shift(x: Symbols, p: Symbols, u: Symbols) -> Symbols:
    law = (p["mu_c"], p["mu_s"], 12.0, 3e-5)
    plates = (0.06, 0.8e5)
    twist_in = p["k_in"] * x["twist_in"] + p["c_in"] * (x["crank"] - x["in"])
    axle = 4.0 * x["wheel"]
    twist_out = p["k_o"] * x["twist_out"] + p["c_o"] * (x["out"] - axle)
    second = clutch_torque(x["in"] / 2.143 - x["out"], u["B2"], law, plates)
    third = clutch_torque(x["in"] / p["ratio_3"] - x["out"], u["B3"], law, plates)
    return {
        "crank": (u["Te"] - twist_in) / p["J1a"],
        "in": (twist_in - second / 2.143 - third / p["ratio_3"]) / p["J1b"],
        "out": (second + third - twist_out) / 0.9,
        "wheel": (4.0 * twist_out - p["Tv"]) / p["Jv"],
        "twist_in": x["crank"] - x["in"],
        "twist_out": x["out"] - axle,
    }


def _read_shift(x: Symbols, p: Symbols) -> Symbols:
    torque = p["k_o"] * x["twist_out"] + p["c_o"] * (x["out"] - 4.0 * x["wheel"])
    return {
        "engine_speed": x["crank"],
        "output_speed": x["out"],
        "wheel_speed": x["wheel"],
        "output_torque": torque,
    }


def _begin_shift(_: Symbols, start: Symbols) -> Symbols:
    return {
        "crank": start["crank"],
        "in": start["in"],
        "out": start["in"] / 2.143,
        "wheel": start["wheel"],
        "twist_in": start["input shaft"],
        "twist_out": start["output shaft"],
    }


def _rate_engine_start(x: Symbols, p: Symbols, u: Symbols) -> Symbols:
    import casadi

    law = (p["mu_c"], p["mu_s"], 15.0, 0.0)
    torque = clutch_torque(x["motor"] - x["engine"], u["K0"], law, (0.01, 0.8e5))
    shaft = p["k"] * x["twist"] + p["c"] * (x["motor"] - x["wheel"])
    drag = p["drag"] * casadi.tanh(x["engine"] / WIDTH)
    return {
        "engine": (u["Te"] + torque - drag) / p["Je"],
        "motor": (u["Tm"] - torque - shaft) / p["Jm"],
        "wheel": shaft / p["Jv"],
        "twist": x["motor"] - x["wheel"],
    }


def _rate_tip_in(x: Symbols, p: Symbols, u: Symbols) -> Symbols:
    import casadi

    def push(twist: Any, rate: Any) -> Any:
        reach = twist - 0.5 * p["gap"]
        closed = 0.5 * (1.0 + casadi.tanh(p["k"] * reach / SOFT))
        elastic = 0.5 * (p["k"] * reach + casadi.sqrt((p["k"] * reach) ** 2 + SOFT**2))
        return elastic + closed * p["c"] * rate

    rate = x["motor"] - x["wheel"]
    torque = push(x["twist"], rate) - push(-x["twist"], -rate)
    return {
        "motor": (u["Tm"] - torque) / p["Jm"],
        "wheel": torque / p["Jv"],
        "twist": rate,
    }


def _begin_engine_start(_: Symbols, start: Symbols) -> Symbols:
    return {**{one: start[one] for one in ("engine", "motor", "wheel")}, "twist": start["shaft"]}


def _begin_tip_in(_: Symbols, start: Symbols) -> Symbols:
    return {"motor": start["motor"], "wheel": start["wheel"], "twist": start["play"]}


def _read_speeds(*nodes: str) -> Callable[[Symbols, Symbols], Symbols]:
    return lambda x, _: {f"{one}_speed": x[one] for one in nodes}


SMOOTH: dict[str, SmoothModel] = {
    "shift": SmoothModel(
        ("crank", "in", "out", "wheel", "twist_in", "twist_out"),
        _rate_shift,
        _read_shift,
        _begin_shift,
    ),
    "engine start": SmoothModel(
        ("engine", "motor", "wheel", "twist"),
        _rate_engine_start,
        _read_speeds("engine", "motor", "wheel"),
        _begin_engine_start,
    ),
    "tip-in": SmoothModel(
        ("motor", "wheel", "twist"), _rate_tip_in, _read_speeds("motor", "wheel"), _begin_tip_in
    ),
}
"""Smooth models by problem."""

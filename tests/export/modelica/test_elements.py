# SPDX-License-Identifier: MIT
"""Each type of element as components of the Standard Library."""

from __future__ import annotations

from typing import Any

import pytest

from drivetwin.errors import InputError
from drivetwin.export.modelica.model import format_package
from drivetwin.simulation.network import Element

_TABLE = {"speed_ratio": [0.0, 1.0], "capacity": [0.03, 0.0], "torque_ratio": [1.9, 1.0]}
_MAP = {"throttle": [0.0, 1.0], "speed": [50.0, 200.0], "torque": [[0.0, -9.0], [5.0, 6.0]]}
_CLUTCH = {"friction": {"slip": [0.0], "mu": [0.12]}, "gain": 0.02, "p0": 5e4, "peak": 1.1}


def _text(kind: str, **fields: Any) -> str:
    element: Element = {"type": kind, "name": "x", **fields}
    return format_package("one", [element])


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            _text("gear", a="a", b="b", ratio=2.0, loss={"law": "dissipative", "eta": 0.9}),
            "LossyGear x(ratio=2.0, lossTable=[0.0, 0.9, 0.9, 0.0, 0.0]);",
        ),
        (
            _text(
                "gear",
                a="a",
                b="b",
                ratio=2.0,
                loss={"law": "dissipative", "eta": 0.9, "eta_backward": 0.8, "drag": 3.0},
            ),
            "lossTable=[0.0, 0.9, 0.8, 3.0, 3.0]);",
        ),
        (
            _text("backlash", a="a", b="b", stiffness=2e5, damping=50.0, gap=0.02),
            "ElastoBacklash x(c=200000.0, d=50.0, b=0.02);",
        ),
        (
            _text("bearing", a="a", b="ground", speed=[0.0, 9.0], torque=[2.0, 3.0], peak=1.2),
            "BearingFriction x(tau_pos=[0.0, 2.0;\n      9.0, 3.0], peak=1.2);",
        ),
        (
            _text("bearing", a="a", b="b", speed=[0.0], torque=[2.0], peak=1.0),
            "peak=1.0, useSupport=true);",
        ),
        (
            _text("road_load", node="a", constant=5.0, rolling=7.0, aero=0.9),
            "QuadraticSpeedDependentTorque x_aero(tau_nominal=-0.9, TorqueDirection=false, "
            "w_nominal=1.0);",
        ),
        (_text("one_way_clutch", a="a", b="b"), "x.f_normalized = 0;"),
        (
            _text("one_way_clutch", a="a", b="b", clutch={**_CLUTCH, "pressure": "P"}),
            "x.f_normalized = max(0, u_P - P0_x)/x.fn_max;",
        ),
        (
            _text("clutch", a="a", b="ground", pressure="P", drum_inertia=0.1, **_CLUTCH),
            "connect(ground_.flange, x_drum.flange_b);",
        ),
        (
            _text("torque_converter", pump="a", turbine="b", map=_TABLE),
            "TorqueConverter x(map=[0.0, 0.03, 1.9;\n      1.0, 0.0, 1.0]);",
        ),
        (
            _text("engine_map", node="a", throttle="pedal", map=_MAP, lag=0.2),
            "CombiTable2Ds x_map(table=[0.0, 50.0, 200.0;\n      0.0, 0.0, -9.0;\n"
            "      1.0, 5.0, 6.0], extrapolation=",
        ),
        (_text("engine_map", node="a", throttle="pedal", map=_MAP), "x.tau = x_map.y;"),
        (_text("prescribed_speed", node="a", input="n"), "x.w_ref = u_n;"),
    ],
)
def test_the_element_becomes(text: str, line: str) -> None:
    assert line in text


def test_another_type_is_refused_with_the_known_ones() -> None:
    with pytest.raises(InputError, match="no Modelica translation"):
        _text("magnet", node="a")

# SPDX-License-Identifier: MIT
"""A twin with its covariance, made from the stated truck without an identification."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from drivetwin.actuator.model import ActuatorModel, IdentifiedActuator
from drivetwin.estimation.result.estimate import Estimate, FrictionCurve, Verdict
from drivetwin.estimation.result.method import Method
from drivetwin.simulation.added_elements import NO_ADDED_ELEMENTS, RIM_SHARE
from drivetwin.simulation.dual_clutch import DualClutch, Stribeck
from drivetwin.simulation.network import Element, build_element
from drivetwin.twin.twin import Twin, TwinElement, TwinGear, build_nominal_shift
from tests.support.upshift.statement import BAR, make_problem

ACTUATOR = IdentifiedActuator.from_design(ActuatorModel(0.02, 0.0265, 0.0265, 0.9))
FILLING = IdentifiedActuator.from_design(
    ActuatorModel(0.03, 0.02, 0.03, 0.9, 0.9 * BAR, 0.08, 0.05 * BAR)
)
"""Actuators without and with a fill time and hysteresis."""

STD = 0.01
"""Relative standard deviation of every identified parameter."""


def make_twin(verdict: Verdict = Verdict.IDENTIFIED) -> Twin:
    """Gears 2 and 3 by clutches B2 and B3."""
    of = make_problem()
    ratios = [of.i_in * c * o for c, o in zip(of.i_c, of.i_out, strict=True)]
    values = {
        "eta": of.eta,
        "J_out": of.J_out,
        "J_vehicle": of.J_v,
        "Tv_over_if": of.T_v / of.i_f,
        "k_o": of.k,
        "c_o": of.c,
        **{f"J_prime_{gear}": of.J_e + of.J_out / ratio**2
           for gear, ratio in zip("23", ratios, strict=True)},
    }  # fmt: skip
    slip = np.linspace(0.0, 120.0, 25)
    law = Stribeck(of.mu_c, of.mu_s, of.v_s, of.mu_v)
    mu = law.evaluate(slip)
    curve = FrictionCurve(slip, mu, 0.98 * mu, 1.02 * mu, slip, mu, law, "likelihood")
    return Twin(
        name="truck",
        method=Method.LIKELIHOOD,
        loss_law="paper",
        i_in=of.i_in,
        final_drive=of.i_f,
        gears={gear: TwinGear(r, f"B{gear}") for gear, r in zip("23", ratios, strict=True)},
        elements={
            f"B{gear}": TwinElement(
                "clutch", of.i_c[n], of.i_out[n], of.gain[n], of.P0[n], 1.0, 0.0
            )
            for n, gear in enumerate("23")
        },
        J_prime_range=(1.0, 100.0),
        J_vehicle_range=(1e3, 1e5),
        parameters={
            name: Estimate(name, value, STD * value, verdict, "likelihood")
            for name, value in values.items()
        },
        friction={"B2": curve, "B3": curve},
        validity={
            "pressure": (0.0, 10e5),
            "torque": (900.0, 1500.0),
            "speed": (110.0, 200.0),
            "slip": (0.0, 110.0),
        },
        inputs={},
        settings={},
        assumptions=(),
        version="0",
        covariance_ids=tuple(values),
        covariance=np.diag([(STD * value) ** 2 for value in values.values()]),
    )


def make_hydraulic_twin() -> Twin:
    """Return the same twin with actuators."""
    return replace(make_twin(), actuators={"B2": ACTUATOR, "B3": FILLING})


def make_exact_twin() -> Twin:
    """Return the twin with actuators without a fill time, and with exact values."""
    twin = make_twin()
    friction = {k: replace(v, mu_lo=v.mu, mu_hi=v.mu) for k, v in twin.friction.items()}
    actuators = {"B2": ACTUATOR, "B3": ACTUATOR}
    return replace(twin, covariance_ids=(), covariance=None, friction=friction, actuators=actuators)


def build_model(twin: Twin) -> DualClutch:
    """Return the driveline of the upshift."""
    return twin.build_dual_clutch(build_nominal_shift(twin, ("2", "3")))


ADDED_ELEMENTS = {
    "input shaft": {"mode_frequency": 12.0, "mode_share": 0.5, "mode_damping": 0.05},
    "backlash": {"backlash": 0.02},
    "tyre": {"tyre_slip": 0.03, "shaft_reference": 8000.0},
    "progressive shaft": {"shaft_progression": 0.2, "shaft_reference": 8000.0},
}
"""Parameters of each added element by id."""


def extend_twin(twin: Twin, values: Mapping[str, float]) -> Twin:
    """Return the twin with parameters of an added element by id, known as well as the others."""
    assert twin.covariance is not None
    stds = [STD * value for value in values.values()]
    own = {
        name: Estimate(name, value, std, Verdict.IDENTIFIED, "likelihood")
        for (name, value), std in zip(values.items(), stds, strict=True)
    }
    return replace(
        twin,
        parameters={**twin.parameters, **own},
        covariance_ids=(*twin.covariance_ids, *values),
        covariance=block_diag(twin.covariance, np.diag(np.square(stds))),
    )


def assemble(shift: Any, values: Mapping[str, float]) -> list[Element]:
    """Put an added element by hand into the elements of the dual clutch."""
    model = shift.model
    elements = {
        str(one["name"]): dict(one) for one in replace(shift, added=NO_ADDED_ELEMENTS).elements
    }
    shaft, more = elements["output shaft"], []
    if "mode_frequency" in values:
        front, omega = values["mode_share"] * model.J1, 2.0 * np.pi * values["mode_frequency"]
        damping = 2.0 * values["mode_damping"] * omega * front
        fields = {"stiffness": front * omega**2, "damping": damping}
        elements["J1"]["inertia"] -= front
        elements["engine"]["node"] = "crankshaft"
        more = [
            build_element("inertia", "front", node="crankshaft", inertia=front),
            build_element("spring_damper", "input shaft", a="crankshaft", b="engine", **fields),
        ]
    elif "tyre_slip" in values:
        rim, torque = RIM_SHARE * model.J_v, values["shaft_reference"] * model.i_f
        fields = {"slip_stiffness": torque / values["tyre_slip"], "least_speed": 0.5}
        elements["J_v"]["inertia"] = rim
        elements["load"]["node"] = "vehicle"
        more = [
            build_element("tyre", "tyre", a="wheel", b="vehicle", **fields),
            build_element("inertia", "vehicle", node="vehicle", inertia=model.J_v - rim),
        ]
    elif "backlash" in values:
        shaft |= {"type": "backlash", "gap": values["backlash"]}
    else:
        assert shift.added.shaft_table is not None
        linear = shaft.pop("stiffness") * np.array(shift.added.shaft_table.twist)
        share = linear / values["shaft_reference"]
        torque = linear * (1.0 + values["shaft_progression"] * (share**2 - 0.5))
        twist = list(shift.added.shaft_table.twist)
        shaft |= {"type": "spring_table", "twist": twist, "torque": torque.tolist()}
    return [*elements.values(), *more]

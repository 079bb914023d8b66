# SPDX-License-Identifier: MIT
"""A twin with its covariance, made from the stated truck without an identification."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.estimation.result.estimate import Estimate, FrictionCurve, Verdict
from drivetwin.estimation.result.method import Method
from drivetwin.simulation.dual_clutch import Stribeck
from drivetwin.twin.twin import Twin, TwinElement, TwinGear
from tests.calibration.cases import ACTUATOR, FILLING
from tests.support.upshift.statement import make_problem

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

# SPDX-License-Identifier: MIT
"""The Cramér-Rao bound of a recorded vehicle, for the unknowns and priors that its fit had."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from benchmarks.estimation.bench import Bench
from benchmarks.estimation.bound import compute_bound
from benchmarks.estimation.study import build_guess, build_point, propagate
from drivetwin.driveline import DualClutch
from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.identify.likelihood.kinds import SPEEDS
from drivetwin.identify.likelihood.priors import spans
from drivetwin.identify.likelihood.problem import Part
from drivetwin.identify.likelihood.record import TORQUE, record_of
from drivetwin.identify.likelihood.unknowns import AERO, LAW, TE_OFFSET, Point
from drivetwin.identify.profile import likelihood_of
from drivetwin.identify.result import FrictionCurve, Identification
from drivetwin.identify.signals import FloatArray, Sampled, ShiftSignals

SHARED_SCALE = ("J_e", "J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o", AERO)
OF_ELEMENTS = (*LAW[:-1], "drum")
"""Unknowns that are told over η where the log has no output torque; the latter of each element."""
MU_PLACES = (0.1, 0.5, 0.9)
"""Where in the slip range of a curve μ is compared."""


def find_slips(curve: FrictionCurve) -> dict[str, float]:
    """Return slips [rad/s] at `MU_PLACES` of a curve, by the name of μ there."""
    slips = np.interp(MU_PLACES, (0.0, 1.0), (curve.slip[0], curve.slip[-1])).tolist()
    names = (f"mu at {100 * place:.0f} % of the slip" for place in MU_PLACES)
    return dict(zip(names, slips, strict=True))


def compute_widths(found: Identification, recorded: DynoRun) -> dict[str, tuple[float, float]]:
    """Return the stated standard deviation from noise and its bound, by parameter; 0 if known."""
    fit, (signals,) = likelihood_of(found)
    (curve,) = found.friction.values()
    slips = find_slips(curve)
    ideal = run(recorded.scenario, recorded.seed, noise=0.0)
    exact = _read_exactly(signals, ideal)
    old = fit.problem.parts[0]
    bench = Bench(exact, old.structure.driveline, dict(recorded.truth.parameters), ideal)
    sensors = {sensor.role: sensor for sensor in recorded.scenario.sensors}
    means = SPEEDS if sensors["input_speed"].window > 0.0 else ()
    curved = {TORQUE} & fit.problem.kinds
    record = record_of(exact, spans([exact])[0]).of_kinds({*means, *curved})
    part = Part.unweighted(old.structure, record)
    start = fit.point.moved(_build_values(fit.point, part, bench))
    truth = build_point(replace(fit.problem, parts=(part,)), start, bench)
    least = compute_bound(bench, part, truth, fit.problem.prior)
    here = propagate(fit.problem, fit.mean, fit.covariance, exact, slips)
    there = propagate(fit.problem, truth, least, exact, slips)
    return {name: (here[name][1], there[name][1]) for name in here}


def _read_exactly(signals: ShiftSignals, ideal: DynoRun) -> ShiftSignals:
    """Return the samples as ideal sensors would have read them."""
    channels = {channel.role: channel for channel in ideal.channels}

    def read(role: str, signal: Sampled) -> Sampled:
        if signal.time.size == 0:
            return signal
        values = np.interp(signal.time, channels[role].time, channels[role].values)
        return replace(signal, values=values)

    assert signals.wheel_speed is not None
    return replace(
        signals,
        engine_torque=read("engine_torque", signals.engine_torque),
        output_torque=read("output_torque", signals.output_torque),
        engine_speed=read("input_speed", signals.engine_speed),
        output_speed=read("output_speed", signals.output_speed),
        wheel_speed=read("wheel_speed", signals.wheel_speed),
        pressures={n: read(f"pressure.{n}", p) for n, p in signals.pressures.items()},
    )


def _build_values(point: Point, part: Part, bench: Bench) -> FloatArray:
    """Return the truth by unknown (p,), torques over η if the fit has them so; starts unchanged."""
    model = bench.run.scenario.model
    truth = {**build_guess(bench), TE_OFFSET: 0.0, AERO: model.load.aero}
    truth["Tv_over_if"] += model.load.aero * part.structure.mean_speed**2 / model.i_f
    if not part.scale_known:
        truth = _scale(truth, model)
    return np.array([truth.get(n, v) for n, v in zip(point.names, point.values, strict=True)])


def _scale(truth: Mapping[str, float], model: DualClutch) -> dict[str, float]:
    scaled = {
        name: value / model.eta
        for name, value in truth.items()
        if name in SHARED_SCALE or name.rpartition(".")[2] in OF_ELEMENTS
    }
    return {**truth, **scaled, "eta": 1.0}

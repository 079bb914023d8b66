# SPDX-License-Identifier: MIT
"""The Cramér-Rao bound of a recorded vehicle, for the unknowns and priors that its fit had."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from benchmarks.estimation.bench import Bench
from benchmarks.estimation.bound import bound
from benchmarks.estimation.study import at_truth, guess_from_truth
from drivetwin.driveline import DualClutch
from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.identify.friction import stribeck
from drivetwin.identify.likelihood.derived import parameters, slopes
from drivetwin.identify.likelihood.fit import LikelihoodFit
from drivetwin.identify.likelihood.kinds import SPEEDS
from drivetwin.identify.likelihood.priors import spans
from drivetwin.identify.likelihood.problem import Part
from drivetwin.identify.likelihood.record import TORQUE, record_of
from drivetwin.identify.likelihood.unknowns import AERO, LAW, TE_OFFSET
from drivetwin.identify.optimize.objective import Point
from drivetwin.identify.profile import likelihood_of
from drivetwin.identify.result import FrictionCurve, Identification
from drivetwin.identify.signals import FloatArray, Sampled, ShiftSignals

SHARED_SCALE = ("J_e", "J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o", AERO)
OF_ELEMENTS = (*LAW[:-1], "drum")
"""Unknowns that are told over η where the log has no output torque; the latter of each element."""
MU_PLACES = (0.1, 0.5, 0.9)
"""Where in the slip range of a curve μ is compared."""


def mu_name(place: int) -> str:
    """What μ at a place of `MU_PLACES` is called."""
    return f"mu at {100 * MU_PLACES[place]:.0f} % of the slip"


def slips_of(curve: FrictionCurve) -> FloatArray:
    """Slips [rad/s] at `MU_PLACES` of a curve."""
    return np.asarray(np.interp(MU_PLACES, (0.0, 1.0), (curve.slip[0], curve.slip[-1])))


def bounds_of(found: Identification, recorded: DynoRun) -> dict[str, tuple[float, float]]:
    """Stated standard deviation from noise and its bound, by parameter; 0 where it is known."""
    fit, (signals,) = likelihood_of(found)
    (curve,) = found.friction.values()
    slips = slips_of(curve)
    ideal = run(recorded.scenario, recorded.seed, noise=0.0)
    exact = _exact(signals, ideal)
    old = fit.problem.parts[0]
    bench = Bench(exact, old.structure.driveline, dict(recorded.truth.parameters), ideal)
    sensors = {sensor.role: sensor for sensor in recorded.scenario.sensors}
    means = SPEEDS if sensors["input_speed"].window > 0.0 else ()
    curved = {TORQUE} & fit.problem.kinds
    record = record_of(exact, spans([exact])[0]).of_kinds({*means, *curved})
    part = Part.unweighted(old.structure, record)
    start = fit.point.moved(_values(fit.point, part, bench))
    truth = at_truth(replace(fit.problem, parts=(part,)), start, bench)
    least = bound(bench, part, truth, fit.problem.prior)
    here = _stds(fit, fit.mean, fit.covariance, (exact, slips))
    there = _stds(fit, truth, least, (exact, slips))
    return {name: (here[name], there[name]) for name in here}


def _exact(signals: ShiftSignals, ideal: DynoRun) -> ShiftSignals:
    """The same samples as ideal sensors would have read them."""
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


def _values(point: Point, part: Part, bench: Bench) -> FloatArray:
    """The truth by unknown (p,), torques over η where the fit has them so; starts as they are."""
    model = bench.run.scenario.model
    truth = {**guess_from_truth(bench), TE_OFFSET: 0.0, AERO: model.load.aero}
    truth["Tv_over_if"] += model.load.aero * part.structure.mean_speed**2 / model.i_f
    if not part.scale_known:
        truth = _over_eta(truth, model)
    return np.array([truth.get(n, v) for n, v in zip(point.names, point.values, strict=True)])


def _over_eta(truth: Mapping[str, float], model: DualClutch) -> dict[str, float]:
    scaled = {
        name: value / model.eta
        for name, value in truth.items()
        if name in SHARED_SCALE or name.rpartition(".")[2] in OF_ELEMENTS
    }
    return {**truth, **scaled, "eta": 1.0}


def _stds(
    fit: LikelihoodFit, point: Point, covariance: FloatArray, seen: tuple[ShiftSignals, FloatArray]
) -> dict[str, float]:
    """Standard deviation of every parameter at `point`, and of μ at the slips of `seen`."""
    signals, slips = seen
    matrix = slopes(fit.problem, point, np.sqrt(np.diag(covariance)), [signals])
    names = list(parameters(fit.problem, point, [signals]))
    variance = np.einsum("qp,pr,qr->q", matrix, covariance, matrix)
    found = dict(zip(names, np.sqrt(variance).tolist(), strict=True))
    element = fit.problem.parts[0].structure.driveline.oncoming.name
    index = [point.names.index(f"{element}.{key}") for key in LAW]
    _, by_law = stribeck(point.values[index], slips)
    std = np.sqrt(np.einsum("pn,pq,qn->n", by_law, covariance[np.ix_(index, index)], by_law))
    return found | {mu_name(k): float(s) for k, s in enumerate(std)}

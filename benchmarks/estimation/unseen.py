# SPDX-License-Identifier: MIT
"""Unseen vehicles from log file to result, against their truth."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.estimation.bound import compute_bound
from benchmarks.estimation.study import build_guess, build_point, propagate
from benchmarks.estimation.vehicles import add_tolerances, draw_vehicle, misread
from drivetwin._util.arrays import FloatArray
from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.analysis.profile_likelihood import get_likelihood_fit
from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.estimation.direct.load_balance import AERO
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.parametrization import LAW, TE_OFFSET, DualClutchTerm
from drivetwin.estimation.likelihood.priors import split_spans
from drivetwin.estimation.likelihood.selection.sampling_mode import SPEEDS, get_modes
from drivetwin.estimation.likelihood.torque_record import OUTPUT_TORQUE, TORQUE, build_record
from drivetwin.estimation.result.estimate import FrictionCurve
from drivetwin.estimation.result.method import DEFAULT_METHOD
from drivetwin.estimation.result.verdict import VERDICT
from drivetwin.likelihood.measured_signal import MeasuredSignal
from drivetwin.likelihood.point import ParameterVector
from drivetwin.likelihood.term import RecordedTerm
from drivetwin.logs.read import read_log
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.simulation.dual_clutch import DualClutch, Stribeck
from drivetwin.vehicle.card import load_card
from tests.support.bench import Bench

HALF = 1.96
"""Half width of a 95 % interval in standard deviations."""
OVER_ETA = "_over_eta"
LIMIT = 4.0 * VERDICT.delay_identified
"""Half width of the interval of a delay [s] from which it is refused; others at their value."""
CLEAR = 0.5
"""Share of that limit below which a half width by the bound counts as clear of it."""


@dataclass(frozen=True)
class Log:
    """Result of one log, by parameter: errors over stated standard deviations, the same with sensor
    errors within the card's tolerances (`misread`), and stated standard deviations from noise over
    their bound (`widths`); ids that were refused, those of them that the bound would allow, and the
    message of a fit that failed.
    """

    deviates: Mapping[str, float]
    misread: Mapping[str, float]
    widths: Mapping[str, float]
    refused: tuple[str, ...]
    needlessly: tuple[str, ...]
    failure: str = ""


def identify_unseen(seeds: Sequence[int]) -> list[Log]:
    """Identify the logs of the vehicles of `seeds`."""
    with ProcessPoolExecutor() as pool:
        return list(pool.map(identify_vehicle, seeds))


def identify_vehicle(seed: int) -> Log:
    """Record, write, read and identify one vehicle by the default method."""
    made = draw_vehicle(seed)
    recorded = run(made.scenario, seed)
    try:
        found = _identify(recorded, made.card)
        card = add_tolerances(made.card, made.scenario)
        wrong = _identify(misread(recorded, seed), card)
    except DrivetwinError as fault:
        return Log({}, {}, {}, (), (), fault.what)
    for one in (found, wrong):
        if one.method is not DEFAULT_METHOD:
            return Log({}, {}, {}, (), (), one.findings[0].text)
    least = compute_widths(found, recorded)
    refused = [one.id for one in found.estimates.values() if one.value is None]
    return Log(
        _compute_deviates(found, recorded),
        _compute_deviates(wrong, recorded),
        {
            _strip_eta(name): stated / bound
            for name, (stated, bound) in least.items()
            if bound > 0.0
        },
        tuple(refused),
        tuple(name for name in refused if _is_needless(name, found, recorded, least)),
    )


def _identify(recorded: DynoRun, card_text: str) -> Identification:
    with tempfile.TemporaryDirectory() as folder:
        file, card_file, _ = write_run(Path(folder) / "log.csv", recorded)
        card_file.write_text(card_text, encoding="utf-8")
        card = load_card(card_file)
        log = read_log(file, card)
        return identify(log, card, detect_shifts(log, card))


def _is_needless(
    name: str,
    found: Identification,
    recorded: DynoRun,
    least: Mapping[str, tuple[float, float]],
) -> bool:
    """Return whether the bound of a refused parameter is well below the width of a refusal."""
    if name not in least:
        return False
    value = LIMIT if name == "te_delay" else abs(_find_truth(name, found, recorded))
    return 0.0 < HALF * least[name][1] < CLEAR * value


def _compute_deviates(found: Identification, recorded: DynoRun) -> dict[str, float]:
    scale = 1.0 if found.estimates["eta"].value is not None else recorded.scenario.model.eta
    deviates = {}
    for name, one in found.estimates.items():
        if one.value is not None and one.std_total:
            error = one.value - _find_truth(name, found, recorded)
            deviates[_strip_eta(name)] = error / one.std_total
    for name, curve in found.friction.items():
        law = recorded.truth.friction[name]
        assert isinstance(law, Stribeck)
        names, slips = zip(*find_slips(curve).items(), strict=True)
        mu, low, high = (
            np.interp(slips, curve.slip, one) for one in (curve.mu, curve.mu_lo, curve.mu_hi)
        )
        far = (mu - law.evaluate(np.array(slips)) / scale) / ((high - low) / (2.0 * HALF))
        deviates |= dict(zip(names, far.tolist(), strict=True))
    return deviates


def _find_truth(name: str, found: Identification, recorded: DynoRun) -> float:
    """Return the truth of a parameter by its id, the load at the speed of its estimate."""
    model = recorded.scenario.model
    drums = {f"drum.{one.name}": one.drum_inertia for one in model.elements}
    truth = {**recorded.truth.parameters, **drums}
    if found.load is not None:
        truth["Tv_over_if"] += model.load.aero * found.load.mean_speed**2 / model.i_f
    true = truth[_strip_eta(name)]
    return true / model.eta if name.endswith(OVER_ETA) else true


def _strip_eta(name: str) -> str:
    """Return the id without the suffix of values over η."""
    return name.removesuffix(OVER_ETA)


def collect(logs: Sequence[Mapping[str, float]]) -> dict[str, FloatArray]:
    """Return the values of all logs (n,), by parameter."""
    names = dict.fromkeys(name for log in logs for name in log)
    return {name: np.array([log[name] for log in logs if name in log]) for name in names}


SHARED_SCALE = ("J_e", "J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o", AERO)
OF_ELEMENTS = (*LAW[:-1], "drum")
"""Unknowns that are estimated over η where a log has no output torque; the latter by element."""
MU_PLACES = (0.1, 0.5, 0.9)
"""Where in the slip range of a curve μ is compared."""


def find_slips(curve: FrictionCurve) -> dict[str, float]:
    """Return slips [rad/s] at `MU_PLACES` of a curve, by the name of μ there."""
    slips = np.interp(MU_PLACES, (0.0, 1.0), (curve.slip[0], curve.slip[-1])).tolist()
    names = (f"mu at {100 * place:.0f} % of the slip" for place in MU_PLACES)
    return dict(zip(names, slips, strict=True))


def compute_widths(found: Identification, recorded: DynoRun) -> dict[str, tuple[float, float]]:
    """Return the stated standard deviation from noise and its bound, by parameter; 0 if known."""
    fit, (signals,) = get_likelihood_fit(found)
    (curve,) = found.friction.values()
    slips = find_slips(curve)
    ideal = run(recorded.scenario, recorded.seed, noise=0.0)
    exact = _read_exactly(signals, ideal)
    old = fit.problem.terms[0]
    bench = Bench(exact, old.plant.driveline, dict(recorded.truth.parameters), ideal)
    sensors = {sensor.role: sensor for sensor in recorded.scenario.sensors}
    means = SPEEDS if sensors["input_speed"].window > 0.0 else ()
    curved = {TORQUE} & get_modes(fit.problem)
    record = build_record(exact, split_spans([exact])[0]).select_modes({*means, *curved})
    term = RecordedTerm.from_sensor_noise(old.plant, record)
    start = fit.point.replace_values(_build_values(fit.point, term, bench))
    truth = build_point(replace(fit.problem, terms=(term,)), start, bench)
    least = compute_bound(bench, term, truth, fit.problem.prior)
    here = propagate(fit.problem, fit.mean, fit.covariance, exact, slips)
    there = propagate(fit.problem, truth, least, exact, slips)
    return {name: (here[name][1], there[name][1]) for name in here}


def _read_exactly(signals: ShiftSignals, ideal: DynoRun) -> ShiftSignals:
    """Return the samples as ideal sensors would have read them."""
    channels = {channel.role: channel for channel in ideal.channels}

    def read(role: str, signal: MeasuredSignal) -> MeasuredSignal:
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


def _build_values(point: ParameterVector, term: DualClutchTerm, bench: Bench) -> FloatArray:
    """Return the truth by unknown (p,), torques over η if the fit has them so; starts unchanged."""
    model = bench.run.scenario.model
    truth = {**build_guess(bench), TE_OFFSET: 0.0, AERO: model.load.aero}
    truth["Tv_over_if"] += model.load.aero * term.plant.mean_speed**2 / model.i_f
    if not term.compares(OUTPUT_TORQUE):
        truth = _scale(truth, model)
    return np.array([truth.get(n, v) for n, v in zip(point.names, point.values, strict=True)])


def _scale(truth: Mapping[str, float], model: DualClutch) -> dict[str, float]:
    scaled = {
        name: value / model.eta
        for name, value in truth.items()
        if name in SHARED_SCALE or name.rpartition(".")[2] in OF_ELEMENTS
    }
    return {**truth, **scaled, "eta": 1.0}

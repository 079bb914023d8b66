# SPDX-License-Identifier: MIT
"""Effect of unstated faults on the fit: shift of the mean against the same seeds without a fault.

The card does not state the fault, and chi2 hardly changes; that is the point of the table.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from benchmarks.estimation.study import fit_likelihood, read_fit
from drivetwin.channels.roles import get_pressure_element
from drivetwin.dyno.scenario import Scenario
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.likelihood.measured_signal import MeasuredSignal
from drivetwin.vehicle.spec import PriorValue, SensorTolerance
from tests.support.bench import Bench, Knowledge, record_bench

SHOWN = ("eta", "J_prime_2", "J_out", "Tv_over_if", "J_vehicle", "k_o", "c_o", "mu at 30 rad/s")
KNOW = Knowledge(J_out=0.1)


UNDISTURBED = ("", SensorTolerance())
"""No sensor reads wrongly."""


@dataclass(frozen=True)
class Fault:
    """`faulty` and `sound` are scenarios; `disturb` is a sensor role and its error."""

    text: str
    sound: Callable[[], Scenario]
    faulty: Callable[[], Scenario]
    disturb: tuple[str, SensorTolerance] = UNDISTURBED


@dataclass(frozen=True)
class Shift:
    """Mean shift by parameter [%], of the delay [ms], and chi2 without and with the fault."""

    fault: Fault
    percent: dict[str, float]
    delay: float
    chi2: tuple[float, float]


def delay_torque() -> Scenario:
    """Return `throttle_steps` with an engine torque that is 15 ms old."""
    base = load_scenario("throttle_steps")
    sensors = [replace(s, delay=0.015) if s.role == "engine_torque" else s for s in base.sensors]
    return replace(base, sensors=tuple(sensors))


PRESSURE = ("pressure.B3", SensorTolerance(offset=2e4))
ENGINE_TORQUE = ("engine_torque", SensorTolerance(gain=0.03))
OUTPUT_TORQUE = ("output_torque", SensorTolerance(gain=0.01))
DRUMLESS = partial(load_scenario, "gearbox", 0.0)
THROTTLE_STEPS = partial(load_scenario, "throttle_steps")
FAULTS = (
    Fault("drums of 0.05 kg m²", DRUMLESS, partial(load_scenario, "gearbox", 0.05)),
    Fault("drums of 0.2 kg m²", DRUMLESS, partial(load_scenario, "gearbox", 0.2)),
    Fault("pressure of B3 +20 kPa", THROTTLE_STEPS, THROTTLE_STEPS, PRESSURE),
    Fault("engine torque 15 ms late", THROTTLE_STEPS, delay_torque),
    Fault("engine torque +3 %", THROTTLE_STEPS, THROTTLE_STEPS, ENGINE_TORQUE),
    Fault("output torque +1 %", THROTTLE_STEPS, THROTTLE_STEPS, OUTPUT_TORQUE),
)


def measure_shift(fault: Fault, count: int) -> Shift:
    """Compute the shift over `count` noise realisations."""
    sound, faulty = _fit_all(fault.sound, count), _fit_all(fault.faulty, count, fault.disturb)
    means = [
        {n: float(np.mean([one[n] for one in runs])) for n in runs[0]} for runs in (sound, faulty)
    ]
    percent = {n: 100.0 * (means[1][n] / means[0][n] - 1.0) for n in SHOWN}
    delay = 1e3 * (means[1]["te_delay"] - means[0]["te_delay"])
    return Shift(fault, percent, delay, (means[0]["chi2"], means[1]["chi2"]))


@cache
def _fit_all(
    made: Callable[[], Scenario], count: int, disturb: tuple[str, SensorTolerance] = UNDISTURBED
) -> list[dict[str, float]]:
    """Fit `count` realisations; several faults are compared with the same ones."""
    with ProcessPoolExecutor() as pool:
        return list(pool.map(partial(_fit_one, made, disturb), range(count)))


def _fit_one(
    made: Callable[[], Scenario], disturb: tuple[str, SensorTolerance], seed: int
) -> dict[str, float]:
    bench = _remove_drums(record_bench(made(), seed, KNOW))
    return _fit(replace(bench, signals=_apply_sensor_error(bench.signals, *disturb)))


def _apply_sensor_error(signals: ShiftSignals, role: str, error: SensorTolerance) -> ShiftSignals:
    """Copy the signals with the gain and offset of `error` applied to one sensor."""

    def change(one: MeasuredSignal) -> MeasuredSignal:
        return replace(one, values=one.values * (1.0 + error.gain) + error.offset)

    name = get_pressure_element(role)
    if name is not None:
        pressures = {**signals.pressures, name: change(signals.pressures[name])}
        return replace(signals, pressures=pressures)
    match role:
        case "engine_torque":
            return replace(signals, engine_torque=change(signals.engine_torque))
        case "output_torque":
            return replace(signals, output_torque=change(signals.output_torque))
        case _:
            return signals


def _remove_drums(bench: Bench) -> Bench:
    """Return the bench with a card without drums."""
    driveline = bench.driveline
    bare = {n: replace(c, drum=PriorValue(0.0)) for n, c in driveline.couplings.items()}
    changed = replace(
        driveline,
        offgoing=bare[driveline.offgoing.name],
        oncoming=bare[driveline.oncoming.name],
        couplings=bare,
    )
    return replace(bench, driveline=changed)


def _fit(bench: Bench) -> dict[str, float]:
    fit = fit_likelihood(bench)
    return {**{n: value for n, (value, _) in read_fit(fit, bench).items()}, "chi2": fit.chi2}

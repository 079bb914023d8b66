# SPDX-License-Identifier: MIT
"""Both observers: the smoother, and the simulation of the twin by engine torque and pressures.

The band of the simulation comes from runs whose parameters, friction, inputs and start are drawn
from what is known of them; each run goes through its own lock and break-away, so nothing is
linearised.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from drivetwin._util.check_arguments import check_arguments
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import InputError, SimulationError
from drivetwin.estimation.data.noise import prepare_signal
from drivetwin.estimation.data.prepare import collect_pressures
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.findings import render
from drivetwin.observer.inputs import select_uncertain
from drivetwin.observer.kind import Observer
from drivetwin.observer.result import Band, FloatArray, Observation
from drivetwin.observer.smooth import smooth
from drivetwin.shifts.coverage import trim_to_recorded, trim_to_window
from drivetwin.shifts.lockup_clutch import refer_to_turbine
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.added_elements import AddedElements, describe_added_elements
from drivetwin.simulation.driveline_run import DrivelineTask
from drivetwin.simulation.dual_clutch import DualClutch, Signal, State, Trajectory
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import simulate_shift
from drivetwin.vehicle.spec import PriorValue

STEMS = ("eta", "J_prime", "J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o", "te_delay")
RUNS = 100
"""Runs of the ensemble; the width of a band is then accurate to 7 %."""
SPEED = 0.1
"""Spread of the output speed at the start [rad/s]."""
TWIST = 0.05
"""Relative spread of the shaft's torque at the start, besides the unrest of the drive torque."""
UNREST = 0.4
"""Time about the start over which the engine torque is looked at: a shaft that was moved swings."""


def simulate_observed(
    twin: Twin, log: ShiftLog, shift: Shift, *, runs: int = RUNS, seed: int = 0
) -> Observation:
    """Estimate the torques of one shift by simulation from engine torque and pressures.

    The measured speeds give the initial state only.

    Raises MissingParameterError, MissingChannelError, and SimulationError where the twin's own run
    does not complete.
    """
    quiet = ShiftLog(
        {role: c for role, c in log.channels.items() if role != "output_torque"},
        log.source,
        log.sha256,
        log.findings,
    )
    base = simulate_shift(twin, quiet, shift)
    if base.status != "completed":
        raise SimulationError(
            f"the simulation of shift {shift.start_gear}-{shift.end_gear} ended with {base.status}",
            "use the smoother, which needs no friction law",
        )
    run = base.trajectory
    ids = (*STEMS, *(f"P0.{one.name}" for one in base.model.elements))
    known = select_uncertain(twin, shift, ids, laws=True)
    directions = known.directions
    generators = np.random.SeedSequence(seed).spawn(runs)
    noise = collect_pressures(quiet, shift)
    torque = prepare_signal(quiet["engine_torque"])
    near = torque.select_span((float(run.time[0]) - UNREST, float(run.time[0]) + UNREST)).values
    unrest = float(np.std(near)) if near.size else 0.0
    found: list[Trajectory] = []
    for generator in generators:
        rng = np.random.default_rng(generator)
        values = known.draw(rng, directions)
        model = known.draw_model(values, rng)
        if model is None:
            continue
        one = _simulate_member(
            model,
            twin.build_added_elements(model),
            _sample_signal(torque, known.to_named(values)["te_delay"], rng),
            {name: _sample_signal(signal, 0.0, rng) for name, signal in noise.items()},
            _sample_start(model, run, (shift, unrest), rng),
            run.time,
        )
        if one is not None:
            found.append(one)
    notes = () if len(found) == runs else (f"{runs - len(found)} of {runs} runs did not complete",)
    bands = {
        name: _compute_band(column, [collect_torques(one)[name] for one in found])
        for name, column in collect_torques(run).items()
    }
    return Observation(
        shift, Observer.SIMULATION, run.time, bands.pop("output_torque"), bands, notes
    )


def collect_torques(run: Trajectory) -> dict[str, FloatArray]:
    """Collect the torques (n,) of a run [N m]: `output_torque`, and those of the elements."""
    return {"output_torque": run.shaft_torque, **run.clutch_torque}


def _compute_band(column: FloatArray, others: list[FloatArray]) -> Band:
    spread = np.sqrt(np.mean((np.array(others) - column) ** 2, axis=0))
    return Band(column, np.asarray(spread))


def _sample_signal(signal: MeasuredSignal, delay: float, rng: np.random.Generator) -> Signal:
    """The signal with other noise of its level, moved back by its delay [s]; ends are held."""
    values = signal.values + signal.sigma * rng.standard_normal(signal.values.size)
    time = np.concatenate([[signal.time[0] - 1.0], signal.time, [signal.time[-1] + 1.0]])
    return Signal(time, np.concatenate([values[:1], values, values[-1:]]), -delay)


def _sample_start(
    model: DualClutch, run: Trajectory, about: tuple[Shift, float], rng: np.random.Generator
) -> State:
    """A start about that of `run`: the off-going element of the shift stays locked.

    `about` holds the shift and the unrest of the engine torque [N m].
    """
    shift, unrest = about
    held = next(one for one in model.elements if one.name == shift.offgoing)
    ratio = model.i_in * held.i_c * held.i_out
    speed = float(run.output_speed[0]) + SPEED * rng.standard_normal()
    rate = float(run.output_speed[0]) - model.i_f * float(run.wheel_speed[0])
    swing = np.hypot(unrest * model.eta * ratio / model.k_o, TWIST * float(run.twist[0]))
    twist = float(run.twist[0]) + float(swing) * rng.standard_normal()
    return State(ratio * speed, speed, (speed - rate) / model.i_f, twist, (shift.offgoing,))


def _simulate_member(
    model: DualClutch,
    added: AddedElements,
    torque: Signal,
    pressures: Mapping[str, Signal],
    start: State,
    time: FloatArray,
) -> Trajectory | None:
    """A run of the ensemble; None where drawn values make none."""
    try:
        found = DrivelineTask(model, added, torque, pressures, start, time).simulate()
    except InputError:
        return None
    return found if found.status == "completed" else None


FAR = 15.0
"""Longest time [s] of the gears held before and after a shift. One second of the smoother takes
about 25 MB, and more distant samples contain no information on the shift."""


@check_arguments
def estimate_torques(
    twin: Twin, log: ShiftLog, shift: Shift, by: Observer = Observer.SMOOTHER
) -> Observation:
    """Estimate the torques of one shift with 95 % bands, without any output torque in the log.

    If the converter is open and the twin has its map, the turbine torque replaces the engine
    torque. The gears before and after the shift are used as far as the inputs were recorded, and
    for FAR at most; the notes contain any cut.
    The smoother's model is the dual clutch; where the twin has other elements, their effect on its
    own run widens the bands.
    Raises MissingParameterError where the twin is incomplete, MissingChannelError and InputError
    where the log is incomplete, DamagedChannelError where an input has a gap in the shift,
    SimulationError where the twin's own run fails.
    """
    log = refer_to_turbine(log, twin.build_card(), shift)
    fills = {one.name: PriorValue(one.P0) for one in twin.build_dual_clutch(shift).elements}
    whole = trim_to_window(trim_to_recorded(log, shift, fills, twin.i_in), (FAR, FAR))
    if by is Observer.SIMULATION:
        found = simulate_observed(twin, log, whole)
    elif twin.added_element_values:
        found = _add_element_error(smooth(twin.drop_added_elements(), log, whole), twin, log, whole)
    else:
        found = smooth(twin, log, whole)
    cuts = render(whole.findings[len(shift.findings) :])
    return replace(found, notes=(*cuts, *found.notes))


def _add_element_error(found: Observation, twin: Twin, log: ShiftLog, shift: Shift) -> Observation:
    """Widen the bands by the effect of the added elements on the run of the twin itself."""
    channels = {role: one for role, one in log.channels.items() if role != "output_torque"}
    quiet = replace(log, channels=channels)
    runs = [simulate_shift(one, quiet, shift) for one in (twin, twin.drop_added_elements())]
    for one in runs:
        if one.status != "completed":
            raise SimulationError(
                f"the simulation of shift {shift.start_gear}-{shift.end_gear} ended: {one.status}",
                "identify the log again without the added element",
            )
    whole, reduced = (collect_torques(one.trajectory) for one in runs)

    def widen(name: str, band: Band) -> Band:
        error = np.interp(found.time, runs[0].trajectory.time, whole[name] - reduced[name])
        return Band(band.value, np.hypot(band.std, error))

    clutches = {name: widen(name, band) for name, band in found.clutch_torque.items()}
    note = f"bands contain the error by {describe_added_elements(twin.added_element_values)}"
    return replace(
        found,
        output_torque=widen("output_torque", found.output_torque),
        clutch_torque=clutches,
        notes=(*found.notes, note),
    )

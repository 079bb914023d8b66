# SPDX-License-Identifier: MIT
"""A logged shift as a least-squares problem: simulated by many drivelines, compared in means.

The commanded profile is the better input of a simulation: it has no noise, sampling or delay, and
what lies between it and the clutches is then one path of the inputs. A log has no channel for it;
but its pressures show the instant of the request, and whether they follow the profile at all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.input_path import DIRECT, InputPath
from drivetwin.calibration.maneuver import Maneuver, OperatingPoint, Profiles
from drivetwin.calibration.scenarios import collect_scenarios
from drivetwin.estimation.data.noise import prepare_signal
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.shifts.lockup_clutch import refer_to_turbine
from drivetwin.shifts.shift import get_shift_pressures
from drivetwin.simulation.batch import BatchRequest, Keep
from drivetwin.simulation.driveline import ENGINE, OUTPUT, SHAFT, Driveline
from drivetwin.simulation.dual_clutch import ENGINE_TORQUE, Signal
from drivetwin.simulation.element_schema import as_json
from drivetwin.simulation.network import Output, to_native
from drivetwin.simulation.network_response import NetworkScenario, to_core_scenarios
from drivetwin.twin.twin import Twin
from drivetwin.validation.initial_state import estimate_start_state
from drivetwin.validation.simulate_log import SIGNALS, LoggedShift

_COARSE, _FINE = 5e-3, 1e-4
"""Steps [s] in which the instant of the request is sought: a few samples, then a part of one."""
_RAMPS = 0.02
"""Share of the largest pressure by which a log may depart from its profile (RMS) beside its noise:
delays and lags of the hydraulics on the ramps, and errors of gain. Another calibration departs by
more."""

_STEADY = 0.3
"""Time [s] before the request over which the logged torque shows the driver's demand."""
_SAME_DEMAND = 0.01
"""Share of the torque up to which a difference of the demands is an error of the message."""


@dataclass(frozen=True, eq=False)
class DrivenShift:
    """A logged shift and the profiles that were commanded, on the clock of the log.

    Without `profiles` the shift is simulated from its logged torque and pressures. `request` [s] is
    the instant of the request; `calibration` names the file of the profiles. `misfit` is the RMS
    distance [Pa] of the logged pressures from the nearest profiles, None without any.
    """

    logged: LoggedShift
    profiles: Profiles | None = None
    request: float = 0.0
    calibration: str = ""
    misfit: float | None = None


def match_profiles(
    logged: LoggedShift, candidates: Mapping[str, Profiles], shift: Maneuver
) -> DrivenShift:
    """Find the commanded profiles of a logged shift and the instant of its request.

    Of the `candidates`, profiles by file on the clock of `shift`, those are taken that the logged
    pressures follow best. Where they follow none, the shift has no profiles.
    """
    names = (shift.offgoing.name, shift.oncoming.name)
    channels = {
        name: prepare_signal(one)
        for name, one in get_shift_pressures(logged.log, logged.shift).items()
    }
    pairs = {
        file: [(channels[names[0]], one.offgoing), (channels[names[1]], one.oncoming)]
        for file, one in candidates.items()
    }
    span = (logged.shift.before[0], logged.shift.lockup_time)
    found = {file: _align(pair, span, shift.horizon) for file, pair in pairs.items()}
    if not found:
        return DrivenShift(logged)
    file = min(found, key=lambda one: found[one][1])
    offset, misfit = found[file]
    largest = max(float(np.max(one.values)) for _, one in pairs[file])
    noise = max(one.sigma for one in channels.values())
    if misfit > np.hypot(noise, _RAMPS * largest):
        return DrivenShift(logged, misfit=misfit)
    moved = Profiles(*(_move(one, offset) for one in candidates[file].signals.values()))
    request = offset + shift.request
    return DrivenShift(logged, _follow_demand(moved, logged, request), request, file, misfit)


def _follow_demand(profiles: Profiles, logged: LoggedShift, request: float) -> Profiles:
    """Move the torque to the driver's demand of the log, where it is another one.

    Delay and lag do not act on the steady torque before the request.
    """
    torque, seen = profiles.engine_torque, prepare_signal(logged.log["engine_torque"])
    steady = (seen.time >= request - _STEADY) & (seen.time <= request)
    if not steady.any():
        return profiles
    wanted = np.interp(seen.time[steady], torque.time, torque.values)
    more = float(np.mean(seen.values[steady] - wanted))
    if abs(more) <= _SAME_DEMAND * float(np.max(np.abs(torque.values))):
        return profiles
    return replace(profiles, engine_torque=replace(torque, values=torque.values + more))


def _move(signal: Signal, offset: float) -> Signal:
    return replace(signal, time=np.asarray(signal.time) + offset)


def _align(
    pairs: Sequence[tuple[MeasuredSignal, Signal]], span: tuple[float, float], horizon: float
) -> tuple[float, float]:
    """Return the offset [s] of the log's clock and the RMS distance [Pa] at it."""

    def measure(offset: float) -> float:
        parts = []
        for channel, wanted in pairs:
            inside = (channel.time >= offset) & (channel.time <= offset + horizon)
            time = channel.time[inside]
            parts.append(
                channel.values[inside] - np.interp(time - offset, wanted.time, wanted.values)
            )
        every = np.concatenate(parts)
        return float(np.sqrt(np.mean(every**2))) if every.size else float("inf")

    coarse = np.arange(span[0] - 0.5 * horizon, span[1], _COARSE)
    best = float(coarse[int(np.argmin([measure(one) for one in coarse]))])
    fine = best + np.arange(-_COARSE, _COARSE, _FINE)
    values = [measure(one) for one in fine]
    place = int(np.argmin(values))
    return float(fine[place]), values[place]


_OUTPUTS: tuple[Output, ...] = (("shaft_torque", SHAFT), ("speed", ENGINE), ("speed", OUTPUT))
"""Outputs in the order of `SIGNALS`; the input speed follows from that of the engine."""
_BIN = 0.01
"""Width [s] of the means in which signals are compared: a third of the fastest event that a
driveline of 10 to 15 Hz shows."""
_ALIKE = 2.0
"""Number of successive means in which errors of the model are the same: 20 ms."""
_LEAD, _AFTER = 0.3, 0.8
"""Compared time before the request and after the lock-up [s]: steady acceleration, and the
oscillation of the lock-up until most of it has decayed."""
_TORQUE_ERROR, _SPEED_ERROR = 0.015, 0.006
"""Errors of the model in a mean: output torque over its largest value, speeds over the change of
the engine speed in the shift. Errors of a model stay the same over many samples, so that the noise
alone would make the means far too heavy; engineering estimates."""
_EXPLAINED = 1.0 / 3.0
"""Share of these errors that a twin may leave which explains a log: 0.5 % of the output torque and
0.2 % of the change of speed. Vehicles with a lag, a delay, tyre slip, a progressive shaft or
friction over pressure leave less (`benchmarks.calibrate.from_logs`)."""


@dataclass(frozen=True)
class PhaseDeviation:
    """RMS deviation [SI] of a signal in a phase of a shift, which begins at `time` [s] of a log.

    `expected` is that of the noise and the usual errors of the model.
    """

    file: str
    channel: str
    role: str
    phase: str
    time: float
    rms: float
    expected: float

    @property
    def ratio(self) -> float:
        """RMS deviation over the expected one."""
        return self.rms / self.expected


@dataclass(frozen=True, eq=False)
class ComparedSignal:
    """A measured signal over the window of a shift.

    `mean` (bins, n) takes the means of simulated samples (n,) on the grid of the run, `sample`
    (s, n) its values at the `time` (s,) [s] of the measured `values` (s,). `means` (bins,) are
    those of the measured samples, `scale` (bins,) their standard deviations, `noise` that of a
    sample, `error` that of the model.
    """

    role: str
    channel: str
    time: FloatArray
    values: FloatArray
    means: FloatArray
    scale: FloatArray
    noise: float
    error: float
    mean: csr_array
    sample: csr_array

    @property
    def quiet(self) -> FloatArray:
        """Standard deviations (bins,) of the means by the noise alone."""
        return np.asarray(np.sqrt(np.maximum(self.scale**2 - self.error**2, 0.0)))


@dataclass(frozen=True, eq=False)
class ComparedShift:
    """A logged shift with its inputs [SI] by name, and the phases [s] of its log.

    `shift` is the run of its window, `start` [s] the begin of it on the clock of the log. The speed
    at the begin is measured with noise: `push` are the changes of the signals (n,) by a speed that
    is higher by the noise of a sample, and each run is moved along them as far as the log asks.
    """

    driven: DrivenShift
    shift: Maneuver
    start: float
    inputs: Mapping[str, Signal]
    phases: Mapping[str, tuple[float, float]]
    signals: tuple[ComparedSignal, ...]
    push: tuple[FloatArray, ...] = ()

    @classmethod
    def from_log(cls, driven: DrivenShift, twin: Twin) -> ComparedShift:
        """Prepare a logged shift; `twin` gives the phases and the speed at its begin.

        Raises what `simulate_shift` raises.
        """
        logged = driven.logged
        begun = logged.simulate(twin)
        log = refer_to_turbine(logged.log, twin.build_card(), logged.shift)
        if log is not logged.log:
            driven = DrivenShift(logged)
        commanded = driven.profiles is not None
        begin = driven.request if commanded else begun.phases["torque"][0]
        first = max(begun.phases["before"][0], begin - _LEAD)
        last = min(begun.phases["after"][1], begun.phases["after"][0] + _AFTER)
        inputs = _collect_inputs(driven, begun.engine_torque, begun.pressures, first)
        drive = inputs[ENGINE_TORQUE]
        torque = float(np.interp(0.0, drive.arrival, drive.values))
        speed = estimate_start_state(begun.model, log, logged.shift, first).engine_speed
        shift = Maneuver(
            begun.model,
            OperatingPoint(torque, speed),
            wheel_radius=1.0,
            horizon=last - first,
            added=twin.build_added_elements(begun.model),
        )
        signals = tuple(
            replace(
                _compare(prepare_signal(log[role]), role, shift, first),
                channel=log[role].source_name,
            )
            for role in SIGNALS
            if role in log
        )
        made = cls(driven, shift, first, inputs, begun.phases, signals)
        return replace(made, push=made._compute_push())

    def _compute_push(self) -> tuple[FloatArray, ...]:
        speeds = [one.noise for one in self.signals if one.role != "output_torque"]
        higher = replace(self.shift.point, engine_speed=self.shift.point.engine_speed + max(speeds))
        pair = [
            replace(self, shift=one).simulate([self.shift.driveline], [DIRECT])
            for one in (self.shift, replace(self.shift, point=higher))
        ]
        return tuple(np.nan_to_num(b[0] - a[0]) for a, b in zip(*pair, strict=True))

    def simulate(
        self, drivelines: Sequence[Driveline], paths: Sequence[InputPath]
    ) -> list[FloatArray]:
        """Return the samples (runs, n) of each signal; NaN in a run that fails."""
        shift = replace(self.shift, model=drivelines[0].model, added=drivelines[0].added)
        scenarios = []
        for one, path in zip(drivelines, paths, strict=True):
            pressures = {name: each for name, each in self.inputs.items() if name != ENGINE_TORQUE}
            acting = path.apply(
                self.inputs[ENGINE_TORQUE], pressures, one.model.elements, shift.time
            )
            scenarios.append(NetworkScenario(acting, shift.start))
        sets = collect_scenarios(shift, drivelines).sets
        given, native = to_core_scenarios(scenarios), to_native(shift.elements, _OUTPUTS)
        # Checks of `simulate_network_batch` take half of a run, and these elements are built.
        asked = BatchRequest.build(given, shift.time, sets, native, Keep.COLUMNS)
        batch = asked.simulate(as_json(shift.elements), asked.sets, 0)
        columns = dict(zip(SIGNALS, np.moveaxis(batch.values, 1, 0), strict=True))
        columns["input_speed"] = columns["input_speed"] / shift.model.i_in
        return self._move_starts([columns[one.role] for one in self.signals])

    def _move_starts(self, runs: list[FloatArray]) -> list[FloatArray]:
        """Move runs (runs, n) to the likeliest speed at their begin."""
        cross, power = np.zeros(len(runs[0])), 1.0
        for one, values, push in zip(self.signals, runs, self.push, strict=False):
            slope = (one.mean @ push) / one.scale**2
            cross = cross + (one.means - (one.mean @ values.T).T) @ slope
            power += float(slope @ (one.mean @ push))
        share = (cross / power)[:, None]
        if not self.push:
            return runs
        return [values + share * push for values, push in zip(runs, self.push, strict=True)]

    def compute_residuals(
        self, drivelines: Sequence[Driveline], paths: Sequence[InputPath]
    ) -> FloatArray:
        """Return the deviations of the means (runs, bins) of all signals over their scales."""
        runs = self.simulate(drivelines, paths)
        parts = [
            (one.means - (one.mean @ values.T).T) / one.scale
            for one, values in zip(self.signals, runs, strict=True)
        ]
        return np.concatenate(parts, axis=1)

    def rescale(self, driveline: Driveline, path: InputPath) -> ComparedShift:
        """Return the shift whose scales are the deviations that a driveline leaves.

        They are not below the noise of the means, and not above the usual errors of the model.
        """
        runs, signals = self.simulate([driveline], [path]), []
        for one, values in zip(self.signals, runs, strict=True):
            left = float(np.sqrt(np.mean((one.means - one.mean @ values[0]) ** 2)))
            scale = np.sqrt(_ALIKE) * np.maximum(left, one.quiet)
            signals.append(replace(one, scale=np.minimum(one.scale, scale)))
        return replace(self, signals=tuple(signals))

    def predict(self, driveline: Driveline, path: InputPath) -> dict[str, FloatArray]:
        """Return simulated samples (s,) by signal."""
        runs = self.simulate([driveline], [path])
        return {
            one.role: one.sample @ values[0] for one, values in zip(self.signals, runs, strict=True)
        }

    def list_phases(self, driveline: Driveline, path: InputPath) -> list[PhaseDeviation]:
        """List the deviations of all signals by phase."""
        found = []
        predicted = self.predict(driveline, path)
        for one in self.signals:
            for name, (begin, end) in self.phases.items():
                inside = (one.time >= begin) & (one.time <= end)
                if np.count_nonzero(inside) < _FEWEST:
                    continue
                found.append(
                    PhaseDeviation(
                        self.driven.logged.log.source,
                        one.channel,
                        one.role,
                        name,
                        max(begin, float(one.time[0])),
                        float(np.sqrt(np.mean((one.values - predicted[one.role])[inside] ** 2))),
                        float(np.hypot(one.noise, _EXPLAINED * one.error)),
                    )
                )
        return found

    @property
    def largest_torque(self) -> float:
        """Largest measured output torque [N m]; that of the engine in the old gear without it."""
        for one in self.signals:
            if one.role == "output_torque":
                return float(np.quantile(np.abs(one.values), 0.99))
        return abs(self.shift.point.engine_torque * self.shift.ratios[0])


_FEWEST = 20
"""Fewest samples of a phase in which a deviation says anything beside its scatter."""


def _collect_inputs(
    driven: DrivenShift, torque: Signal, pressures: Mapping[str, Signal], first: float
) -> dict[str, Signal]:
    """Return the commanded inputs, or the logged ones, on the clock of the run from `first` [s]."""
    given = {**pressures, ENGINE_TORQUE: torque}
    if driven.profiles is not None:
        shift, profiles = driven.logged.shift, driven.profiles
        given = {
            ENGINE_TORQUE: profiles.engine_torque,
            shift.offgoing: profiles.offgoing,
            shift.oncoming: profiles.oncoming,
        }
    return {name: replace(one, time=np.asarray(one.time) - first) for name, one in given.items()}


def _compare(seen: MeasuredSignal, role: str, shift: Maneuver, first: float) -> ComparedSignal:
    grid = shift.time
    time = seen.time - first
    inside = (time >= grid[0]) & (time <= grid[-1])
    time, values = time[inside], seen.values[inside]
    sample = _build_interpolation(grid, time)
    places, count = np.unique((time / _BIN).astype(np.intp), return_counts=True)
    order = np.repeat(np.arange(places.size), count)
    averages = csr_array(
        (1.0 / count[order], (order, np.arange(time.size))), shape=(places.size, time.size)
    )
    error = compute_model_error(role, seen, shift)
    scale = np.hypot(seen.sigma / np.sqrt(count), error)
    return ComparedSignal(
        role,
        "",
        time + first,
        values,
        averages @ values,
        scale,
        seen.sigma,
        error,
        averages @ sample,
        sample,
    )


def compute_model_error(role: str, seen: MeasuredSignal, shift: Maneuver) -> float:
    """Compute the error of the model in a signal [SI] that counts as usual."""
    if role == "output_torque":
        return _TORQUE_ERROR * float(np.quantile(np.abs(seen.values), 0.99))
    old, new = (abs(one) for one in shift.ratios)
    change = _SPEED_ERROR * shift.point.engine_speed * abs(1.0 - new / old)
    return change / (shift.model.i_in if role == "input_speed" else old)


def _build_interpolation(grid: FloatArray, time: FloatArray) -> csr_array:
    """Build the linear interpolation (s, n) from an even grid (n,) to `time` (s,) within it."""
    step = grid[1] - grid[0]
    left = np.clip((time / step).astype(np.intp), 0, grid.size - 2)
    share = time / step - left
    rows = np.arange(time.size)
    return csr_array(
        (
            np.concatenate([1.0 - share, share]),
            (np.concatenate([rows, rows]), np.concatenate([left, left + 1])),
        ),
        shape=(time.size, grid.size),
    )

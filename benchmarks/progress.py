# SPDX-License-Identifier: MIT
"""Honesty of the progress of long computations, and the measured shares of their stages.

`python -m benchmarks.progress` runs each computation and prints its CPU time, the largest deviation
of the share shown from the share of the CPU time gone, and the share of the time in which the time
left is within a factor of two. `--write` stores the mean CPU seconds of each stage as data of the
package (`drivetwin/_util/stage_seconds.toml`); run it after a stage was added or has become faster.
CPU time counts: a loaded machine slows all stages down alike.
"""

from __future__ import annotations

import argparse
import tempfile
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from time import process_time
from typing import TypeVar

import numpy as np

from benchmarks.stage_clock import record_stages
from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import TABLE, attach_listener
from drivetwin.calibration.calibrate import Calibration, calibrate
from drivetwin.calibration.calibrate import Task as CalibrationTask
from drivetwin.calibration.maneuver import OperatingPoint
from drivetwin.calibration.operating_map import Grid, calibrate_map, trace_front
from drivetwin.calibration.options import PolicyKind
from drivetwin.calibration.twin_task import Request, build_task
from drivetwin.cli.identify import load_identified_card, read_shifts
from drivetwin.cli.requests.identification import IdentifyOptions
from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.analysis.experiment_design import rank_experiments
from drivetwin.estimation.result.method import Method
from drivetwin.report.html import build_report_page, render_page
from drivetwin.twin.twin import Twin
from drivetwin.validation.validated_model import (
    JointIdentification,
    Source,
    ValidatedModel,
    identify_together,
    identify_validated,
)
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.spec import SensorTolerance
from drivetwin.workbench.identifying import Task, identify_logs

T = TypeVar("T")

SCENARIOS = (
    "paper",
    "paper_steps",
    "gearbox",
    "gearbox_chain",
    "power_on_down",
    "dual_clutch",
    "manual",
)
"""Scenarios of the virtual dynamometer that are identified by each method."""
EARLY = 0.05
"""Share done below which the time left is a guess."""
OPEN = "paper"
"""Scenario that leaves a parameter open, so that experiments are compared."""


@dataclass(frozen=True, eq=False)
class Timeline:
    """Shares (n,) that a computation reported at CPU times (n,) [s], and its whole time [s]."""

    seconds: FloatArray
    shares: FloatArray
    whole: float

    @property
    def deviation(self) -> float:
        """Largest deviation of the share shown from the share of the time gone."""
        gone = self.seconds / self.whole
        shown = np.concatenate([[0.0], self.shares[:-1]])  # just before a report the last one holds
        return float(max(np.max(np.abs(self.shares - gone)), np.max(np.abs(shown - gone))))

    def compute_time_left(self, seconds: float) -> float | None:
        """Compute the time left [s] by the share shown so late; None for a small share."""
        share = float(self.shares[np.searchsorted(self.seconds, seconds, side="right") - 1])
        is_early = seconds < self.seconds[0] or share < EARLY
        return None if is_early else seconds * (1.0 - share) / share

    def count_right(self, factor: float = 2.0) -> tuple[float, float]:
        """Return the shares of the time with a time left, and with one right within `factor`.

        The last 5 % of the time do not count: there the time left is a rounded second.
        """
        at = np.linspace(0.0, 0.95 * self.whole, 200)
        left = [(self.whole - one, self.compute_time_left(one)) for one in at.tolist()]
        shown = [(true, announced) for true, announced in left if announced is not None]
        right = [true / factor <= announced <= factor * true for true, announced in shown]
        return len(shown) / len(left), sum(right) / max(len(shown), 1)


def record_timeline(work: Callable[[], object]) -> Timeline:
    """Run a computation and record the progress that it reports."""
    seconds, shares = [], []
    began = process_time()

    def record(share: float, _: str) -> None:
        seconds.append(process_time() - began)
        shares.append(share)

    with attach_listener(record):
        work()
    return Timeline(np.array(seconds), np.array(shares), process_time() - began)


@dataclass(frozen=True, eq=False)
class Bench:
    """A synthetic log with its vehicle card, and its detected shifts."""

    source: Source
    card: VehicleCard

    def render(self, model: ValidatedModel) -> str:
        """Render the report of the log."""
        return render_page(build_report_page(model.result, [self.source.log]))

    def identify(self, method: Method) -> ValidatedModel:
        """Identify the log and simulate its shifts, as the command `identify` does."""
        return identify_validated(self.source.log, self.card, self.source.shifts, method)


def make_bench(folder: Path, scenario: str, seed: int = 0) -> Bench:
    """Make the log of a scenario and read it as the command `identify` does."""
    made = run(load_scenario(scenario), seed)
    path, card_path, _ = write_run(folder / f"{scenario}-{seed}.csv", made)
    how = IdentifyOptions(vehicle=card_path, method=Method.LIKELIHOOD)
    card = load_identified_card(how)
    log, shifts, _ = read_shifts(path, how, card)
    return Bench(Source(log, shifts), card)


def run_estimations(folder: Path) -> Iterator[tuple[str, Timeline]]:
    """Identify each scenario by each method, write its report and compare experiments."""
    benches = {name: make_bench(folder, name) for name in SCENARIOS}
    first = benches["paper_steps"]
    sensors = {"engine_torque": SensorTolerance(0.01, 5.0), "output_torque": SensorTolerance(0.01)}
    benches["tolerances"] = replace(first, card=replace(first.card, sensors=sensors))
    for method in Method:
        for name, bench in benches.items():
            found: list[ValidatedModel] = []
            line = record_timeline(partial(_collect, found, partial(bench.identify, method)))
            yield f"identify {name}, {method}", line
            yield "report", record_timeline(partial(bench.render, found[0]))
            experiments = partial(rank_experiments, found[0].result)
            yield "experiments", record_timeline(experiments)


def run_joint(folder: Path) -> Iterator[tuple[str, Timeline]]:
    """Identify two logs together, write their report, and run the job of the workbench."""
    joined: list[JointIdentification] = []
    benches = [make_bench(folder, "paper_steps", seed) for seed in (0, 1)]
    sources, card = [one.source for one in benches], benches[0].card
    join = partial(_collect, joined, partial(identify_together, sources, card))
    yield "several logs", record_timeline(join)
    page = partial(lambda made: render_page(build_report_page(made.found, made.fitted)), joined[0])
    yield "report of several logs", record_timeline(page)
    bench = make_bench(folder, OPEN)
    task = Task([bench.source], bench.card)
    yield "workbench", record_timeline(lambda: identify_logs(lambda _: None, task))


def run_calibrations(folder: Path) -> Iterator[tuple[str, Timeline]]:
    """Calibrate a shift, trace its front, and calibrate a map."""
    with record_stages():  # not recorded: a single identification is no measurement
        twin = make_bench(folder, "paper_steps").identify(Method.LIKELIHOOD).twin
    calibrated: list[Calibration] = []
    request, grid = Request(gears=("2", "3")), Grid((1000.0, 1400.0), (160.0, 190.0))
    work = partial(_collect, calibrated, partial(run_calibration, twin, request))
    yield "calibrate, controller", record_timeline(work)
    yield "front", record_timeline(partial(trace_front, calibrated[0]))
    knots = replace(request, policy=PolicyKind.KNOTS)
    yield "map, knots", record_timeline(partial(run_map, twin, knots, grid))


def _collect(found: list[T], work: Callable[[], T]) -> None:
    found.append(work())


def run_calibration(twin: Twin, request: Request) -> Calibration:
    """Calibrate the operating point of a request."""
    return calibrate(build_task(twin, request))


def run_map(twin: Twin, request: Request, grid: Grid) -> None:
    """Calibrate the operating points of a grid."""

    def make_task(point: OperatingPoint) -> CalibrationTask:
        torque, speed = point.engine_torque, point.engine_speed
        return build_task(twin, replace(request, engine_torque=torque, engine_speed=speed))

    calibrate_map(make_task, grid)


PARTS: dict[str, Callable[[Path], Iterator[tuple[str, Timeline]]]] = {
    "estimation": run_estimations,
    "joint": run_joint,
    "calibration": run_calibrations,
}
"""Groups of computations by name."""


def format_table(means: Mapping[str, Mapping[str, float]]) -> str:
    """Return the seconds of stages as a TOML file."""
    lines = ["# CPU seconds of stages, written by `python -m benchmarks.progress --write`."]
    for computation, stages in sorted(means.items()):
        lines += ["", f'["{computation}"]']
        lines += [f'"{name}" = {seconds:.3g}' for name, seconds in stages.items()]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run all computations, print one row for each, and store the table if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "parts",
        nargs="*",
        choices=[*PARTS, []],
        metavar="PART",
        help=f"{', '.join(PARTS)}; default: all",
    )
    parser.add_argument("--write", action="store_true", help="store the seconds of the stages")
    arguments = parser.parse_args()
    print("CPU [s]  deviation  time left shown, right within a factor of 2")
    with tempfile.TemporaryDirectory() as folder, record_stages() as clock:
        for part in arguments.parts or PARTS:
            for name, line in PARTS[part](Path(folder)):
                if line.shares.size == 0:
                    continue  # nothing was to be computed
                shown, right = line.count_right()
                row = f"{line.whole:7.2f}  {line.deviation:9.2f}  {shown:5.2f} {right:5.2f}  {name}"
                print(row, flush=True)
    if arguments.write:
        known = tomllib.loads(TABLE.read_text(encoding="utf-8"))
        TABLE.write_text(format_table(known | clock.compute_means()), encoding="utf-8")


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: MIT
"""`drivetwin try TWIN --shift 2-3 --controller FILE`: test bench of the user's controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

from drivetwin.calibration.options import PolicyKind, ShiftOptions
from drivetwin.calibration.trial import Difference, Trial, compare_trials, run_trials
from drivetwin.calibration.twin_task import Request
from drivetwin.cli.calibrate import compile_controller, load_valid_twin
from drivetwin.cli.export import parse_gears
from drivetwin.cli.options import REPORT
from drivetwin.cli.output import show_step, write_texts
from drivetwin.cli.requests.use import Try
from drivetwin.files.calibration_file import STOCK, TrialFile, load_trials
from drivetwin.report.blocks import Outcome
from drivetwin.report.trial import build_trial_blocks, build_trials_page, format_junit
from drivetwin.twin.twin import Twin

JUNIT = "junit.xml"
FAILED = 1
"""Exit code where an assertion fails."""


def try_controller(request: Try) -> Outcome:
    """Run the scenarios by one or two controllers, and write page and JUnit file."""
    twin, trials = load_valid_twin(request.twin), load_trials(request.scenarios or STOCK)
    found = _run(twin, trials, request, request.controller)
    differences: list[Difference] = []
    if request.against is not None:
        differences = compare_trials(found, _run(twin, trials, request, request.against))
    files: Sequence[Path] = ()
    if request.output is not None:
        name = request.controller.stem
        page = build_trials_page(found, differences, f"Test of {name}")
        files = write_texts(request.output, {JUNIT: format_junit(found, name), REPORT: page})
    states = [
        {
            "scenario": one.scenario.name,
            "error": one.error,
            "checks": [asdict(check) for check in one.checks],
        }
        for one in found
    ]
    return Outcome(
        build_trial_blocks(found, differences),
        {"scenarios": states, "differences": [asdict(one) for one in differences]},
        files,
        exit_code=FAILED if any(one.failed for one in found) else 0,
    )


def _run(twin: Twin, trials: TrialFile, request: Try, path: Path) -> list[Trial]:

    asked = Request(
        **request.select(ShiftOptions),
        gears=parse_gears(request.shift),
        spread=trials.spread,
        oil=trials.oil.to_friction(),
        policy=PolicyKind.OWN,
    )
    scenarios = trials.list_scenarios(request.shift, request.draws)
    with compile_controller(path, bench=True) as given, show_step(f"testing {path.name}"):
        timed = replace(given, task=request.task or given.task)
        return run_trials(twin, asked, timed, scenarios)

# SPDX-License-Identifier: MIT
"""`drivetwin try TWIN --shift 2-3 --controller FILE`: test bench of the user's controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin._util.request import REQUIRED, SECOND, input_file, option, output_folder
from drivetwin.calibration.options import ShiftOptions
from drivetwin.calibration.policies.kind import PolicyKind
from drivetwin.cli.calibrate import compile_controller
from drivetwin.cli.options import REPORT, TwinInput
from drivetwin.cli.output import show_step, write_texts
from drivetwin.report.blocks import Outcome

if TYPE_CHECKING:
    from drivetwin.calibration.trial import Trial
    from drivetwin.calibration.trial_comparison import Difference
    from drivetwin.files.limits_file import TrialFile
    from drivetwin.twin.twin import Twin

JUNIT = "junit.xml"
FAILED = 1
"""Exit code where an assertion fails."""


class Try(ShiftOptions, TwinInput, command="try"):
    """Arguments of `try`."""

    shift: str = option("Shift of the scenarios that state none, such as 2-3.",
                        metavar="GEAR-GEAR", default=REQUIRED)  # fmt: skip
    controller: Path = input_file("Parameter file of your controller in C.", default=REQUIRED)
    against: Path | None = input_file("Parameter file of a second controller, on the same draws.")
    scenarios: Path | None = input_file("Scenarios and assertions (TOML); else those in stock.")
    draws: int = option("Drawn units of each scenario.", minimum=1, maximum=100_000, default=16)
    task: float | None = option(
        "Time between two commands, in place of that of the file.",
        unit=SECOND,
        minimum=1e-3,
        maximum=0.1,
    )
    output: Path | None = output_folder("Folder for report.html and junit.xml.")


def try_controller(request: Try) -> Outcome:
    """Test a controller in C on drawn units of a twin, with faults and assertions.

    Run the scenarios of a file, or those in stock: mass, gradient, oil, torque, pedal, weak
    clutches, slow filling, late, stuck and lost signals. With --against, compare a second
    controller on the same draws. Exit code 1 where an assertion of the controller fails.
    """
    from drivetwin.calibration.trial_comparison import compare_trials
    from drivetwin.cli.calibrate import load_valid_twin
    from drivetwin.files.limits_file import STOCK, load_trials
    from drivetwin.report.trial import build_trial_blocks, build_trials_page, format_junit

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
    from drivetwin.calibration.trial import run_trials
    from drivetwin.calibration.twin_task import Request
    from drivetwin.cli.export import parse_gears

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

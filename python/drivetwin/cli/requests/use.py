# SPDX-License-Identifier: MIT
"""Requests of the commands that go on with a result.

The text of a request is the help of its command.
"""

from __future__ import annotations

from pathlib import Path

from drivetwin._util.request import (
    LOG_ENDINGS,
    PAGE,
    REQUIRED,
    SECOND,
    Output,
    Request,
    Shape,
    argument,
    flag,
    input_file,
    option,
    output_file,
    output_folder,
)
from drivetwin.calibration.options import CalibrationOptions, ShiftOptions
from drivetwin.cli.options import TwinInput, TwinLogInput, mapping_option, result_argument
from drivetwin.export.targets import ExportOptions, InputKind


class Simulate(
    TwinLogInput,
    command="simulate",
    runs="simulate:simulate",
    examples=(
        "simulate result other.csv -o signals.csv -o page.html",
        "simulate k0 other.csv -o page.html",
    ),
):
    """Simulate the shifts of a log with an identified model and compare.

    The inputs are the measured engine torque and pressures. The log can differ from the log of the
    identification. Ratios and shift elements are those of the twin; a vehicle card is not needed.
    The result of a fit simulates the recording as a whole by its model.toml.
    The twin of a gearbox control's log predicts shifts from commands and bus torque, with bands.
    """

    twin: Path = result_argument()
    output: tuple[Path, ...] = output_file(
        "Measured and simulated signals: .csv as a table side by side (SI), .html as a page with "
        "plots; repeatable.",
        "FILE",
        {".csv": "table"} | PAGE,
        (),
    )
    step: float | None = option(
        "Step at which the inputs are sampled, as by an importer of the exported FMU.",
        metavar="SECONDS",
    )
    input: InputKind = option(
        "Inputs between these steps; without --step the step is 1 ms.", default=InputKind.LINEAR
    )
    parameters: Path | None = input_file(
        "Exported and edited parameter file; its values replace those of the twin."
    )
    from_command: bool = flag(
        "Compute pressures from the commands in the log by the actuators of the twin."
    )
    template: Path | None = input_file(
        "Template by which the file of --parameters was exported.", needs=("parameters",)
    )


class Observe(
    TwinLogInput,
    command="observe",
    runs="observe:observe",
    examples=("observe result shift.csv -o torques.csv",),
):
    """Estimate torques of output shaft and clutches in the shifts of a log, with 95 % bands.

    The log needs no output torque; if it has one, it is not used.
    """

    output: tuple[Path, ...] = output_file(
        "File for the torques: .csv, .parquet, .mf4 or .mat; page with the figures: .html; "
        "repeatable.",
        "FILE",
        LOG_ENDINGS | PAGE,
        (),
    )


class CalibrationFiles(TwinInput):
    """Shift, output folder and limits of a calibration."""

    shift: str | None = option(
        "Shift to calibrate, such as 2-3; default: the first upshift.", metavar="GEAR-GEAR"
    )
    output: Path = output_folder("Folder for the results.", default=REQUIRED)
    limits: Path | None = input_file("Limits and spread (TOML).")


class Calibrate(
    CalibrationOptions,
    CalibrationFiles,
    command="calibrate",
    runs="calibrate:calibrate",
    examples=("calibrate result --shift 2-3 -o calibration",),
):
    """Find shift profiles with a small peak jerk over production scatter.

    Minimise the tail mean of peak jerk under limits, and certify the result on fresh draws. Write
    calibration.toml, certificate.json, report.html, and calibration.csv, .dcm and .cdfx into DIR;
    with --from-logs also the corrected twin.toml.
    Where a limit is out of reach, the best calibration found is written and the exit code is 2.
    """

    controller: Path | None = input_file(
        "Parameter file of your own controller in C; the policy is then own."
    )
    start: tuple[Path, ...] = input_file(
        "Earlier calibration.toml as the start (may be repeated with --from-logs: the best by the "
        "corrected twin counts).",
        default=(),
    )
    effort: float = option(
        "Factor on the length of the search.", minimum=0.05, maximum=20.0, default=1.0
    )
    draws: int = option("Number of fresh draws of the certificate.", minimum=59, default=2000)
    front: bool = flag("Add the front of comfort, friction energy and time.", decides=False)
    grid: str | None = option(
        "Grid of operating points, such as torque=800:1400:3,speed=1600:2000:3 (N·m, rpm; from, "
        "to, points); ,oil=40:100:3 (°C) adds the oil temperature.",
        "--map",
        metavar="GRID",
        decides=False,
    )
    template: Path | None = input_file(
        "Template of the parameter files: labels, units, axes and breakpoints (TOML)."
    )
    from_logs: tuple[Path, ...] = input_file(
        "Log of the vehicle's shifts with an earlier calibration (may be repeated): it corrects "
        "the twin. With --start the calibration is polished from there, not searched.",
        metavar="LOG",
        default=(),
    )


class Try(
    ShiftOptions,
    TwinInput,
    command="try",
    runs="calibrate:try_controller",
    examples=("try result --shift 2-3 --controller my_controller.toml -o bench",),
):
    """Test a controller in C on drawn units of a twin, with faults and assertions.

    Run the scenarios of a file, or those in stock: mass, gradient, oil, torque, pedal, weak
    clutches, slow filling, late, stuck and lost signals. With --against, compare a second
    controller on the same draws. Exit code 1 where an assertion of the controller fails.
    """

    shift: str | None = option(
        "Shift of the scenarios that state none, such as 2-3; default: the first upshift.",
        metavar="GEAR-GEAR",
    )
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


class Report(
    Request,
    command="report",
    runs="report:report",
    examples=(
        "report result",
        "report monday tuesday other.csv -o comparison.html",
    ),
):
    """Print the path of a report, or compare several results.

    For one result of identify, examine or fit, print its verdict and the path of its report. For
    several, or a twin and logs, write a page that compares parameters, friction, and the simulation
    of each log by each twin.
    """

    sources: tuple[Path, ...] = argument(
        "Folders of identify, examine or fit, their results, twin.toml, or logs.", "SOURCE..."
    )
    output: Path = output_file(
        "Page with the comparison.", "FILE.html", PAGE, Path("comparison.html")
    )
    channels: Path | None = mapping_option()


class Export(
    ExportOptions,
    command="export",
    runs="export:export",
    examples=(
        "export result --to fmu --shift 2-3 --log shift.csv",
        "export result --to dcm -o truck.dcm",
    ),
):
    """Write the identified model for another program.

    c: C99 sources for a controller. fmu: co-simulation FMU with sources. modelica: package of
    components of the Standard Library. ssv, cdfx, dcm, m, csv: parameter files with units and
    intervals, of the results of bus logs and of fits too.
    """

    twin: Path = result_argument()
    output: Path | None = output_file(
        "File, or folder for c; default: ./TWIN.FORMAT.", "PATH", shape=Shape.EITHER
    )
    shift: str | None = option(
        "For models: shift, such as 2-3; default: the first upshift.", metavar="GEAR-GEAR"
    )
    log: Path | None = input_file(
        "For models: log with the initial state; fmu and modelica contain its shift.", "LOG"
    )
    inputs: Path | None = option(
        "For models, with --log: also write the inputs of the log's shift as the model takes them "
        "(CSV), delays removed.",
        metavar="FILE",
        output=Output(),
        needs=("log",),
    )
    as_logged: bool = flag(
        "For models, with --log: take inputs as the log shows them. The model delays the earlier "
        "inputs, and its outputs are later by the largest delay.",
        needs=("log",),
    )
    channels: Path | None = mapping_option(needs=("log",))

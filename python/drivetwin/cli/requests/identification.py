# SPDX-License-Identifier: MIT
"""Requests of the commands that look at logs, identify, and make logs with known truth.

The text of a request is the help of its command.
"""

from __future__ import annotations

from pathlib import Path

from drivetwin._util.request import (
    LOG_ENDINGS,
    PAGE,
    FileRole,
    Output,
    Request,
    argument,
    flag,
    input_file,
    option,
    output_file,
    output_folder,
)
from drivetwin.cli.options import (
    CardInput,
    LogInput,
    card_option,
    effects_option,
    log_argument,
    logs_argument,
    mapping_option,
    method_option,
    quick_option,
    strict_flag,
)
from drivetwin.dyno import ScenarioName
from drivetwin.estimation.result.method import FrictionShape, Method
from drivetwin.vehicle.effects import EffectId


class Bench(Request):
    """Scenario and sensor noise of the virtual dynamometer."""

    scenario: ScenarioName = option(
        "paper: the paper's numbers at constant engine torque; paper_steps: the same with "
        "throttle steps; throttle_steps: a long, strongly modulated 2nd gear; gearbox: a whole "
        "gearbox with drums that have inertia; gearbox_chain: the same from 2nd to 4th gear; "
        "power_on_down, power_off_up, power_off_down: the other kinds of shift; input_gear: behind "
        "an input gear of 1.2; dual_clutch, manual: a car with such a gearbox; "
        "open_converter: behind an open torque converter; hydraulics: with the commands of the "
        "controller; controller_log: twelve shifts as a gearbox control logs them (synth).",
        metavar="NAME",
        default=ScenarioName.PAPER_STEPS,
    )
    seed: int = option("Seed of the sensor noise.", minimum=0, default=0)
    noise: float = option("Factor on the sensor noise; 0: neither noise nor rounding.", default=1.0)


class Demonstrate(
    Bench,
    command="demo",
    runs="synth:demo",
    examples=(
        "demo",
        "demo --scenario gearbox -o demo-gearbox",
    ),
):
    """Identify a synthetic log with known truth by two methods, and compare."""

    output: Path = output_folder("Folder for all files.", default=Path("drivetwin-demo"))


class Synthesize(
    Bench,
    command="synth",
    runs="synth:synth",
    examples=(
        "synth -o shift.csv --scenario paper_steps --seed 1",
        "synth --model tip_in -o tip_in.csv",
    ),
):
    """Make a shift log with known truth on the virtual dynamometer.

    Also write the truth NAME.truth.json and the vehicle card NAME.card.toml. With a model the log
    is one of its driveline, and the model file NAME.model.toml has first guesses.
    """

    output: Path = output_file(
        "Log to write; the ending .csv, .mf4, .parquet or .mat sets the format.",
        "NAME.csv",
        LOG_ENDINGS,
        Path("synth.csv"),
    )
    model: str | None = option(
        "Model file of 'drivetwin fit' with a manoeuvre, in place of a scenario: a file, or "
        "engine_start, tip_in, converter_lock_up.",
        metavar="MODEL",
        excludes=("scenario", "torque_reduction", "drum", "effect"),
    )
    torque_reduction: float = option(
        "Share by which the engine torque is reduced in the inertia phase.", default=0.0
    )
    drum: float | None = option(
        "Inertia of each brake drum in the gearbox scenarios; default: 0.05.", metavar="KGM2"
    )
    effect: tuple[str, ...] = option(
        "Effect that the dual-clutch model lacks, repeatable; units and shares are those of "
        f"docs/howto/synthetic-log.md: {', '.join(EffectId)}.",
        metavar="NAME=SIZE",
        default=(),
    )


class Inspect(
    Request,
    command="inspect",
    runs="inspect:inspect",
    examples=(
        "inspect shift.mf4",
        "inspect shift.csv --write-mapping channels.toml --accept-proposals",
    ),
):
    """List the columns of a log with unit, rate, range, gaps and proposed role.

    Also list the warnings of shifts and identify, and their reason if they refuse the log.
    """

    log: Path = log_argument()
    vehicle: Path | None = input_file("Vehicle card; its elements name the pressures.", "CARD")
    channels: Path | None = mapping_option()
    write_mapping: Path | None = option(
        "Write the channel mapping as a file to edit; open points are comments.",
        metavar="MAP",
        output=Output(),
    )
    accept_proposals: bool = flag(
        "With --write-mapping: enter units that are the only proposal.", needs=("write_mapping",)
    )


class DetectShifts(
    LogInput,
    command="shifts",
    runs="shifts:shifts",
    examples=(
        "shifts drive.mf4 --vehicle truck.card.toml -o quality.html",
        "shifts after.mf4 --vehicle truck.card.toml --against before.mf4",
    ),
):
    """Detect the shifts of a log, with phases and shift quality.

    For several shifts, state the distribution of each figure by kind and gears, outliers and trend.
    For a log without output torque, also estimate the resonance of the driveline after each shift,
    and the total inertia over η in each gear held, as far as the log determines them.

    With a card of the ratios alone, list the shifts of a bus log and their phases.
    """

    against: tuple[Path, ...] = input_file(
        "Log of another vehicle or software state to compare the shift quality with (may be "
        "repeated).",
        "LOG",
        FileRole.LOG,
        (),
    )
    output: Path | None = output_file(
        "Page with shift quality by kind of shift.", "FILE.html", PAGE
    )


class IdentifyOptions(CardInput):
    """Card, channel mapping and method of an identification, and priors of effects as typed."""

    method: Method = method_option()
    quick: bool = quick_option()
    effects: tuple[str, ...] = effects_option()


class Identify(
    Request,
    command="identify",
    runs="identify:identify",
    examples=(
        "identify shift.csv --vehicle truck.card.toml -o result",
        "identify a.mf4 b.mf4 --vehicle truck.card.toml --together -o both",
        "identify bus1.blf bus2.blf --hold-out bus2 -o bus",
    ),
):
    """Identify the driveline from shift logs.

    With -o, write DIR/result.json, DIR/twin.toml and DIR/report.html. Several logs are identified
    one by one, each into DIR/NAME-OF-LOG. If a log cannot be identified, it is reported and the
    exit code is 2; the other logs get their results.

    With --together, one driveline is fitted to all logs; load and engine-torque delay are specific
    to each log. With --hold-out, which implies --together, a log or shift takes no part in the fit.
    It is simulated with the parameters of the others and compared.

    Bus logs without pressures and output torque need a card of the ratios alone, or none: all logs
    are then of one vehicle and identified as one, into DIR/bus.json and DIR/report.html. With
    --hold-out, the decays of a LOG are predicted by the others.

    Logs of a gearbox control (commanded pressures, engine torque of the bus) need a card with
    converter and [[changes]]; see 'drivetwin schema tcu-card'. All shifts of all logs are fitted as
    one, into DIR/tcu.json, DIR/twin.toml and DIR/report.html; every fifth is held out, unless
    --hold-out names others.
    """

    logs: tuple[Path, ...] = logs_argument("One or more shift logs.")
    vehicle: Path | None = input_file(
        "Vehicle card, or a card of the ratios alone (TOML); without one, the ratios are taken "
        "from the speeds of a bus log.",
        "CARD",
        FileRole.CARD,
    )
    channels: Path | None = mapping_option()
    method: Method = method_option()
    quick: bool = quick_option()
    effects: tuple[str, ...] = effects_option()
    output: Path | None = output_folder("Folder for result, twin and report.")
    together: bool = flag("Fit all logs of one vehicle jointly.")
    hold_out: tuple[str, ...] = option(
        "Shift to predict instead of fit: its number, a LOG, or LOG:NUMBER; repeatable.",
        metavar="SHIFT",
        default=(),
    )
    bus: bool = flag("Use speeds, gear and engine torque alone, also with a whole vehicle card.")
    strict: bool = strict_flag(
        "every model is valid, limits included; of bus logs, unless the shifts agree and identify "
        "a quantity"
    )

    @property
    def options(self) -> IdentifyOptions:
        """The options of the identification of a whole vehicle card."""
        return IdentifyOptions(**self.select(IdentifyOptions))


class Examine(
    Request,
    command="examine",
    runs="examine:examine",
    examples=(
        "examine shift.csv --vehicle truck.card.toml -o examined",
        "examine shift.csv --vehicle truck.card.toml --profile J_out",
    ),
):
    """Recommend the test that reduces parameter uncertainty most, and test the intervals.

    The log is first identified by the likelihood method. The command lists the experiments that
    narrow weak, not identifiable and least known parameters, with the expected intervals. Options
    add the profile likelihood, and friction curves of free or monotone shape with a twin. With a
    model file the log is fitted as by 'drivetwin fit', and all but the friction curves apply. The
    folder of -o also has the files that identify or fit writes.
    """

    log: Path = log_argument()
    vehicle: Path | None = card_option()
    model: Path | None = input_file(
        "Model file of 'drivetwin fit', in place of a card.",
        "MODEL",
        excludes=("vehicle", "channels", "friction"),
    )
    channels: Path | None = mapping_option()
    profile: tuple[str, ...] = option(
        "Compute the profile likelihood of a parameter, such as J_out.",
        metavar="PARAMETER",
        default=(),
    )
    seed: int = option("Seed of the starts of a model's fit.", minimum=0, default=0)
    friction: FrictionShape | None = option(
        "Estimate friction over slip as a curve of this shape instead of the Stribeck law."
    )
    strict: bool = strict_flag("the model is valid, limits included")
    output: Path | None = output_folder("Folder for the files.")


class Fit(
    Request,
    command="fit",
    runs="fit:fit",
    examples=("fit k0.model.toml k0.csv --hold-out other.csv -o k0",),
):
    """Identify the unknowns of a model of any driveline from recordings.

    The model file has the elements of the driveline, the columns of the log for its inputs and
    outputs, and the unknowns with first guess and prior. Print the values with intervals and
    verdicts, the agreement of simulation and recordings, and the findings. The fitted model is
    written as a model file.
    """

    model: Path = argument(
        "Model file (TOML); see 'drivetwin schema model'.", "MODEL", role=FileRole.OTHER
    )
    logs: tuple[Path, ...] = logs_argument("Recordings of any format.")
    hold_out: tuple[Path, ...] = input_file(
        "Predict a recording with the fit.", metavar="LOG", default=()
    )
    seed: int = option("Seed of the draws of the search.", minimum=0, default=0)
    strict: bool = strict_flag("the model is valid, limits included")
    output: Path | None = output_folder("Folder for result, model and report.")

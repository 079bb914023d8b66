# SPDX-License-Identifier: MIT
"""`drivetwin synth`: a log with known truth from the virtual dynamometer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin._util.request import LOG_ENDINGS, Request, option, output_file
from drivetwin.cli.output import show_step, write_atomically, write_texts
from drivetwin.dyno.names import ScenarioName
from drivetwin.report.blocks import Outcome
from drivetwin.vehicle.effects import EffectId

if TYPE_CHECKING:
    from drivetwin.dyno.dyno import DynoRun


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


class Synthesize(Bench, command="synth"):
    """Arguments of `synth`."""

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


def synth(request: Synthesize) -> Outcome:
    """Make a shift log with known truth on the virtual dynamometer.

    Also write the truth NAME.truth.json and the vehicle card NAME.card.toml. With a model the log
    is one of its driveline, and the model file NAME.model.toml has first guesses.
    """
    write = _write_scenario_log if request.model is None else _write_model_log
    if request.model is None and request.scenario is ScenarioName.CONTROLLER_LOG:
        write = _write_controller_log
    with show_step(f"running {request.model or request.scenario}"):
        files = write(request)
    return Outcome(document=files, files=tuple(files.values()))


def _write_scenario_log(request: Synthesize) -> dict[str, Path]:
    """Write log, card and truth of a scenario, all or none; return their paths."""
    from drivetwin.dyno.dyno import run
    from drivetwin.dyno.scenario_file import load_scenario
    from drivetwin.dyno.truth import parse_effects

    setup = load_scenario(request.scenario, request.drum)
    setup = setup.set_torque_reduction(request.torque_reduction)
    effects = parse_effects(request.effect)
    bench = run(setup, request.seed, noise=request.noise, effects=effects)
    log, card, truth = write_run(request.output, bench)
    return {"log": log, "card": card, "truth": truth}


def _write_controller_log(request: Synthesize) -> dict[str, Path]:
    """Write log, card and truth of shifts as a gearbox control logs them, all or none."""
    from drivetwin.errors import InputError, Where
    from drivetwin.tcu.synthesize import make_log

    output, place = request.output, Where(file=str(request.output))
    if output.suffix.casefold() != ".csv":
        what = "the log of a gearbox control is a CSV file"
        raise InputError(what, "give a name that ends in .csv", place)
    if request.effect or request.drum is not None or request.torque_reduction:
        what = "the log of a gearbox control has no effects, drums or torque reduction to choose"
        raise InputError(what, "leave out --effect, --drum and --torque-reduction")
    made = make_log(request.seed, noise=request.noise)
    files = {
        "log": (output, made.log),
        "card": (output.with_suffix(".card.toml"), made.card),
        "truth": (output.with_suffix(".truth.json"), made.truth),
    }
    write_texts(output.parent, {path.name: text for path, text in files.values()})
    return {name: path for name, (path, _) in files.items()}


def _write_model_log(request: Synthesize) -> dict[str, Path]:
    """Write log, model file and truth of the manoeuvre of a model, all or none."""
    from drivetwin.errors import InputError, Where
    from drivetwin.fit.synthesize import find_model, synthesize_log

    output, place = request.output, Where(file=str(request.output))
    if output.suffix.casefold() != ".csv":
        raise InputError("the log of a model is a CSV file", "give a name that ends in .csv", place)
    made = synthesize_log(*find_model(request.model or ""), request.seed, request.noise)
    files = {
        "log": (output, made.log),
        "model": (output.with_suffix(".model.toml"), made.model),
        "truth": (output.with_suffix(".truth.json"), made.truth),
    }
    write_texts(output.parent, {path.name: text for path, text in files.values()})
    return {name: path for name, (path, _) in files.items()}


def write_run(output: Path, run: DynoRun) -> tuple[Path, Path, Path]:
    """Write log, vehicle card and truth of a run, all or none; returns their paths.

    A CSV log is one table in which slow channels hold their value, as a data logger writes it; the
    other formats keep each channel's own time base.
    """
    from drivetwin.dyno.scenario_file import convert_channels, format_card, format_log, format_truth
    from drivetwin.logs.write import write_log

    card, truth = output.with_suffix(".card.toml"), output.with_suffix(".truth.json")
    texts = {card: format_card(run.scenario), truth: format_truth(run)}
    if output.suffix.casefold() == ".csv":
        texts[output] = format_log(run)
    with write_atomically(output.parent) as folder:
        for path, text in texts.items():
            (folder / path.name).write_text(text, encoding="utf-8", newline="\n")
        if output not in texts:
            write_log(folder / output.name, convert_channels(run))
    return output, card, truth

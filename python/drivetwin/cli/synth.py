# SPDX-License-Identifier: MIT
"""`drivetwin synth`: a log with known truth from the virtual dynamometer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivetwin.cli.atomic_outputs import write_atomically
from drivetwin.cli.output import JsonFlag, print_json, print_line, show_step
from drivetwin.cli.outputs import LOG_ENDINGS, Output
from drivetwin.dyno.names import ScenarioName
from drivetwin.vehicle.effects import EffectId

if TYPE_CHECKING:
    from drivetwin.dyno.dyno import DynoRun

ScenarioOption = Annotated[
    ScenarioName,
    typer.Option(
        metavar="NAME",
        help="paper: the paper's numbers at constant engine torque; paper_steps: the same with "
        "throttle steps; throttle_steps: a long, strongly modulated 2nd gear; gearbox: a whole "
        "gearbox with drums that have inertia; gearbox_chain: the same from 2nd to 4th gear; "
        "power_on_down, power_off_up, power_off_down: the other kinds of shift; input_gear: behind "
        "an input gear of 1.2; dual_clutch, manual: a car with such a gearbox; "
        "open_converter: behind an open torque converter; hydraulics: with the commands of the "
        "controller.",
    ),
]
SeedOption = Annotated[int, typer.Option(min=0, help="Seed of the sensor noise.")]
NoiseOption = Annotated[
    float, typer.Option(help="Factor on the sensor noise; 0: neither noise nor rounding.")
]


def synth(
    output: Annotated[
        Path,
        Output(endings=LOG_ENDINGS),
        typer.Option(
            "-o",
            "--output",
            metavar="NAME.csv",
            help="Log to write; the ending .csv, .mf4, .parquet or .mat sets the format.",
        ),
    ] = Path("synth.csv"),
    scenario: ScenarioOption = ScenarioName.PAPER_STEPS,
    model: Annotated[
        str | None,
        typer.Option(
            metavar="MODEL",
            help="Model file of 'drivetwin fit' with a manoeuvre, in place of a scenario: a file, "
            "or engine_start, tip_in, converter_lock_up.",
        ),
    ] = None,
    seed: SeedOption = 0,
    noise: NoiseOption = 1.0,
    torque_reduction: Annotated[
        float,
        typer.Option(help="Share by which the engine torque is reduced in the inertia phase."),
    ] = 0.0,
    drum: Annotated[
        float | None,
        typer.Option(
            metavar="KGM2",
            help="Inertia of each brake drum in the gearbox scenarios; default: 0.05.",
        ),
    ] = None,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=SIZE",
            help="Departure from the dual-clutch model, repeatable; units and shares are those of "
            f"docs/howto/synthetic-log.md: {', '.join(EffectId)}.",
        ),
    ] = None,
    as_json: JsonFlag = False,
) -> None:
    """Make a shift log with known truth on the virtual dynamometer.

    Also write the truth NAME.truth.json and the vehicle card NAME.card.toml. With a model the log
    is one of its driveline, and the model file NAME.model.toml has first guesses.
    """
    if model is not None:
        _write_model_log(output, model, seed, noise, as_json=as_json)
        return
    from drivetwin.dyno.dyno import run
    from drivetwin.dyno.effects import parse_effects
    from drivetwin.dyno.scenario_file import load_scenario

    with show_step(f"running {scenario}"):
        setup = load_scenario(scenario, drum).set_torque_reduction(torque_reduction)
        bench = run(setup, seed, noise=noise, effects=parse_effects(effect or []))
        log, card, truth = write_run(output, bench)
    if as_json:
        print_json({"log": log, "card": card, "truth": truth})
        return
    for name in (log, card, truth):
        print_line(f"wrote {name}")


def _write_model_log(output: Path, model: str, seed: int, noise: float, *, as_json: bool) -> None:
    """Write log, model file and truth of the manoeuvre of a model, all or none."""
    from drivetwin.errors import InputError, Where
    from drivetwin.fit.synthesize import find_model, synthesize_log

    if output.suffix.casefold() != ".csv":
        place = Where(file=str(output))
        raise InputError("the log of a model is a CSV file", "give a name that ends in .csv", place)
    with show_step(f"running {model}"):
        made = synthesize_log(*find_model(model), seed, noise)
    texts = {
        "log": (output, made.log),
        "model": (output.with_suffix(".model.toml"), made.model),
        "truth": (output.with_suffix(".truth.json"), made.truth),
    }
    with write_atomically(output.parent) as folder:
        for path, text in texts.values():
            (folder / path.name).write_text(text, encoding="utf-8", newline="\n")
    if as_json:
        print_json({key: path for key, (path, _) in texts.items()})
        return
    for path, _ in texts.values():
        print_line(f"wrote {path}")


def write_run(output: Path, run: DynoRun) -> tuple[Path, Path, Path]:
    """Write log, vehicle card and truth of a run, all or none; returns their paths.

    A CSV log is one table in which slow channels hold their value, as a data logger writes it; the
    other formats keep each channel's own time base.
    """
    from drivetwin.dyno.files import convert_channels, format_card, format_log, format_truth
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

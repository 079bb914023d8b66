# SPDX-License-Identifier: MIT
"""`drivetwin synth`: a log with known truth from the virtual dynamometer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivetwin.cli.output import JsonFlag, print_json, say, step
from drivetwin.cli.staging import staged
from drivetwin.dyno.names import ScenarioName

if TYPE_CHECKING:
    from drivetwin.dyno.dyno import DynoRun

ScenarioOption = Annotated[
    ScenarioName,
    typer.Option(
        help="paper: the paper's numbers at constant engine torque; paper_steps: the same with "
        "throttle steps; throttle_steps: a long, strongly modulated 2nd gear."
    ),
]
SeedOption = Annotated[int, typer.Option(min=0, help="Seed of the sensor noise.")]
NoiseOption = Annotated[
    float, typer.Option(help="Factor on the sensor noise; 0: no noise and no rounding.")
]


def synth(
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="NAME.csv", help="The log to write.")
    ] = Path("synth.csv"),
    scenario: ScenarioOption = ScenarioName.PAPER_STEPS,
    seed: SeedOption = 0,
    noise: NoiseOption = 1.0,
    torque_reduction: Annotated[
        float, typer.Option(help="Share of engine torque the TCU takes in the inertia phase.")
    ] = 0.0,
    as_json: JsonFlag = False,
) -> None:
    """Make a shift log with known truth on the virtual dynamometer.

    Beside the log NAME.csv stand NAME.truth.json and the vehicle card NAME.card.toml.
    """
    from dataclasses import replace

    from drivetwin.dyno.dyno import run
    from drivetwin.dyno.scenarios import SCENARIOS

    with step(f"running {scenario}"):
        setup = SCENARIOS[scenario]()
        reduction = replace(setup.reduction, fraction=torque_reduction)
        log, card, truth = write_run(
            output, run(replace(setup, reduction=reduction), seed, noise=noise)
        )
    if as_json:
        print_json({"log": log, "card": card, "truth": truth})
        return
    for name in (log, card, truth):
        say(f"wrote {name}")


def write_run(output: Path, run: DynoRun) -> tuple[Path, Path, Path]:
    """Write log, vehicle card and truth of a run, all or none; returns their paths."""
    from drivetwin.dyno.files import card_text, log_text, truth_text

    texts = {
        output: log_text(run),
        output.with_suffix(".card.toml"): card_text(run.scenario),
        output.with_suffix(".truth.json"): truth_text(run),
    }
    with staged(output.parent) as folder:
        for path, text in texts.items():
            (folder / path.name).write_text(text, encoding="utf-8", newline="\n")
    log, card, truth = texts
    return log, card, truth

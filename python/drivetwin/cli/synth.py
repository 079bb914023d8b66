# SPDX-License-Identifier: MIT
"""`drivetwin synth`: a log with known truth; `drivetwin demo`: identified and compared with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin._util.display_units import format_uncertainty, get_display_unit
from drivetwin.cli.identify import run_identification, write_outcome
from drivetwin.cli.options import REPORT
from drivetwin.cli.output import show_step, write_atomically, write_texts
from drivetwin.cli.requests.identification import Demonstrate, IdentifyOptions, Synthesize
from drivetwin.dyno import ScenarioName
from drivetwin.dyno.dyno import DynoRun
from drivetwin.dyno.dyno import run as run_dyno
from drivetwin.dyno.scenario_file import (
    convert_channels,
    format_card,
    format_log,
    format_truth,
    load_scenario,
)
from drivetwin.dyno.truth import Truth, parse_effects
from drivetwin.errors import InputError, Where
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.method import DEFAULT_METHOD, Method
from drivetwin.fit.synthesize import find_model, synthesize_log
from drivetwin.logs.write import write_log
from drivetwin.parameters import get_parameter_spec
from drivetwin.report.blocks import Column, Outcome, TableBlock, TextBlock, make_table
from drivetwin.tcu.synthesize import make_log


def synth(request: Synthesize) -> Outcome:
    """Write a log with its card or model and its truth."""
    is_text = request.model is not None or request.scenario is ScenarioName.CONTROLLER_LOG
    write = _write_text_log if is_text else _write_scenario_log
    with show_step(f"running {request.model or request.scenario}"):
        files = write(request)
    return Outcome(document=files, files=tuple(files.values()))


def _write_scenario_log(request: Synthesize) -> dict[str, Path]:
    """Write log, card and truth of a scenario, all or none; return their paths."""
    setup = load_scenario(request.scenario, request.drum)
    setup = setup.set_torque_reduction(request.torque_reduction)
    effects = parse_effects(request.effect)
    bench = run_dyno(setup, request.seed, noise=request.noise, effects=effects)
    log, card, truth = write_run(request.output, bench)
    return {"log": log, "card": card, "truth": truth}


def _write_text_log(request: Synthesize) -> dict[str, Path]:
    """Write the log of a model, or of a gearbox control, all or none; return the paths.

    Model file or card, and the truth, are beside it.
    """
    output, model = request.output, request.model
    if output.suffix.casefold() != ".csv":
        raise InputError(
            "this log is a CSV file", "give a name that ends in .csv", Where(file=str(output))
        )
    if model is not None:
        fitted = synthesize_log(*find_model(model), request.seed, request.noise)
        kind, texts = "model", (fitted.log, fitted.model, fitted.truth)
    else:
        request.refuse_stated(
            ("effect", "drum", "torque_reduction"), "the log of a gearbox control has no choice"
        )
        made = make_log(request.seed, noise=request.noise)
        kind, texts = "card", (made.log, made.card, made.truth)
    paths = (output, output.with_suffix(f".{kind}.toml"), output.with_suffix(".truth.json"))
    names = (one.name for one in paths)
    write_texts(output.parent, dict(zip(names, texts, strict=True)))
    return dict(zip(("log", kind, "truth"), paths, strict=True))


def write_run(output: Path, run: DynoRun) -> tuple[Path, Path, Path]:
    """Write log, vehicle card and truth of a run, all or none; returns their paths.

    A CSV log is one table in which slow channels hold their value, as a data logger writes it; the
    other formats keep each channel's own time base.
    """
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


Interval = tuple[float, float]

_EXACT = 1e-5
"""Relative half width below which a value is printed as exact."""


def format_estimate(
    value: float | None, interval: Interval | None, si_unit: str
) -> tuple[str, str, str]:
    """Value, `± half width` of its interval, and the unit they are in; a dash for None."""
    display = get_display_unit(si_unit)
    if value is None:
        return "–", "", display.label
    half = None if interval is None else (interval[1] - interval[0]) / 2.0 * display.factor
    if half is not None and half < _EXACT * abs(value * display.factor):
        half = None
    number, width = format_uncertainty(value * display.factor, half)
    return number, f"± {width}" if width else "", display.label


def format_deviation(value: float | None, truth: float) -> str:
    """Format the deviation from the true value in percent; empty if undefined."""
    return "" if value is None or truth == 0.0 else f"{100.0 * (value / truth - 1.0):+z.2f}"


_METHODS = (DEFAULT_METHOD, Method.PAPER)
_SLIPS = (10.0, 30.0, 50.0, 80.0)
"""Slips [rad/s] at which friction coefficients are compared."""


def demo(request: Demonstrate) -> Outcome:
    """Make a log, identify it by both methods, and compare with the truth."""
    scenario, output = request.scenario, request.output
    bench = run_dyno(load_scenario(scenario), request.seed, noise=request.noise)
    log, card, _ = write_run(output / f"{scenario}.csv", bench)
    outcomes = {
        method: run_identification([log], IdentifyOptions(vehicle=card, method=method))
        for method in _METHODS
    }
    for method, outcome in outcomes.items():
        write_outcome(outcome, output / method)
    found = {method: outcome.found for method, outcome in outcomes.items()}
    rows = _compare(bench.truth, found)
    report = output / DEFAULT_METHOD / REPORT
    note = "± is the half width of the 95 % interval; the paper's method states none for its grids."
    return Outcome(
        [_build_table(rows, scenario), TextBlock(note)],
        {"parameters": rows, "log": log, "report": report},
        lines=[f"log, card and truth: {log.parent}", f"report: {report}"],
    )


def _compare(truth: Truth, found: Mapping[Method, Identification]) -> list[dict[str, Any]]:
    """List all true parameters that some method estimates, then friction over slip.

    Each has the true value, the SI unit, and by method the value with its total 95 % interval.
    """
    rows: list[dict[str, Any]] = [
        {"id": key, "truth": value, "unit": get_parameter_spec(key).unit}
        | {method.value: _get_estimate(one, key) for method, one in found.items()}
        for key, value in truth.parameters.items()
        if any(key in one.estimates for one in found.values())
    ]
    for element, law in truth.friction.items():
        for slip in _SLIPS:
            points = {m.value: _get_friction(one, element, slip) for m, one in found.items()}
            if any(point["value"] is not None for point in points.values()):
                mu = float(law.evaluate(np.array(slip)))
                rows.append({"id": f"mu.{element} @{slip:g}", "truth": mu, "unit": "1"} | points)
    return rows


def _get_estimate(found: Identification, key: str) -> dict[str, Any]:
    one = found.estimates.get(key)
    return {"value": one and one.value, "ci95_total": one and one.ci95_total}


def _get_friction(found: Identification, element: str, slip: float) -> dict[str, Any]:
    """The curve of an element at one slip; nothing outside the slip range seen."""
    curve = found.friction.get(element)
    if curve is None or not curve.slip[0] <= slip <= curve.slip[-1]:
        return {"value": None, "ci95_total": None}
    mu, low, high = (
        float(np.interp(slip, curve.slip, values))
        for values in (curve.mu, curve.mu_lo, curve.mu_hi)
    )
    return {"value": mu, "ci95_total": (low, high) if np.isfinite(high - low) else None}


def _build_table(rows: list[dict[str, Any]], scenario: ScenarioName) -> TableBlock:
    """Truth, and value, interval and deviation of both methods."""
    lines = []
    for row in rows:
        truth, unit = row["truth"], row["unit"]
        paper, default = row[Method.PAPER.value], row[DEFAULT_METHOD.value]
        value, interval, shown = format_estimate(default["value"], default["ci95_total"], unit)
        lines.append(
            (
                *(row["id"], format_estimate(truth, None, unit)[0]),
                format_estimate(paper["value"], None, unit)[0],
                format_deviation(paper["value"], truth),
                *(value, interval, format_deviation(default["value"], truth), shown),
            )
        )
    numbers = ("truth", "paper", "off %", DEFAULT_METHOD.value, "± 95 %", "off %")
    columns: Sequence[Column] = ("parameter", *((name, "s") for name in numbers), "unit")
    return make_table(f"Scenario {scenario}: truth and estimates", columns, lines)

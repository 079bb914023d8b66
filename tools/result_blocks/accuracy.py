# SPDX-License-Identifier: MIT
"""Sections of docs/accuracy.md, from benchmarks/results/accuracy-*.json.

Raw results have a table `logs` with one row for each log and a table `values` with one row for
each of its values. A log has a seed and a kind; the error of a value (`apart`) is divided by its
stated standard deviation.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from tools.result_blocks.origin import Raw, read_rows, write_table

Row = Mapping[str, Any]
Z95, FAR = 1.96, 4.0
"""Half of a 95 % interval, and the error from which a value is far [standard deviations]."""
FAR_SHIFT = 80.0
"""Residual of the turbine speed of a predicted shift that is still small [rpm]."""
TWO = "two effects"
"""Kind of the logs of vehicles with two effects."""
HELD, LEAST = 0.93, 0.85
"""Wanted and least share of units below a promised peak jerk."""


def write_source(raw: Raw) -> str:
    """Write command, commit, seeds, machine and versions."""
    origin = raw["origin"]
    seeds, machine = origin["seeds"], origin["machine"]
    versions = ", ".join(f"{name} {one}" for name, one in origin["versions"].items())
    return (
        f"    {origin['command']}\n\nCode of commit {origin['commit']}, run by {origin['date']}; "
        f"{len(seeds)} seeds from {min(seeds)} to {max(seeds)}; {machine['cpu']}; {versions}.\n"
    )


def format_share(pairs: Iterable[tuple[int, int]]) -> str:
    """Format a share of values with its standard error; values of one log have common errors.

    `pairs` are the counted values and all values of each log.
    """
    known = list(pairs)
    part, whole = (sum(one[place] for one in known) for place in (0, 1))
    if not whole:
        return "–"
    share = part / whole
    error = math.sqrt(sum((one - share * of) ** 2 for one, of in known)) / whole
    return f"{part} of {whole}, {100 * share:.1f} ± {100 * error:.1f} %"


def count_inside(values: Iterable[Row]) -> str:
    """Format the share of values inside their 95 % interval."""
    logs: dict[Any, list[bool]] = {}
    for one in values:
        logs.setdefault(one["seed"], []).append(abs(one["apart"]) < Z95)
    return format_share((sum(held), len(held)) for held in logs.values())


def group(rows: Iterable[Row], key: str = "kind") -> dict[str, list[Row]]:
    """Group rows by a column."""
    groups: dict[str, list[Row]] = {}
    for one in rows:
        groups.setdefault(one[key], []).append(one)
    return groups


def _select(values: Iterable[Row], sort: str) -> list[Row]:
    return [one for one in values if one["sort"] == sort]


def write_groups(raw: Raw) -> str:
    """Write counts of identified and weak values by kind."""
    logs, values = group(read_rows(raw, "logs")), group(read_rows(raw, "values"))
    rows = [_count_group(name, own, values.get(name, [])) for name, own in logs.items()]
    if len(rows) > 1:
        every = [one for own in values.values() for one in own]
        rows.append(_count_group("all", read_rows(raw, "logs"), every))
    head = ("", "logs", "no result", "identified inside", "far", "weak inside", "kept")
    return write_table(head, rows)


def _count_group(name: str, logs: Sequence[Row], values: Sequence[Row]) -> Sequence[str]:
    identified = _select(values, "identified")
    found = group(identified, "seed")
    kept = format_share((len(found.get(one["seed"], [])), one["possible"]) for one in logs)
    failed = sum(bool(one["failure"]) for one in logs)
    far = sum(abs(one["apart"]) > FAR for one in identified)
    inside, weak = count_inside(identified), count_inside(_select(values, "weak"))
    return (name, str(len(logs)), str(failed), inside, str(far), weak, kept)


def write_sorts(raw: Raw) -> str:
    """Write counts of the other values by their sort."""
    sorts = group(read_rows(raw, "values"), "sort")
    rows = [
        (name, count_inside(own))
        for name, own in sorts.items()
        if name not in ("identified", "weak")
    ]
    return write_table(("", "inside"), rows)


def write_far(raw: Raw) -> str:
    """List identified values that are far, one row for a log."""
    logs: dict[Any, Row] = {one["seed"]: one for one in read_rows(raw, "logs")}
    logs |= {(one["seed"], one["kind"]): one for one in read_rows(raw, "logs")}
    far: dict[tuple[int, str], list[str]] = {}
    for one in _select(read_rows(raw, "values"), "identified"):
        if abs(one["apart"]) > FAR:
            errors = far.setdefault((one["seed"], one["kind"]), [])
            errors.append(f"{one['name']} {one['apart']:+.1f}")
    rows = []
    for (seed, kind), errors in far.items():
        log = logs.get((seed, kind), logs[seed])
        cells = (log.get("detail", ""), log["status"], ", ".join(errors))
        rows.append((str(seed), kind, *cells))
    head = ("seed", "", "departure", "status", "far values, in standard deviations")
    return write_table(head, rows) if rows else "No identified value is far.\n"


def write_statuses(raw: Raw) -> str:
    """Write the number of logs by status, and messages of logs without result."""
    logs = read_rows(raw, "logs")
    counts = {name: len(own) for name, own in group(logs, "status").items()}
    text = "Statuses: " + ", ".join(f"{name} {count}" for name, count in counts.items()) + ".\n"
    failed = [one for one in logs if one["failure"]]
    return text + "".join(f"Seed {one['seed']}: {one['failure']}\n" for one in failed)


def write_causes(raw: Raw) -> str:
    """Write how often causes are named, rightly and falsely."""
    logs = read_rows(raw, "logs")
    departing = [one for one in logs if one["kind"] not in ("none", TWO)]
    obeying = [one for one in logs if one["kind"] == "none"]
    cases = {
        "a cause is named": [one for one in departing if one["evident"]],
        "the effect moves a value by over 2 deviations": [one for one in departing if one["moved"]],
        "and its own evidence suffices to name it": [one for one in departing if one["visible"]],
    }
    rows = [(name, f"{sum(x['right'] for x in own)} of {len(own)}") for name, own in cases.items()]
    false = sum(one["evident"] for one in obeying)
    certain = sum(one["overconfident"] for one in logs)
    rows.append(("obeying logs with a cause (false alarms)", f"{false} of {len(obeying)}"))
    rows.append(("causes called certain at Q per sample above 1.2", f"{certain} of {len(logs)}"))
    return write_table(("departing logs in which", "right cause"), rows)


def write_fits(raw: Raw) -> str:
    """Write minima, errors over bounds and coverage by kind."""
    values, rows = group(read_rows(raw, "values")), []
    for name, logs in group(read_rows(raw, "logs")).items():
        own = values.get(name, [])
        ratios = _compute_ratios(own)
        shown = ("–", "–")
        if ratios:
            pooled = math.sqrt(statistics.fmean(one**2 for one in ratios.values()))
            shown = (f"{pooled:.2f}", f"{max(ratios.values()):.2f}")
        right = sum(one["right"] for one in logs)
        seconds = statistics.median(one["seconds"] for one in logs)
        cells = (f"{right} of {len(logs)}", str(len(group(own, "name"))), *shown)
        far = [one for one in own if one["sort"] == "identified" and abs(one["apart"]) > FAR]
        rows.append((name, *cells, count_inside(own), str(len(far)), f"{seconds:.2g}"))
    inside = count_inside(one for own in values.values() for one in own)
    rows.append(("all", "", "", "", "", inside, "", ""))
    head = ("", "right", "unknowns", "RMSE/bound", "largest", "inside", "far", "CPU, median, s")
    return write_table(head, rows)


def _compute_ratios(values: Sequence[Row]) -> dict[str, float]:
    """Compute RMSE over bound by unknown, of values in right minima that have a bound."""
    errors = group((one for one in values if one["ratio"] is not None), "name")
    return {
        name: math.sqrt(statistics.fmean(one["ratio"] ** 2 for one in own))
        for name, own in errors.items()
    }


def write_parameters(raw: Raw) -> str:
    """Write bound, RMSE over bound and coverage by unknown and kind."""
    bounds = group(read_rows(raw, "bounds"), "name")
    values = group(read_rows(raw, "values"))
    ratios = {kind: _compute_ratios(own) for kind, own in values.items()}
    rows = []
    for name, own in bounds.items():
        by_kind = {one["kind"]: one for one in own}
        cells = [
            f"{by_kind[kind]['bound']:.3g} {by_kind[kind]['unit']}; {ratios[kind][name]:.2f}"
            if kind in by_kind and name in ratios[kind]
            else "–"
            for kind in values
        ]
        rows.append((name, *cells))
    return write_table(("bound; RMSE over it", *values), rows)


def write_quantities(raw: Raw) -> str:
    """Write coverage, mean and spread of errors over deviations by quantity."""
    groups, rows = group(read_rows(raw, "values")), []
    every = [one for own in groups.values() for one in own]
    for name, own in [*groups.items(), ("all", every)]:
        apart = [one["apart"] for one in own]
        known = _select(own, "identified")
        far = sum(abs(one["apart"]) > FAR for one in known)
        spread = statistics.pstdev(apart)
        mean = f"{statistics.fmean(apart):+.2f} ± {spread / math.sqrt(len(apart)):.2f}"
        width = f"{100 * statistics.median(one['width'] for one in own):.2g} %"
        held = {seed: max(abs(x["apart"]) for x in one) for seed, one in group(own, "seed").items()}
        whole = f"{sum(one < Z95 for one in held.values())} of {len(held)}"
        cells = (whole, str(len(known)), str(far), mean, f"{spread:.2f}", width)
        rows.append((name, count_inside(own), *cells))
    head = (
        "",
        "inside",
        "logs with all inside",
        "identified",
        "far",
        "mean error",
        "spread",
        "median ±",
    )
    return write_table(head, rows)


def write_peers(raw: Raw) -> str:
    """Write errors of a mean of single decays by SciPy beside those of the product."""
    rows = []
    for name, own in group(read_rows(raw, "values")).items():
        both = [one for one in own if one["peer_error"] is not None]
        if both:
            peer = [{**one, "apart": one["peer_apart"]} for one in both]
            cells = (_format_rms(both, "error"), count_inside(both))
            rows.append((name, *cells, _format_rms(both, "peer_error"), count_inside(peer)))
    return write_table(("", "rms error", "inside", "SciPy: rms error", "inside"), rows)


def _format_rms(rows: Sequence[Row], column: str) -> str:
    return f"{100 * math.sqrt(statistics.fmean(one[column] ** 2 for one in rows)):.2g} %"


def write_shifts(raw: Raw) -> str:
    """Write how well shifts that were held out are predicted."""
    shifts, logs = read_rows(raw, "shifts"), read_rows(raw, "logs")
    share = statistics.median(abs(one["error"]) / one["duration"] for one in shifts)
    rms = statistics.median(one["rms"] for one in shifts)
    seconds = statistics.median(one["seconds"] for one in logs)
    held = {
        f"turbine speed, rms of at most {FAR_SHIFT:g} rpm": [
            (one["rms"] <= FAR_SHIFT, 1) for one in shifts
        ],
        "duration of the slip within 10 %": [
            (abs(one["error"]) < 0.1 * one["duration"], 1) for one in shifts
        ],
        "durations inside their band": [(abs(one["error"]) <= one["band"], 1) for one in shifts],
        **{
            f"rows inside the 95 % band, {name} speed": [
                (round(one["rows"] * one[name]), one["rows"]) for one in shifts
            ]
            for name in ("engine", "turbine", "output")
        },
    }
    rows = [
        ("turbine speed, rms, median", f"{rms:.1f} rpm"),
        ("duration of the slip, median error", f"{100 * share:.1f} %"),
        *((name, _format_by_log(shifts, pairs)) for name, pairs in held.items()),
        ("CPU for a log of 20 shifts, median", f"{seconds:.0f} s"),
    ]
    return write_table((f"{len(shifts)} held-out shifts of {len(logs)} logs", ""), rows)


def _format_by_log(rows: Sequence[Row], pairs: Sequence[tuple[int, int]]) -> str:
    """Format a share whose counts are given by row."""
    logs: dict[int, list[tuple[int, int]]] = {}
    for one, pair in zip(rows, pairs, strict=True):
        logs.setdefault(one["seed"], []).append(pair)
    return format_share((sum(a for a, _ in own), sum(b for _, b in own)) for own in logs.values())


def write_promises(raw: Raw) -> str:
    """Write promised peak jerk against that of true units."""
    logs = read_rows(raw, "logs")
    tried = [one for one in logs if not one["failure"]]
    held = sum(one["share"] >= HELD for one in tried)
    low = sum(one["share"] < LEAST for one in tried)
    above = [one["promised"] / one["true"] for one in tried]
    shares = [one["share"] for one in tried]
    error = statistics.stdev(shares) / math.sqrt(len(shares))
    rows = [
        (
            f"vehicles with at least {100 * HELD:.0f} % of the units below",
            f"{held} of {len(tried)}",
        ),
        (f"vehicles with less than {100 * LEAST:.0f} %", f"{low} of {len(tried)}"),
        ("units below, mean", f"{100 * statistics.fmean(shares):.1f} ± {100 * error:.1f} %"),
        ("promise over true 95 % value, median", f"{statistics.median(above):.2f}"),
        ("from, to", f"{min(above):.2f}, {max(above):.2f}"),
        ("refused twins", str(len(logs) - len(tried))),
    ]
    hot = [one["true"] / one["usual"] for one in tried if one["true"] != one["usual"]]
    if hot:
        rows.append(("hot oil over oil of the log, median", f"{statistics.median(hot):.3f}"))
    low_rows = [
        f"Vehicle {one['seed']} ({one['detail'] or 'obeying'}): {100 * one['share']:.1f} % below.\n"
        for one in tried
        if one["share"] < HELD
    ]
    return write_table(("", ""), rows) + "\n" * bool(low_rows) + "".join(low_rows)


Sections = dict[str, Callable[[Raw], str]]
_LOGS: Sections = {"source": write_source, "groups": write_groups, "far": write_far}
BLOCKS: dict[str, Sections] = {
    "accuracy-cases": {
        "source": write_source, "fits": write_fits, "parameters": write_parameters,
    },
    "accuracy-validity": {**_LOGS, "causes": write_causes},
    "accuracy-rough": {**_LOGS, "sorts": write_sorts, "statuses": write_statuses},
    "accuracy-fit": {"source": write_source, "fits": write_fits, "far": write_far},
    "accuracy-fit-mismatch": {"source": write_source, "fits": write_fits, "far": write_far},
    "accuracy-bus": {
        "source": write_source, "quantities": write_quantities, "peers": write_peers,
        "far": write_far,
    },
    "accuracy-tcu": {
        "source": write_source, "shifts": write_shifts, "quantities": write_quantities,
        "statuses": write_statuses, "far": write_far,
    },
    "accuracy-actuator": {"source": write_source, "quantities": write_quantities},
    "accuracy-promise": {"source": write_source, "promises": write_promises},
}  # fmt: skip
"""Sections by raw results."""

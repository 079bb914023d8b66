# SPDX-License-Identifier: MIT
"""Estimates of one parameter over a fleet, with the facts of each log and what is left out."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.estimation.result.estimate import Verdict
from drivetwin.fleet.mixed import FloatArray, JointEstimate, Outlier
from drivetwin.fleet.store import ONE_FILE_EACH, Store
from drivetwin.fleet.task import RowKind

_FIT = "output_torque.all.fit_percent"
_WORST = 0.02
"""Share of the fleet with the poorest fits, in which a fit is a reason."""


def attach_reasons(store: Store, found: Sequence[JointEstimate]) -> list[JointEstimate]:
    """The estimates with a reason at each outlier: its distance, other parameters that are out
    too, a poor fit of the simulation, and the log's own warnings.
    """
    if not any(one.outliers for one in found):
        return list(found)
    also: dict[str, list[str]] = {}
    for one in found:
        for outlier in one.outliers:
            also.setdefault(outlier.log, []).append(one.parameter)
    fits = collect_output_fits(store)
    warnings = _collect_warnings(store, also)

    def add_reason(one: JointEstimate, outlier: Outlier) -> Outlier:
        others = [name for name in also[outlier.log] if name != one.parameter]
        side = "above" if outlier.score > 0.0 else "below"
        parts = [
            f"{abs(outlier.score):.1f} standard deviations {side} the value expected for unit "
            f"{outlier.unit}"
        ]
        if others:
            parts.append(f"so are its {', '.join(others)}")
        if poor := _describe_poor_fit(fits, outlier.log):
            parts.append(poor)
        parts += warnings.get(outlier.log, [])[:2]
        return replace(outlier, reason="; ".join(parts))

    return [
        replace(one, outliers=tuple(add_reason(one, outlier) for outlier in one.outliers))
        for one in found
    ]


def collect_output_fits(store: Store) -> dict[str, float]:
    """Return the fit of the output torque [%] by log, for the logs that have one."""
    import pyarrow.compute as pc

    rows = store.read_rows(RowKind.FIT)
    picked = rows.filter(pc.equal(rows.column("name"), _FIT)).to_pydict()
    pairs = zip(picked["log"], picked["value"], strict=True)
    return {log: value for log, value in pairs if value is not None}


def _describe_poor_fit(fits: dict[str, float], log: str) -> str:
    """Words for a fit that is among the poorest of the fleet; empty for another."""
    if log not in fits:
        return ""
    every = np.array(list(fits.values()))
    if fits[log] >= float(np.quantile(every, _WORST)):
        return ""
    middle = float(np.median(every))
    return (
        f"the simulation fits its output torque to {fits[log]:.1f} %, the fleet's to {middle:.1f} %"
    )


def _collect_warnings(store: Store, wanted: dict[str, list[str]]) -> dict[str, list[str]]:
    rows = store.read_rows(RowKind.WARNING).select(["log", "reason"]).to_pydict()
    found: dict[str, list[str]] = {}
    for log, text in zip(rows["log"], rows["reason"], strict=True):
        if log in wanted:
            found.setdefault(log, []).append(text)
    return found


@dataclass(frozen=True)
class LogFacts:
    """Facts of a log: a file of it, its unit and its fields.

    The fields include the channel means. The settings hash is that of the identification.
    """

    path: str
    unit: str
    fields: Mapping[str, float]
    settings: str = ""


@dataclass(frozen=True, eq=False)
class Observed:
    """One parameter of the vehicles that one rule reads: `value` (n,) and `std` (n,) by log.

    The values exclude design priors. `left_out` counts the logs without a value.
    """

    parameter: str
    rule: str
    logs: tuple[str, ...]
    value: FloatArray
    std: FloatArray
    left_out: int


def collect_facts(store: Store) -> dict[str, tuple[str, LogFacts]]:
    """Rule and facts of each log as its file was seen last; a log at several places once."""
    means: dict[str, dict[str, float]] = {}
    columns = store.read_rows(RowKind.FIELD).select(["log", "name", "value"]).to_pydict()
    for log, name, value in zip(columns["log"], columns["name"], columns["value"], strict=True):
        means.setdefault(log, {})[name] = value
    found: dict[str, tuple[str, LogFacts]] = {}
    sql = (
        "SELECT log, path, rule, unit, fields, settings FROM files JOIN logs USING (log) "
        f"WHERE {ONE_FILE_EACH}"
    )
    for log, path, rule, unit, fields, settings in store.index.select(sql):
        known = {**json.loads(fields), **means.get(log, {})}
        found[log] = (rule, LogFacts(path, unit, known, settings))
    return found


def collect_observations(store: Store, known: Mapping[str, tuple[str, LogFacts]]) -> list[Observed]:
    """All parameters with a value in some log, by rule, in the order of the first log.

    Fixed values of the card are omitted, because they contain no data of the fleet. Without any
    stated error, as the paper's method leaves it, all logs count alike.
    """
    import pyarrow.compute as pc

    rows = store.read_rows(RowKind.PARAMETER)
    found = []
    for name in dict.fromkeys(rows.column("name").to_pylist()):
        columns = rows.filter(pc.equal(rows.column("name"), name)).to_pydict()
        for rule in sorted({known[log][0] for log in columns["log"] if log in known}):
            one = _collect_parameter(name, rule, columns, known)
            if one.value.size:
                found.append(one)
    return found


def _collect_parameter(
    name: str,
    rule: str,
    columns: Mapping[str, list[object]],
    known: Mapping[str, tuple[str, LogFacts]],
) -> Observed:
    logs, values, stds, left_out = [], [], [], 0
    picked = ("log", "value", "std_noise", "std_total", "free_value", "free_std", "verdict")
    for log, value, noise, total, free, free_std, verdict in zip(
        *(columns[key] for key in picked), strict=True
    ):
        if log not in known or known[str(log)][0] != rule:
            continue
        own, std = (value, noise or total) if free is None else (free, free_std)
        if own is None or (free is None and verdict == Verdict.DESIGN):
            left_out += 1
            continue
        logs.append(str(log))
        values.append(own)
        stds.append(std)
    numbers = np.array(values, dtype=float)
    errors = np.array(stds, dtype=float)
    return Observed(
        name, rule, tuple(logs), numbers, _fill_missing_errors(numbers, errors), left_out
    )


def _fill_missing_errors(values: FloatArray, errors: FloatArray) -> FloatArray:
    """Errors (n,) with those that are not stated put in: the middle of the others, or the scatter
    of the values.
    """
    stated = np.isfinite(errors) & (errors > 0.0)
    if stated.any():
        typical = float(np.median(errors[stated]))
    else:
        scatter = (
            1.4826 * float(np.median(np.abs(values - np.median(values)))) if len(values) else 0
        )
        typical = scatter or 1.0
    return np.where(stated, errors, typical)

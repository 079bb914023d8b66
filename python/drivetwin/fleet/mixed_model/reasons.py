# SPDX-License-Identifier: MIT
"""Explanations of outlying logs: other unusual properties of the same log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivetwin.fleet.mixed_model.result import JointEstimate, Outlier
from drivetwin.fleet.rows import RowKind
from drivetwin.fleet.store import Store

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
        parts = [
            f"{abs(outlier.score):.1f} standard deviations {_describe_side(outlier)} the value "
            f"expected for unit {outlier.unit}"
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


def _describe_side(outlier: Outlier) -> str:
    return "above" if outlier.score > 0.0 else "below"


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

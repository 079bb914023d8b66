# SPDX-License-Identifier: MIT
"""Zoom of a figure over time: the view that was chosen, and the samples in it."""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import Display
from drivetwin.report.figures.stack import Curve, Panel, decimate_around


def parse_number(value: object) -> float | None:
    """Return a finite number; None for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


View = tuple[float, float]
"""First and last time [s] of a figure."""
_TIME_RESOLUTION = 5e-5
"""Largest step between the times that are sent [s]."""
_VALUE_RESOLUTION = 1e-4
"""Largest step between the values that are sent, over their range."""


def parse_view(change: Mapping[str, object]) -> View | None:
    """Return the time window of a relayout event [s]; None if the window did not change."""
    both = change.get("xaxis.range")
    ends = both if isinstance(both, list) else [change.get(f"xaxis.range[{k}]") for k in (0, 1)]
    numbers = [number for one in ends if (number := parse_number(one)) is not None]
    if len(numbers) != 2 or numbers[0] >= numbers[1]:
        return None
    return numbers[0], numbers[1]


def collect_curves(panels: Sequence[Panel], view: View) -> dict[int, dict[str, Any]]:
    """Collect x and y of every trace of stacked panels, fine in `view`, by trace index."""
    pairs = ((panel.display, curve) for panel in panels for curve in panel.curves)
    return encode_curves(enumerate(pairs), view)


def encode_curves(
    curves: Iterable[tuple[int, tuple[Display, Curve]]], view: View
) -> dict[int, dict[str, Any]]:
    """Encode curves by trace index.

    They are packed (`dtype`, `bdata` in base64), as formatting digits would take half of the time.
    """
    found = {}
    for place, (display, curve) in curves:
        time, recorded = decimate_around(curve.time, curve.values, view)
        values = display.to_display(recorded)
        known = values[np.isfinite(values)]
        span = np.ptp(known) if known.size else 0.0
        found[place] = {
            "x": _encode(time, _TIME_RESOLUTION),
            "y": _encode(values, _VALUE_RESOLUTION * span),
        }
    return found


def _encode(values: FloatArray, resolution: float) -> dict[str, str]:
    """Encode an array as plotly.js reads it without a number being spelled out.

    Single precision is used where its steps are at most the `resolution`.
    """
    largest = np.abs(values).max(initial=0.0, where=np.isfinite(values))
    is_single = np.spacing(np.float32(largest)) <= resolution
    kind = "f4" if is_single else "f8"
    packed = base64.b64encode(values.astype(f"<{kind}").tobytes()).decode()
    return {"dtype": kind, "bdata": packed}

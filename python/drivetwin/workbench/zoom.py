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
from drivetwin.report.decimate import decimate_around
from drivetwin.report.figures.stack import Curve, Panel

View = tuple[float, float]
"""First and last time [s] of a figure."""
_FINE = 500.0
"""Magnitude below which single precision is enough for a time [s] or a value."""


def parse_view(change: Mapping[str, object]) -> View | None:
    """Return the time window of a relayout event [s]; None if the window did not change."""
    both = change.get("xaxis.range")
    ends = both if isinstance(both, list) else [change.get(f"xaxis.range[{k}]") for k in (0, 1)]
    numbers = [float(one) for one in ends if isinstance(one, int | float)]
    if len(numbers) != 2 or not all(map(math.isfinite, numbers)) or numbers[0] >= numbers[1]:
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
        time, values = decimate_around(curve.time, curve.values, view)
        found[place] = {"x": _encode(time), "y": _encode(display.to_display(values), "<f4")}
    return found


def _encode(values: FloatArray, kind: str = "") -> dict[str, str]:
    """Encode an array as plotly.js reads it without a number being spelled out."""
    kind = kind or ("<f4" if np.abs(values).max(initial=0.0) < _FINE else "<f8")
    packed = base64.b64encode(values.astype(kind).tobytes()).decode()
    return {"dtype": kind[1:], "bdata": packed}

# SPDX-License-Identifier: MIT
"""All samples of the time figures of a page, each array once, small enough for one file.

An array becomes whole numbers of a step, their differences with the sign in the lowest bit, the
low and the high bytes of these apart, and all of that gzip. The step of values is a sixteenth of
their own noise, or 2⁻¹⁶ of their span where they have less noise than that: no eye and no zoom sees
it. Times on an even grid are three numbers. The script of the page, `templates/report.js`, reads
it back.
"""

from __future__ import annotations

import base64
import gzip
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from drivetwin._util.arrays import FloatArray

NOISE_PARTS = 16.0
SPAN_PARTS = 65536.0
_COMPRESSION = 5
"""Level of gzip: the highest takes twice the time for one part in a hundred."""
EVEN = 0.01
"""Largest deviation of a time from an even grid, as a share of its step."""


@dataclass
class Store:
    """Numbered arrays without duplicates; `index` describes the encoding of each in the bytes."""

    index: list[dict[str, Any]] = field(default_factory=list)
    _bytes: list[bytes] = field(default_factory=list)
    _known: dict[bytes, int] = field(default_factory=dict)

    def add_time(self, time: FloatArray) -> int:
        """Number of a time base (n,), increasing [s]."""
        return self._add(time, _choose_time_step(time), even=_is_even(time))

    def add_values(self, values: FloatArray) -> int:
        """Number of an array (n,); samples that are not finite are gaps."""
        return self._add(values, _choose_value_step(values), even=False)

    def encode(self) -> str:
        """All bytes as base64 of gzip; equal stores give equal texts."""
        return encode_content(b"".join(self._bytes))

    def _add(self, values: FloatArray, step: float, *, even: bool) -> int:
        key = values.tobytes() + bytes([even])
        if key in self._known:
            return self._known[key]
        entry: dict[str, Any] = {"count": int(values.size)}
        if even:
            first, last = float(values[0]), float(values[-1])
            entry |= {"start": first, "step": (last - first) / max(values.size - 1, 1)}
        elif values.size:
            entry |= self._encode_values(values, step)
        self.index.append(entry)
        self._known[key] = len(self.index) - 1
        return self._known[key]

    def _encode_values(self, values: FloatArray, step: float) -> dict[str, Any]:
        """Append the differences of whole steps; what it takes to undo that."""
        finite = np.isfinite(values)
        start = float(values[finite][0]) if finite.any() else 0.0
        codes = np.round((_fill_gaps(values, finite, start) - start) / step).astype(np.int64)
        change = np.diff(codes, prepend=0)
        folded = np.where(change < 0, -2 * change - 1, 2 * change)
        width = 2 if int(folded.max()) < 1 << 16 else 4
        planes = folded.astype(f"<u{width}").view(np.uint8)
        self._bytes.append(planes.reshape(-1, width).T.tobytes())
        return {"start": start, "step": step, "width": width, "gaps": _find_gaps(finite)}


def encode_content(content: bytes) -> str:
    """Base64 of gzip; equal contents give equal texts."""
    packed = gzip.compress(content, _COMPRESSION, mtime=0)
    return base64.b64encode(packed).decode("ascii")


def _fill_gaps(values: FloatArray, finite: np.typing.NDArray[np.bool_], start: float) -> FloatArray:
    """The array with each gap held at the sample before it."""
    last = np.maximum.accumulate(np.where(finite, np.arange(values.size), -1))
    return np.where(last >= 0, values[np.maximum(last, 0)], start)


def _find_gaps(finite: np.typing.NDArray[np.bool_]) -> list[list[int]]:
    """First and one past the last index of each stretch without a sample."""
    edges = np.flatnonzero(np.diff(np.concatenate(([True], finite, [True])).astype(np.int8)))
    return [[int(first), int(last)] for first, last in edges.reshape(-1, 2)]


def _is_even(time: FloatArray) -> bool:
    if time.size < 3:
        return False
    grid = np.linspace(time[0], time[-1], time.size)
    return bool(np.abs(time - grid).max() <= EVEN * (grid[1] - grid[0]))


def _choose_time_step(time: FloatArray) -> float:
    return EVEN * float(np.median(np.diff(time))) if time.size > 1 else 1.0


def _choose_value_step(values: FloatArray) -> float:
    """Rounding that is small against the noise of the samples, and never below what float32 has."""
    known = values[np.isfinite(values)]
    span = float(np.ptp(known)) if known.size else 0.0
    if known.size < 4 or span / SPAN_PARTS == 0.0:  # of subnormal numbers the quotient is zero too
        return max(span / SPAN_PARTS, 1e-12)
    noise = float(np.median(np.abs(np.diff(known, 2)))) / (0.6745 * np.sqrt(6.0))
    return float(max(noise / NOISE_PARTS, span / SPAN_PARTS))

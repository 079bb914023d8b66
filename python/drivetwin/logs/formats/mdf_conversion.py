# SPDX-License-Identifier: MIT
"""Conversions of MDF 3 and 4: raw samples to float64, then to physical values.

asammdf computes in the type of the raw samples: integers overflow, float16 loses digits, and value
ranges of integers are open at their end. It is used here for the parsed conversion alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.optional_dependencies import import_extra
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.logs.formats.cell_text import describe_faults, interpret_codes, parse_numbers

_LISTED = 8
"""Largest number of texts of a table that are listed."""

_FORMULA3, _TABLES3 = 10, (11, 12)
"""Kinds of conversions of MDF 3: a formula; a table of texts, or of ranges with texts."""

_TABLES = (7, 8)
"""Kinds of conversions of MDF 4: from values to texts, from ranges to texts."""

_TEXT_TO_TEXT, _BITS = (9, 10), 11
"""Kinds of MDF 4: from texts, to numbers or texts; bits with a text each."""


class ConversionError(ValueError):
    """A conversion that cannot be evaluated; the text is the cause."""


@dataclass(frozen=True, eq=False)
class Converted:
    """Physical values (n,), NaN without one; `left_out` (n,) marks faults, None: there are none."""

    values: FloatArray
    left_out: NDArray[np.bool_] | None = None
    notes: tuple[str, ...] = ()


def convert_samples(raw: NDArray[Any], conversion: Any, path: Path) -> Converted:
    """Convert the raw numbers (n,) of a channel by a conversion of asammdf, None without any.

    A fault is no sample, and another text among numbers is NaN. Texts that are numbers are the
    values. If no text is a number, the codes are, and a note lists the texts. Raises
    ConversionError, and MissingExtraError for a formula without numexpr.
    """
    if conversion is None or (_is_version4(conversion) and conversion.conversion_type == _BITS):
        return Converted(np.asarray(raw, np.float64))
    if not _has_texts(conversion):
        return Converted(convert_numbers(raw, conversion, path))
    known, place, counts = np.unique(raw, return_inverse=True, return_counts=True)
    looked = look_up_codes(conversion, known, path)
    return _choose_values(looked, known, place, counts, conversion)


def convert_texts(texts: NDArray[Any], samples: NDArray[Any]) -> Converted | None:
    """Convert `samples` (n,) of a channel that records `texts` (n,); None without a number.

    Samples that are numbers come from a table of the file; else the texts are the numbers.
    """
    listed, place, counts = np.unique(texts, return_inverse=True, return_counts=True)
    names = [decode_text(one) for one in listed.tolist()]
    found = interpret_codes(names, np.full(len(names), np.nan))
    values = samples.astype(np.float64) if samples.dtype.kind in "iufb" else None
    if values is None and not found.chosen:
        return None
    notes = [describe_faults(names, np.where(found.faults, counts, 0).tolist(), texts.size)]
    notes.append(found.note if values is None else "")
    return Converted(
        found.values[place] if values is None else values,
        found.faults[place],
        tuple(filter(None, notes)),
    )


@dataclass(frozen=True, eq=False)
class LookedUp:
    """Text of each code (k,), None for a number, and the number (k,), NaN for a text."""

    texts: list[str | None]
    numbers: FloatArray
    is_text: NDArray[np.bool_] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "is_text", np.array([one is not None for one in self.texts], bool))


def _choose_values(
    looked: LookedUp, known: NDArray[Any], place: Any, counts: Any, conversion: Any
) -> Converted:
    """Return the value of each sample by the `looked` up meaning of the `known` codes."""
    named = np.flatnonzero(looked.is_text)
    texts = [looked.texts[index] or "" for index in named.tolist()]
    found = interpret_codes(texts, known[named].astype(np.float64))
    values, note = looked.numbers.copy(), found.note
    if _has_numbers(conversion):
        values[named] = np.where(found.faults, np.nan, parse_numbers(texts))
        note = ""
    elif not found.chosen:
        note = _describe_codes(conversion)
        values[named] = found.values
    else:
        values[named] = found.values
    faults = np.zeros(known.size, np.bool_)
    faults[named] = found.faults
    lost = np.where(found.faults, counts[named], 0).tolist()
    notes = (note, describe_faults(texts, lost, int(counts.sum())))
    return Converted(values[place], faults[place], tuple(filter(None, notes)))


def convert_numbers(raw: NDArray[Any], conversion: Any, path: Path) -> FloatArray:
    """Return the physical values (n,) by a conversion without texts, None for none."""
    values = np.asarray(raw, np.float64)
    if conversion is None:
        return values
    if formula := getattr(conversion, "formula", ""):
        return _evaluate_formula(formula, values, path)
    with np.errstate(all="ignore"):
        if not _is_version4(conversion):
            return np.asarray(conversion.convert(values), np.float64)
        kind = int(conversion.conversion_type)
        if kind not in _NUMERIC:
            raise ConversionError(f"its conversion is of kind {kind}, which is none of numbers")
        return _NUMERIC[kind](values, conversion, raw.dtype.kind != "f")


def scale_linear(values: FloatArray, scale: float, shift: float) -> FloatArray:
    """Return `scale` times the values (n,) plus `shift`."""
    return values if (scale, shift) == (1.0, 0.0) else values * scale + shift


def _convert_linear(values: FloatArray, conversion: Any, _: bool) -> FloatArray:
    return scale_linear(values, float(conversion.a), float(conversion.b))


def _convert_rational(values: FloatArray, conversion: Any, _: bool) -> FloatArray:
    p = [float(getattr(conversion, f"P{number}")) for number in range(1, 7)]
    above = (p[0] * values + p[1]) * values + p[2]
    below = (p[3] * values + p[4]) * values + p[5]
    result: FloatArray = above / below
    return result


def _read_table(conversion: Any) -> tuple[FloatArray, FloatArray]:
    count = int(conversion.val_param_nr) // 2
    keys, values = (
        np.array([getattr(conversion, f"{name}_{index}") for index in range(count)], np.float64)
        for name in ("raw", "phys")
    )
    if not count or not np.all(np.diff(keys) > 0.0):
        raise ConversionError("the keys of its conversion table do not increase")
    return keys, values


def _interpolate(values: FloatArray, conversion: Any, _: bool) -> FloatArray:
    return np.asarray(np.interp(values, *_read_table(conversion)))


def _take_nearest(values: FloatArray, conversion: Any, _: bool) -> FloatArray:
    """Values of the nearest keys; of two keys as near, the lower one's."""
    keys, physical = _read_table(conversion)
    upper = np.searchsorted(keys, values).clip(1, max(keys.size - 1, 1))
    lower, upper = upper - 1, upper.clip(max=keys.size - 1)
    nearest = np.where(values - keys[lower] <= keys[upper] - values, lower, upper)
    return np.where(np.isnan(values), np.nan, physical[nearest])


def _convert_ranges(values: FloatArray, conversion: Any, is_integer: bool) -> FloatArray:
    """Values of the first range that holds a number; the default without any."""
    count = int(conversion.val_param_nr)
    result = np.full(values.shape, conversion.default if count % 3 == 1 else np.nan, np.float64)
    free = np.ones(values.shape, np.bool_)
    for index in range(count // 3):
        low, high, physical = (
            getattr(conversion, f"{name}_{index}") for name in ("lower", "upper", "phys")
        )
        inside = free & _is_inside(values, low, high, is_integer)
        result[inside] = physical
        free &= ~inside
    return result


def _is_inside(values: NDArray[Any], low: float, high: float, is_integer: bool) -> Any:
    """Ranges of integers include their end, those of other numbers do not."""
    below = values <= high if is_integer else (values < high) | (values == low)
    return (values >= low) & below


_NUMERIC: dict[int, Callable[[FloatArray, Any, bool], FloatArray]] = {
    0: lambda values, _, __: values,
    1: _convert_linear,
    2: _convert_rational,
    4: _interpolate,
    5: _take_nearest,
    6: _convert_ranges,
}
"""Functions by the kind of a conversion of MDF 4."""


def _evaluate_formula(formula: str, values: FloatArray, path: Path) -> FloatArray:
    """Return the values (n,) of a formula over the raw ones `X`, also named `X1`."""
    numexpr = import_extra("numexpr", "mdf", "an MDF file", path)
    try:
        names = {"X": values, "X1": values, "INF": np.inf, "NaN": np.nan}
        found = numexpr.evaluate(formula, names, {}, sanitize=True)
        return np.broadcast_to(np.asarray(found, np.float64), values.shape)
    except Exception:
        raise ConversionError(f"its formula {formula!r} is none that can be evaluated") from None


def _is_version4(conversion: Any) -> bool:
    return hasattr(conversion, "val_param_nr")


def _has_texts(conversion: Any) -> bool:
    """Return True if a conversion gives texts for codes."""
    kind = conversion.conversion_type
    return kind in (_TABLES if _is_version4(conversion) else _TABLES3)


def _list_blocks(conversion: Any) -> dict[str, Any]:
    """Texts and conversions to which a table refers."""
    found: dict[str, Any] = getattr(conversion, "referenced_blocks", None) or {}
    return found


def _has_numbers(conversion: Any) -> bool:
    """Return True if a table of texts has numbers too."""
    blocks = _list_blocks(conversion)
    default = blocks.get("default_addr")
    return any(hasattr(block, "convert") for block in blocks.values()) or _is_formula3(default)


def _is_formula3(default: Any) -> bool:
    """Return True for a default of MDF 3 that is a formula as text."""
    return isinstance(default, bytes) and b"{X}" in default


def look_up_codes(conversion: Any, codes: NDArray[Any], path: Path) -> LookedUp:
    """Look up codes (k,) in the table of a conversion; of an unsorted one asammdf finds few."""
    blocks = _list_blocks(conversion)
    texts: list[str | None] = [None] * codes.size
    numbers = np.full(codes.size, np.nan)
    free = np.ones(codes.size, np.bool_)

    def fill(inside: NDArray[np.bool_], meaning: Any) -> None:
        free[inside] = False
        if hasattr(meaning, "convert"):
            part = codes[inside]
            if not _has_texts(meaning):
                numbers[inside] = convert_numbers(part, meaning, path)
                return
            nested = look_up_codes(meaning, part, path)
            numbers[inside] = nested.numbers
            for place, named in zip(np.flatnonzero(inside).tolist(), nested.texts, strict=True):
                texts[place] = named
        else:
            for place in np.flatnonzero(inside).tolist():
                texts[place] = decode_text(meaning or b"")

    is_integer = codes.dtype.kind != "f"
    for number in range(max(len(blocks), getattr(conversion, "ref_param_nr", 0))):
        text = blocks.get(f"text_{number}", getattr(conversion, f"text_{number}", None))
        value = getattr(conversion, f"val_{number}", None)
        value = getattr(conversion, f"param_val_{number}", value)
        low, high = (getattr(conversion, f"{end}_{number}", value) for end in ("lower", "upper"))
        if text is not None and low is not None and high is not None:
            fill(free & _is_inside(codes, low, high, is_integer), text)
    default = blocks.get("default_addr", b"")
    if _is_formula3(default):
        numbers[free] = np.asarray(conversion.convert(codes.astype(np.float64)), np.float64)[free]
    else:
        fill(free.copy(), default)
    return LookedUp(texts, numbers)


def decode_text(text: Any) -> str:
    """Return a text of a file without the zeros at its end."""
    return text.decode("utf-8", "replace").strip("\0") if isinstance(text, bytes) else str(text)


def _describe_codes(conversion: Any) -> str:
    """Words for a table of texts: `codes of texts: 0 = off, 1 = on`."""
    blocks = _list_blocks(conversion)
    pairs = []
    for index in range(_LISTED):
        text = blocks.get(f"text_{index}")
        code = getattr(conversion, f"val_{index}", getattr(conversion, f"lower_{index}", None))
        if isinstance(text, bytes) and code is not None:
            pairs.append(f"{code:g} = {decode_text(text)}")
    return f"codes of texts: {', '.join(pairs)}" if pairs else ""

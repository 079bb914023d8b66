# SPDX-License-Identifier: MIT
"""Serialise data for the core: descriptions as JSON, arrays."""

from __future__ import annotations

import json
import reprlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import is_dataclass
from numbers import Real

import numpy as np
from numpy.typing import NDArray

from drivetwin.errors import InputError

FloatArray = NDArray[np.float64]


def as_json(description: object) -> str:
    """A description, of dataclasses too, as the core reads it.

    Numbers and arrays of NumPy become plain ones. JSON has no NaN, so numbers that are not finite
    are refused by name here: raises InputError, as for anything else that has no place in JSON.
    """
    try:
        return json.dumps(description, default=_to_json_types, allow_nan=False)
    except ValueError:
        pass
    try:
        plain = json.loads(json.dumps(description, default=_to_json_types))
    except ValueError as error:
        raise InputError(f"an integer is too long: {error}", "give numbers in SI") from None
    bad = [key for key, value in _iterate_leaves("", plain) if not np.isfinite(value)]
    raise InputError(
        f"not a finite number: {', '.join(bad)}", "give every parameter of the model a value"
    )


def _to_json_types(value: object) -> object:
    """Convert a value to JSON-serialisable types."""
    if isinstance(value, np.floating):
        return float(value)
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if is_dataclass(value):
        return vars(value)
    if isinstance(value, Mapping):
        return dict(value)
    raise InputError(
        f"{value!r} in the description of a driveline",
        "describe it with numbers, texts, lists and mappings",
    )


def _iterate_leaves(path: str, value: object) -> Iterator[tuple[str, float]]:
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _iterate_leaves(f"{path}.{key}" if path else str(key), item)
    elif isinstance(value, list | tuple):
        for i, item in enumerate(value):
            name = item.get("name") if isinstance(item, Mapping) else None
            yield from _iterate_leaves(f"{path}[{i if name is None else name}]", item)
    elif isinstance(value, float):
        yield path, value


def as_array(values: float | FloatArray) -> FloatArray:
    """Values (n,) as the core takes them: float64 without gaps. Raises InputError for others.

    Texts, dates and complex numbers are no numbers here, even where NumPy converts them.
    """
    kind = np.asarray(values).dtype.kind
    if kind not in "fiubO":
        given = _KINDS.get(kind, "others")
        raise InputError(f"an array without numbers: it has {given}", "give real numbers in SI")
    if np.ma.is_masked(values):
        raise InputError("an array with masked values", "leave these samples out")
    try:
        column = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"an array without numbers: {error}", "give numbers in SI") from error
    if column.ndim != 1:
        raise InputError(f"an array of shape {column.shape}", "give one with a single axis")
    return column


def require_samples(time: FloatArray, values: FloatArray, delay: float) -> None:
    """Raise InputError for what is no signal: `time` (n,) [s], `values` (n,), `delay` [s]."""
    require_number("delay of a signal", delay)
    time, values = as_array(time), as_array(values)
    if time.size != values.size or time.size < 2:
        what = f"a signal of {time.size} times and {values.size} values"
        raise InputError(what, "give as many values as times, at least two")
    for name, numbers in (("time", time), ("values", values)):
        if not np.isfinite(numbers).all():
            index = int(np.argmin(np.isfinite(numbers)))
            what = f"{name} of a signal: sample {index} is {numbers[index]}"
            raise InputError(what, "leave out samples that are no finite numbers")
    if (time[1:] < time[:-1]).any():
        raise InputError("the times of a signal decrease", "sort the samples by time")


_KINDS = {"U": "texts", "S": "texts", "c": "complex numbers", "M": "dates", "m": "time spans"}
"""Kinds of arrays of NumPy that are refused."""


def require_number(name: str, value: object, *, finite: bool = True) -> float:
    """Return a number in SI. Raises InputError for what is none, or not `finite`."""
    plain = value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
    if not isinstance(plain, Real):
        what = f"{name} is {format_value(value)}, a {type(value).__name__} and not a number"
        raise InputError(what, "give a number in SI")
    try:
        number = float(plain)
    except OverflowError:
        what = f"{name} is {format_value(value)}, beyond 64-bit numbers"
        raise InputError(what, "give a number in SI") from None
    if finite and not np.isfinite(number):
        raise InputError(f"{name} is {number}", "give a finite number in SI")
    return number


def is_number(value: object) -> bool:
    """Return whether a value is a finite number that a float64 can hold."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return False
    try:
        return bool(np.isfinite(float(value)))
    except OverflowError:
        return False


def format_value(value: object) -> str:
    """Write a value of any kind, shortened, for a message."""
    try:
        return _SHORT.repr(value)
    except ValueError:  # an integer with more digits than Python writes
        return "an integer of too many digits"


_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = 80


def as_names(names: Sequence[str]) -> list[str]:
    """Names as the core takes them. Raises InputError for what is no list of texts."""
    if isinstance(names, str):
        raise InputError(
            f"the text {names!r} where a list of names is needed", f"write ({names!r},)"
        )
    if not isinstance(names, Iterable) or not all(isinstance(one, str) for one in names):
        raise InputError(f"{names!r} where a list of names is needed", "give a tuple of texts")
    return list(names)

# SPDX-License-Identifier: MIT
"""Detection of signals in a MATLAB workspace and of the time vector of each."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from drivetwin.channels.names import can_be_time, is_time_name
from drivetwin.channels.roles import TimeColumn
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.channels.units import get_time_factor, is_time_unit
from drivetwin.errors import Where
from drivetwin.logs.raw import RawChannel

_TIME_SUFFIXES = ("_t", "_time", "_T", "_Time", "_zeit")
_UNIT_SUFFIXES = ("_unit", "_units", "_Unit", "_Units", "_einheit")
_UNIT_FIELDS = ("unit", "units", "Unit", "Units", "einheit")
_DATA_FIELDS = ("data", "values", "value", "Data", "Values", "Value", "signals", "samples")
_NAME_FIELDS = ("name", "Name", "label", "title")
_ENOUGH = 10
"""Rows from which a matrix of two columns may be a signal with its time."""

_REFERENCE = 0xDD000000
"""First number of a reference to an object of version 7.3."""

_DEPTH = 12
"""Structs nested deeper than this are no log."""


@dataclass(eq=False)
class Signals:
    """Result of the search: channels, and the reason for each variable without a signal."""

    channels: list[RawChannel] = field(default_factory=list)
    unreadable: dict[str, str] = field(default_factory=dict)


def find_signals(tree: Mapping[str, Any], time: TimeColumn, file: str) -> Signals:
    """Collect the signals of a workspace given as nested dicts and lists.

    Fields of structs are named with dots. Raises UnitError for a time unit that is none.
    """
    search = _Search(time, file)
    search.search_struct(tree, "", 0)
    return search.found


class _Search:
    def __init__(self, time: TimeColumn, file: str) -> None:
        self._stated = time
        self._file = file
        self.found = Signals()

    def search_struct(self, tree: Mapping[str, Any], prefix: str, depth: int) -> None:
        """Read the signals among the fields of a struct, then the signals of nested structs."""
        if depth > _DEPTH:
            self.found.unreadable[prefix] = "structs are nested too deep"
            return
        vectors = {name: v for name, value in tree.items() if (v := _to_vector(value)) is not None}
        clocks = {name for name in vectors if can_be_time(_get_unit(name, tree))}
        times = self._match_times(vectors, clocks)
        used = {name for name in vectors if self._is_time_vector(name, vectors, clocks)}
        recorder = self._add_recorder_channels(tree, prefix)
        for name, values in vectors.items():
            if name in used:
                continue
            exported = split_asammdf_name(name, vectors)
            if exported is not None:
                own, group, time = exported
                self._add_channel(
                    prefix + own,
                    _get_unit(name, tree),
                    (vectors[time], values),
                    self._get_seconds_factor(time, tree),
                    group,
                )
                continue
            stamps_of = times.get(name)
            if stamps_of is None:
                self._add_with_common_time(prefix + name, values, vectors, tree)
            else:
                self._add_channel(
                    prefix + name,
                    _get_unit(name, tree),
                    (vectors[stamps_of], values),
                    self._get_seconds_factor(stamps_of, tree),
                )
        for name, value in tree.items():
            if name in recorder:
                continue
            if isinstance(value, Mapping):
                self._search_struct_field(value, prefix + name, depth)
            elif isinstance(value, list):
                self._search_items(value, prefix + name, depth)
            elif not used and (pair := _split_time_and_values(value)) is not None:
                self._add_channel(
                    prefix + name, _get_unit(name, tree), pair, self._get_seconds_factor(name, {})
                )
            elif name not in vectors:
                self._add_matrix(prefix + name, value, vectors, tree)

    def _add_recorder_channels(self, tree: Mapping[str, Any], prefix: str) -> Set[str]:
        """Add the channels of a dSPACE recorder; return the names of its fields.

        Its time vectors are structs in `X`, its channels structs in `Y`; `XIndex` is the number of
        a channel's time vector, from 1.
        """
        axes, channels = (_list_structs(tree.get(key)) for key in ("X", "Y"))
        times = [_to_vector(one.get("Data")) for one in axes]
        if not channels or not times or any(time is None for time in times):
            return frozenset()
        for place, one in enumerate(channels, start=1):
            name = prefix + ((_to_text(one.get("Name")) or f"Y({place})").replace('"', ""))
            index = _to_index(one.get("XIndex", 1))
            values = _to_vector(one.get("Data"))
            if values is None or not 0 < index <= len(times):
                why = "no vector of numbers" if values is None else f"no time vector {index}"
                self.found.unreadable[name] = why
                continue
            unit = _get_struct_unit(axes[index - 1])
            if not can_be_time(unit):
                self.found.unreadable[name] = f"recorded over {unit!r}, not over time"
                continue
            time = times[index - 1]
            assert time is not None
            stated = unit if unit is not None and is_time_unit(unit) else "s"
            factor = get_time_factor(
                self._stated.unit or stated, Where(file=self._file, channel=name)
            )
            self._add_channel(name, _get_struct_unit(one), (time, values), factor)
        return frozenset(("X", "Y"))

    def _search_items(self, items: list[Any], path: str, depth: int) -> None:
        for place, item in enumerate(items):
            if isinstance(item, Mapping):
                own = next(
                    (_to_text(item[key]) for key in _NAME_FIELDS if _to_text(item.get(key))), None
                )
                self._search_struct_field(item, own or f"{path}({place + 1})", depth)

    def _search_struct_field(self, tree: Mapping[str, Any], path: str, depth: int) -> None:
        """A struct: one signal as {time, data, unit}, else a workspace of its own."""
        stamps = next(
            (n for n in tree if is_time_name(n) and _to_vector(tree[n]) is not None), None
        )
        data = next((name for name in _DATA_FIELDS if name in tree), None)
        if stamps is None or data is None:
            self.search_struct(tree, path + ".", depth + 1)
            return
        time, factor = _to_vector(tree[stamps]), self._get_seconds_factor(stamps, tree)
        assert time is not None
        parts = tree[data] if isinstance(tree[data], list) else [tree[data]]
        for place, part in enumerate(parts):
            name, unit, values = path, _get_field_unit(tree), part
            if isinstance(part, Mapping):  # Simulink: signals.values, one struct for each
                label = next(
                    (_to_text(part[k]) for k in _NAME_FIELDS if _to_text(part.get(k))), None
                )
                name = label or (path if len(parts) == 1 else f"{path}({place + 1})")
                unit = _get_field_unit(part) or unit
                values = next((part[key] for key in _DATA_FIELDS if key in part), None)
            vector = _to_vector(values)
            if vector is not None:
                self._add_channel(name, unit, (time, vector), factor)
                continue
            columns = _split_columns(values, [time])
            for number, column in enumerate(columns, start=1):
                self._add_channel(f"{name}({number})", unit, (time, column), factor)
            if not columns:
                self._record_unreadable(name, values)

    def _add_with_common_time(
        self,
        path: str,
        values: FloatArray,
        vectors: Mapping[str, FloatArray],
        tree: Mapping[str, Any],
    ) -> None:
        """A vector without a time of its own: the one common time vector of its length."""
        names = self._find_common_times(vectors, tree)
        own = path.rsplit(".", 1)[-1]
        fitting = choose_time(own, values.size, names, vectors)
        if len(fitting) == 1:
            pair = (vectors[fitting[0]], values)
            self._add_channel(
                path, _get_unit(own, tree), pair, self._get_seconds_factor(fitting[0], tree)
            )
        elif fitting:
            self.found.unreadable[path] = f"several time vectors fit: {', '.join(fitting)}"
        elif values.size > 1:
            self.found.unreadable[path] = (
                f"no time vector of its {values.size} samples: neither {path}_t nor a common one"
            )

    def _add_matrix(
        self,
        path: str,
        value: Any,
        vectors: Mapping[str, FloatArray],
        tree: Mapping[str, Any],
    ) -> None:
        """Columns over a common time vector, else no signal."""
        times = [vectors[name] for name in self._find_common_times(vectors, tree)]
        columns = _split_columns(value, times)
        for number, column in enumerate(columns, start=1):
            self._add_with_common_time(f"{path}({number})", column, vectors, tree)
        if not columns:
            self._record_unreadable(path, value)

    def _find_common_times(
        self, vectors: Mapping[str, FloatArray], tree: Mapping[str, Any]
    ) -> list[str]:
        """The time vectors for all that have none of their own: as stated, else by name."""
        stated = self._stated.source
        if stated is not None and stated in vectors:
            return [stated]
        return [
            name
            for name, values in vectors.items()
            if (is_time_name(name) or is_raster_time(name, values))
            and can_be_time(_get_unit(name, tree))
        ]

    def _match_times(self, vectors: Mapping[str, FloatArray], clocks: Set[str]) -> dict[str, str]:
        """The time vector of each name that has one of its own among `clocks`.

        What is stated for the whole file goes before it, where it fits.
        """
        stated = vectors.get(self._stated.source or "")
        return {
            name: name + suffix
            for name, values in vectors.items()
            for suffix in _TIME_SUFFIXES
            if name + suffix in clocks and (stated is None or stated.size != values.size)
        }

    def _is_time_vector(
        self, name: str, vectors: Mapping[str, FloatArray], clocks: Set[str]
    ) -> bool:
        owner = any(
            name.endswith(suffix) and name.removesuffix(suffix) in vectors
            for suffix in _TIME_SUFFIXES
        )
        named = owner or is_time_name(name) or is_raster_time(name, vectors[name])
        return name == self._stated.source or (name in clocks and named)

    def _get_seconds_factor(self, name: str, tree: Mapping[str, Any]) -> float:
        """Factor to seconds of a time vector; MATLAB's own unit is the second.

        A time series keeps another one in `TimeInfo`.
        """
        info = tree.get("TimeInfo")
        listed = _get_struct_unit(info) if isinstance(info, Mapping) else None
        unit = self._stated.unit or _get_unit(name, tree) or listed or "s"
        return get_time_factor(unit, Where(file=self._file, channel=name))

    def _add_channel(
        self,
        name: str,
        unit: str | None,
        pair: tuple[FloatArray, FloatArray],
        factor: float,
        group: str = "",
    ) -> None:
        time, values = pair
        if time.size != values.size:
            self.found.unreadable[name] = f"{values.size} values, but {time.size} time stamps"
        else:
            self.found.channels.append(RawChannel(name, unit, time * factor, values, group))

    def _record_unreadable(self, name: str, value: Any) -> None:
        """Record why a variable is no signal, unless it is a text or a single number."""
        if isinstance(value, np.ndarray) and value.dtype.kind == "c" and value.size > 1:
            self.found.unreadable[name] = "complex numbers: export their real part"
        elif isinstance(value, np.ndarray) and value.ndim > 1:
            shape = "×".join(map(str, value.shape))
            self.found.unreadable[name] = f"a matrix {shape}: one vector for each signal is needed"
        elif type(value).__name__ in ("MatlabOpaque", "MatlabFunction") or _is_closed(value):
            self.found.unreadable[name] = _describe_object(value)


def _to_vector(value: Any) -> FloatArray | None:
    """A real numeric vector of two or more samples as (n,) float64, else None."""
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "iufb" or _is_closed(value):
        return None
    squeezed = value.squeeze()
    return squeezed.astype(np.float64) if squeezed.ndim == 1 and squeezed.size > 1 else None


def _split_columns(value: Any, times: Sequence[FloatArray]) -> list[FloatArray]:
    """The columns of a matrix with a row for each sample of one of `times`, as Simulink writes.

    Returns None for a square matrix, and for a matrix whose first column is increasing (a possible
    time vector).
    """
    sizes = [time.size for time in times]
    matrix = isinstance(value, np.ndarray) and value.dtype.kind in "iufb" and value.ndim == 2
    if not matrix or value.shape[0] not in sizes or value.shape[1] in sizes:
        return []
    columns = list(value.astype(np.float64).T)
    return columns if np.any(np.diff(columns[0]) <= 0.0) else []


def _split_time_and_values(value: Any) -> tuple[FloatArray, FloatArray] | None:
    """The columns of a matrix of two whose first one only grows, as CANape writes a signal."""
    matrix = isinstance(value, np.ndarray) and value.dtype.kind in "iuf" and value.ndim == 2
    if not matrix or value.shape[1] != 2 or value.shape[0] < _ENOUGH:
        return None
    time, values = value.astype(np.float64).T
    return (time, values) if np.all(np.diff(time) > 0.0) else None


def _list_structs(value: Any) -> list[Mapping[str, Any]]:
    """Return the structs of a field that holds one or several; none if it holds other things."""
    items = value if isinstance(value, list) else [value]
    return items if all(isinstance(item, Mapping) for item in items) else []


def _to_index(value: Any) -> int:
    """Return a single whole number; 0 for anything else."""
    numbers = np.asarray(value)
    single = numbers.dtype.kind in "iuf" and numbers.size == 1
    number = float(numbers.reshape(-1)[0]) if single else 0.0
    return int(number) if number.is_integer() else 0


def _is_closed(value: Any) -> bool:
    """Return True for the reference that version 7.3 has in place of an object."""
    is_array = isinstance(value, np.ndarray) and value.dtype == np.uint32 and value.size > 1
    return is_array and int(value.reshape(-1)[0]) == _REFERENCE


def _describe_object(value: Any) -> str:
    """Words for a closed object, with its class and the remedy for a time."""
    names = value.dtype.names or () if isinstance(value, np.ndarray) else ()
    kind = bytes(value["s2"].reshape(-1)[0]).decode("utf-8", "replace") if "s2" in names else ""
    remedy = {"duration": "seconds(x)", "datetime": "posixtime(x)"}.get(kind)
    words = f"a closed MATLAB object{f' ({kind})' if kind else ''}"
    return f"{words}: export {remedy}" if remedy else words


def _to_text(value: Any) -> str | None:
    return value.strip() or None if isinstance(value, str) else None


def _get_unit(name: str, tree: Mapping[str, Any]) -> str | None:
    """Unit of a variable: `<name>_unit`, or its field in a struct `units`."""
    for suffix in _UNIT_SUFFIXES:
        if text := _to_text(tree.get(name + suffix)):
            return text
    tables: Iterator[Any] = (tree.get(key) for key in _UNIT_FIELDS)
    return next(
        (t for table in tables if isinstance(table, Mapping) and (t := _to_text(table.get(name)))),
        None,
    )


def _get_field_unit(tree: Mapping[str, Any]) -> str | None:
    """Unit of a struct that is one signal; a time series keeps it in `DataInfo`."""
    info = tree.get("DataInfo")
    return _get_struct_unit(tree) or (_get_struct_unit(info) if isinstance(info, Mapping) else None)


def _get_struct_unit(tree: Mapping[str, Any]) -> str | None:
    """Return the unit stated in the struct itself."""
    return next((text for key in _UNIT_FIELDS if (text := _to_text(tree.get(key)))), None)


_WORD = r"(?:time|times|timestamps?|zeit|messzeit|tout)"
_RASTER = re.compile(
    rf"{_WORD}_?(?P<after>\w+)|(?P<before>\w+)_{_WORD}"
    r"|t_?(?P<step>\d+(?:p\d+)?_?(?:ns|us|ms|s|hz|khz))",
    re.IGNORECASE | re.ASCII,
)
"""Name of the time vector of a raster: `time_10ms`, `Zeit_CAN`, `fast_time`, `t_1ms`."""

_INCREASING = 0.99
"""Least share of steps that increase; a logger may repeat single stamps."""

_ASAMMDF = re.compile(r"DG(\d+)_(.+)", re.ASCII)
"""Name of a channel that asammdf exports; the time of its group is `DGM<number>_timestamps`."""


def is_raster_time(name: str, values: FloatArray) -> bool:
    """Return True if a vector has the name of the time of a raster and increases."""
    if _RASTER.fullmatch(name) is None:
        return False
    steps = np.diff(values)
    return bool(np.all(steps >= 0.0)) and float(np.mean(steps > 0.0)) >= _INCREASING


def split_asammdf_name(name: str, vectors: Mapping[str, FloatArray]) -> tuple[str, str, str] | None:
    """Return channel name, group and time vector of a name by asammdf; None for other names."""
    match = _ASAMMDF.fullmatch(name)
    if match is None:
        return None
    time = f"DGM{match[1]}_timestamps"
    return (match[2], f"DG{match[1]}", time) if time in vectors else None


def choose_time(
    name: str, size: int, times: Sequence[str], vectors: Mapping[str, FloatArray]
) -> list[str]:
    """Return the time vectors among `times` that a vector of `size` samples may belong to.

    Of several of its length, those count that share a raster with the name (`n_10ms` beside
    `time_10ms`), then those of a plain name (`t`, `time`). Of equal vectors only the first counts.
    """
    fitting = [time for time in times if vectors[time].size == size]
    sharing = [time for time in fitting if _shares_raster(name, time)]
    plain = [time for time in fitting if is_time_name(time)]
    chosen = sharing or plain or fitting
    different: list[str] = []
    for time in chosen:
        if not any(np.array_equal(vectors[time], vectors[other]) for other in different):
            different.append(time)
    return different


def _shares_raster(name: str, time: str) -> bool:
    match = _RASTER.fullmatch(time)
    raster = next(filter(None, match.groups()), "").casefold() if match else ""
    text = name.casefold()
    return bool(raster) and (text.endswith(f"_{raster}") or text.startswith(f"{raster}_"))

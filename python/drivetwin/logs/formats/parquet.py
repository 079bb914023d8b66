# SPDX-License-Identifier: MIT
"""Reader of Parquet and Arrow tables by pyarrow: units from the metadata, null is no sample."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.optional_dependencies import handle_parser_errors, import_extra
from drivetwin.channels.names import find_time_index, is_time_name, split_name_and_unit
from drivetwin.channels.roles import Column, ReadOptions
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.channels.units import get_time_factor
from drivetwin.errors import DamagedChannelError, FileFormatError, TimeError, Where
from drivetwin.logs.raw import (
    RawChannel,
    Recording,
    Window,
    describe_origin,
    find_origin,
    subtract_origin,
)

_ARROW_KIND = "an Arrow file"


@contextmanager
def open_arrow(path: Path, options: ReadOptions) -> Iterator[Recording]:
    """Open an Arrow IPC file with one time column; see `open_parquet` for names and errors."""
    ipc = import_extra("pyarrow.ipc", "io", _ARROW_KIND, path)
    with path.open("rb") as file:
        with handle_parser_errors(_ARROW_KIND, path):
            recording = ParquetRecording(_Table(ipc, file), path, options, _ARROW_KIND)
        yield recording


class _Table:
    """An open file with the methods of a Parquet file that its recording uses."""

    def __init__(self, ipc: Any, file: Any) -> None:
        self._ipc = ipc
        self._file = file
        self.schema_arrow = ipc.open_file(file).schema

    def read(self, columns: Sequence[str]) -> Any:
        """Return a table of all columns of these names."""
        wanted = [k for k, name in enumerate(self.schema_arrow.names) if name in columns]
        options = self._ipc.IpcReadOptions(included_fields=wanted)
        return self._ipc.open_file(self._file, options=options).read_all()


_KIND = "a Parquet file"
_UNIT_KEYS = ("unit", "units", "Unit")
_PANDAS = "PANDAS_ATTRS"
"""Metadata key of the attributes of a pandas frame, which may include `units`."""

_TICKS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Seconds of the units in which times are counted."""


@contextmanager
def open_parquet(path: Path, options: ReadOptions) -> Iterator[Recording]:
    """Open a Parquet table with one time column.

    The unit of a column stands in its field metadata (`unit`), in the table's metadata (`units`, a
    JSON object by column; pandas keeps `attrs["units"]` there), or in its name (`TqEng [Nm]`).
    Raises MissingExtraError without pyarrow, FileFormatError for a damaged file,
    MissingChannelError, MappingError, UnitError and TimeError for its time column.
    """
    parquet = import_extra("pyarrow.parquet", "io", _KIND, path)
    with handle_parser_errors(_KIND, path):
        table = parquet.ParquetFile(path)
    try:
        with handle_parser_errors(_KIND, path):
            recording = ParquetRecording(table, path, options)
        yield recording
    finally:
        table.close()


class ParquetRecording:
    """Columns of an open Parquet file; the time column is in memory, others are loaded singly."""

    def __init__(self, table: Any, path: Path, options: ReadOptions, kind: str = _KIND) -> None:
        self._table = table
        self._kind = kind
        self._path = path
        self.warnings: tuple[str, ...] = ()
        schema = table.schema_arrow
        units = _parse_units(schema.metadata or {})
        columns = [_make_column(field, units) for field in schema]
        time, others = self._find_time_index(columns, options)
        self._fields = [index for index in range(len(columns)) if index not in (time, *others)]
        self.columns = tuple(columns[index] for index in self._fields)
        self._seconds = self._load_stamps(time, columns[time], options.time.unit)

    def _find_time_index(
        self, columns: Sequence[Column], options: ReadOptions
    ) -> tuple[int, Sequence[int]]:
        """Return the time column, and others whose type is a time: they hold no channel.

        It is the one with a name for time, else of those the first with a time zone, or the first.
        """
        import pyarrow as pa

        names = [column.name for column in columns]
        kinds = [field.type for field in self._table.schema_arrow]
        temporal = [
            index
            for index, kind in enumerate(kinds)
            if pa.types.is_timestamp(kind) or pa.types.is_duration(kind) or pa.types.is_time(kind)
        ]
        if options.time.source is not None or any(map(is_time_name, names)) or not temporal:
            units = [column.unit for column in columns]
            found = find_time_index(names, units, options.time, str(self._path))
        else:
            zoned = (index for index in temporal if getattr(kinds[index], "tz", None))
            found = next(zoned, temporal[0])
        others = [index for index in temporal if index != found]
        if others:
            left = ", ".join(names[index] for index in others)
            self.warnings = (f"several time columns: {names[found]} is used, not {left}",)
        return found, others

    def load(self, index: int, window: Window | None = None) -> RawChannel:
        """Read one column; rows without a value are no samples. See `Recording`."""
        column = self.columns[index]
        where = Where(file=str(self._path), channel=column.name)
        values, present = self._load_numbers(self._fields[index], where)
        if values.size != self._seconds.size:
            what = f"{values.size} values for {self._seconds.size} time stamps"
            raise FileFormatError(what, "export the log again", where)
        channel = RawChannel(column.name, column.unit, self._seconds[present], values[present])
        return channel.select_window(window)

    def _load_numbers(self, field: int, where: Where) -> tuple[FloatArray, Any]:
        import pyarrow as pa
        import pyarrow.compute as pc

        kind = self._table.schema_arrow.field(field).type
        numeric = pa.types.is_integer(kind) or pa.types.is_floating(kind)
        if not (numeric or pa.types.is_boolean(kind) or pa.types.is_decimal(kind)):
            raise DamagedChannelError(f"it holds {kind}, not numbers", "map another column", where)
        with handle_parser_errors(self._kind, self._path):
            data = self._load_values(field)
            present = np.asarray(pc.is_valid(data).to_numpy(zero_copy_only=False), np.bool_)
            floats = pc.cast(data, pa.float64(), safe=False)
            return np.asarray(floats.to_numpy(zero_copy_only=False), np.float64), present

    def _load_values(self, field: int) -> Any:
        """One column, picked by place among all of its name: names may repeat.

        By `a.b` a struct `a` with a field `b` is read as well.
        """
        names = self._table.schema_arrow.names
        read = self._table.read(columns=[names[field]])
        alike = read.schema.get_all_field_indices(names[field])
        return read.column(alike[names[:field].count(names[field])])

    def _load_stamps(self, field: int, column: Column, asserted: str | None) -> FloatArray:
        """Return the time [s]: instants from the first one on, others as the file counts them."""
        import pyarrow as pa

        where = Where(file=str(self._path), channel=column.name)
        kind = self._table.schema_arrow.field(field).type
        if pa.types.is_timestamp(kind):
            ticks = self._load_ticks(field, where)
            return (ticks - ticks[:1]).astype(np.float64) * _TICKS[kind.unit]
        if pa.types.is_duration(kind) or pa.types.is_time(kind):
            stamps = self._load_ticks(field, where).astype(np.float64) * _TICKS[kind.unit]
        else:
            factor = get_time_factor(asserted if asserted is not None else column.unit, where)
            values, present = self._load_numbers(field, where)
            _refuse_missing_stamps(present, where)
            stamps = values * factor
        origin = find_origin(stamps[:1])
        self.warnings = (*self.warnings, *describe_origin(origin))
        return subtract_origin(stamps, origin)

    def _load_ticks(self, field: int, where: Where) -> NDArray[np.int64]:
        """Return a column of times as whole multiples (n,) of the unit of its type."""
        import pyarrow as pa
        import pyarrow.compute as pc

        with handle_parser_errors(self._kind, self._path):
            data = self._load_values(field)
            _refuse_missing_stamps(np.asarray(pc.is_valid(data).to_numpy()), where)
            width = pa.int32() if pa.types.is_time32(data.type) else pa.int64()
            return np.asarray(pc.cast(data, width).to_numpy(), np.int64)


def _refuse_missing_stamps(present: NDArray[np.bool_], where: Where) -> None:
    if not present.all():
        row = int(present.argmin())
        raise TimeError(f"row {row} has no time stamp", "remove the row", where)


def _make_column(field: Any, units: Mapping[str, str]) -> Column:
    metadata = _decode_metadata(field.metadata or {})
    name, in_name = split_name_and_unit(field.name)
    stated = next((metadata[key] for key in _UNIT_KEYS if metadata.get(key, "").strip()), None)
    return Column(name, stated or units.get(field.name) or in_name)


def _parse_units(metadata: Mapping[bytes, bytes]) -> dict[str, str]:
    """Units by column from the table's metadata; what is no JSON object of texts is passed over."""
    texts = _decode_metadata(metadata)
    units = next((_parse_json(texts[key]) for key in _UNIT_KEYS if key in texts), None)
    attributes = _parse_json(texts.get(_PANDAS, ""))
    if units is None and isinstance(attributes, dict):
        units = next((attributes[key] for key in _UNIT_KEYS if key in attributes), None)
    return {k: v for k, v in units.items() if isinstance(v, str)} if isinstance(units, dict) else {}


def _parse_json(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return None


def _decode_metadata(metadata: Mapping[bytes, bytes]) -> dict[str, str]:
    return {
        key.decode("utf-8", "replace"): v.decode("utf-8", "replace") for key, v in metadata.items()
    }

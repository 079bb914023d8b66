# SPDX-License-Identifier: MIT
"""Reader of MATLAB files: v4 to v7 by SciPy, v7.3 (HDF5) by pymatreader.

A channel is `x` with its time `x_t`, a vector beside one time vector, or a struct of time and data.

SciPy notices most damage of a file of version 5, and the checksums of its compressed variables. A
file on which it crashes, or which expands to gigabytes, costs the child process that reads it. It
does not notice a variable of version 4 that is cut or has another head. A file of version 4 is
variables only: five numbers (type, rows, columns, whether complex, length of the name), name and
data.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin._util.optional_dependencies import handle_parser_errors, import_extra
from drivetwin.channels.roles import ReadOptions
from drivetwin.errors import FileFormatError, MissingChannelError, Where
from drivetwin.logs.formats.guarded import compute_parser_limits, make_memory_error
from drivetwin.logs.raw import (
    RawLog,
    Recording,
    describe_origin,
    find_origin,
    subtract_origin,
)

_KIND = "a MATLAB file"
_PLAIN = (
    "export plain arrays: <name>, <name>_t with its time in s, and <name>_unit; timetables and "
    "Simulink data sets are closed objects"
)

_HEADER = 128
"""Bytes of the header of version 5; elements follow, each with a tag of type and length."""
_HEAD4 = 20
_BYTES4 = (8, 4, 4, 2, 2, 1)
"""Bytes of a number by its kind in version 4: double, single, four kinds of integers."""
_LONGEST4 = 256
"""Letters that the name of a variable of version 4 has at most, with the zero at its end."""


@contextmanager
def open_mat(path: Path, options: ReadOptions) -> Iterator[Recording]:
    """Read a MATLAB file of version 4 to 7.3.

    Time is in s, unless the file (`<name>_t_unit`, `time_unit`) or the mapping gives another unit.
    Raises MissingExtraError (v7.3 without pymatreader), FileFormatError for a damaged file or one
    with closed objects only, MissingChannelError without any time vector, UnitError.
    """
    from drivetwin.logs.formats.mat_signals import find_signals  # not needed to recognise a file

    with path.open("rb") as file:
        is_hdf5 = file.read(10) == b"MATLAB 7.3"
    with handle_parser_errors(_KIND, path):
        tree = _read_hdf5_tree(path) if is_hdf5 else _read_tree(path)
        found = find_signals(tree, options.time, str(path))
    if not found.channels:
        raise _make_no_signal_error(tree, found.unreadable, path)
    origin = find_origin(channel.time[0] for channel in found.channels)
    channels = tuple(replace(one, time=subtract_origin(one.time, origin)) for one in found.channels)
    yield RawLog(channels, found.unreadable, describe_origin(origin), str(path))


def _make_no_signal_error(
    tree: Mapping[str, Any], unreadable: Mapping[str, str], path: Path
) -> FileFormatError | MissingChannelError:
    where = Where(file=str(path))
    if not tree:
        return FileFormatError("the file holds no variables", _PLAIN, where)
    reasons = "; ".join(f"{name}: {why}" for name, why in unreadable.items())
    what = f"no variable has a time vector among {', '.join(list(tree)[:20])}"
    return MissingChannelError(f"{what} ({reasons})" if reasons else what, _PLAIN, where)


def _read_tree(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat

    _check_version4(path)
    content = loadmat(path, struct_as_record=False, squeeze_me=True, appendmat=False)
    return {name: _to_plain(v) for name, v in content.items() if not name.startswith("__")}


def _to_plain(value: Any) -> Any:
    """A struct as a dict, an array of structs as a list; other values as they are."""
    fields = getattr(value, "_fieldnames", None)
    if fields is not None:
        return {name: _to_plain(getattr(value, name)) for name in fields}
    if isinstance(value, np.ndarray) and value.dtype == object:
        return [_to_plain(item) for item in value.ravel()]
    return value


def _read_hdf5_tree(path: Path) -> dict[str, Any]:
    h5py = import_extra("h5py", "io", "a MATLAB 7.3 file", path)
    pymatreader = import_extra("pymatreader", "io", "a MATLAB 7.3 file", path)
    with h5py.File(path, "r") as file:
        _refuse_expansion(file, path)
    content: dict[str, Any] = pymatreader.read_mat(str(path))
    return {
        name: _split_struct_array(v) for name, v in content.items() if not name.startswith("__")
    }


def _refuse_expansion(file: Any, path: Path) -> None:
    """Raise ReaderFailureError if the data sets of an open HDF5 file take too much memory."""
    sizes: list[int] = []
    file.visititems(lambda _, item: sizes.append(8 * int(getattr(item, "size", 0) or 0)))
    memory = compute_parser_limits(path).memory
    if sum(sizes) > memory:
        raise make_memory_error(path, memory)


def _split_struct_array(value: Any) -> Any:
    """An array of structs, which arrives as one struct of lists, as a list of structs."""
    if not isinstance(value, dict):
        return [_split_struct_array(item) for item in value] if isinstance(value, list) else value
    value = {name: _split_struct_array(item) for name, item in value.items()}
    lists = [item for item in value.values() if isinstance(item, list)]
    if lists and len(lists) == len(value) and len({len(item) for item in lists}) == 1:
        return [dict(zip(value, row, strict=True)) for row in zip(*lists, strict=True)]
    return value


def is_version4(head: bytes) -> bool:
    """Return True if a file that starts with `head` is one of version 4, which has no mark."""
    variable = _measure_variable4(head[:_HEAD4])
    return variable is not None and head[_HEAD4:][: variable[0]].find(b"\0") == variable[0] - 1


def _measure_variable4(head: bytes) -> tuple[int, int] | None:
    """Bytes of name and data of a variable of version 4; None where its head is none."""
    if len(head) < _HEAD4:
        return None
    order = "<" if head[1:4] == bytes(3) else ">"  # the type is a small number
    kind, rows, columns, imaginary, name = struct.unpack(f"{order}5i", head)
    thousands, number, text = kind // 1000, kind // 10 % 10, kind % 10
    if thousands != (order == ">") or kind // 100 % 10 or number >= len(_BYTES4) or text > 2:
        return None
    if min(rows, columns) < 0 or imaginary not in (0, 1) or not 1 < name <= _LONGEST4:
        return None
    return name, rows * columns * _BYTES4[number] * (1 + imaginary)


def _check_version4(path: Path) -> None:
    """Raise FileFormatError where a variable of a file of version 4 is cut or has no sound head."""
    size = path.stat().st_size
    place, number = 0, 0
    with path.open("rb") as file:
        if not is_version4(file.read(_HEADER)):
            return
        while place < size:
            file.seek(place)
            number += 1
            variable = _measure_variable4(file.read(_HEAD4))
            place += size if variable is None else _HEAD4 + sum(variable)
            if place > size:
                what = f"variable {number} {'is cut' if variable else 'has no sound head'}"
                raise FileFormatError(
                    f"not readable as a MATLAB file: {what}",
                    "the file is damaged or was not copied whole: export it again",
                    Where(file=str(path)),
                )

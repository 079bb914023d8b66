# SPDX-License-Identifier: MIT
"""Reader of MATLAB files: v4 to v7 by SciPy, v7.3 (HDF5) by pymatreader.

A channel is `x` with its time `x_t`, a vector beside one time vector, or a struct of time and data.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin._util.optional_dependencies import handle_parser_errors, import_extra
from drivetwin.channels.read_options import ReadOptions
from drivetwin.errors import FileFormatError, MissingChannelError, Where
from drivetwin.logs.formats.mat_integrity import check_blocks, refuse_expansion
from drivetwin.logs.formats.mat_signals import Signals, find_signals
from drivetwin.logs.formats.parser_limits import compute_parser_limits
from drivetwin.logs.origin import describe_origin, find_origin, subtract_origin
from drivetwin.logs.raw import RawLog, Recording

_KIND = "a MATLAB file"
_PLAIN = (
    "export plain arrays: <name>, <name>_t with its time in s, and <name>_unit; timetables and "
    "Simulink data sets are closed objects"
)


@contextmanager
def open_mat(path: Path, options: ReadOptions) -> Iterator[Recording]:
    """Read a MATLAB file of version 4 to 7.3.

    Time is in s, unless the file (`<name>_t_unit`, `time_unit`) or the mapping gives another unit.
    Raises MissingExtraError (v7.3 without pymatreader), FileFormatError for a damaged file or one
    with closed objects only, MissingChannelError without any time vector, UnitError.
    """
    with path.open("rb") as file:
        is_hdf5 = file.read(10) == b"MATLAB 7.3"
    with handle_parser_errors(_KIND, path):
        tree = _read_hdf5_tree(path) if is_hdf5 else _read_tree(path)
        found = find_signals(tree, options.time, str(path))
    if not found.channels:
        raise _make_no_signal_error(tree, found, path)
    origin = find_origin(channel.time[0] for channel in found.channels)
    channels = tuple(replace(one, time=subtract_origin(one.time, origin)) for one in found.channels)
    yield RawLog(channels, found.unreadable, describe_origin(origin), str(path))


def _make_no_signal_error(
    tree: Mapping[str, Any], found: Signals, path: Path
) -> FileFormatError | MissingChannelError:
    where = Where(file=str(path))
    if not tree:
        return FileFormatError("the file holds no variables", _PLAIN, where)
    reasons = "; ".join(f"{name}: {why}" for name, why in found.unreadable.items())
    what = f"no variable has a time vector among {', '.join(list(tree)[:20])}"
    return MissingChannelError(f"{what} ({reasons})" if reasons else what, _PLAIN, where)


def _read_tree(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat

    refuse_expansion(path, compute_parser_limits(path).memory)
    check_blocks(path)
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
    import_extra("h5py", "io", "a MATLAB 7.3 file", path)
    pymatreader = import_extra("pymatreader", "io", "a MATLAB 7.3 file", path)
    content: dict[str, Any] = pymatreader.read_mat(str(path))
    return {
        name: _split_struct_array(v) for name, v in content.items() if not name.startswith("__")
    }


def _split_struct_array(value: Any) -> Any:
    """An array of structs, which arrives as one struct of lists, as a list of structs."""
    if not isinstance(value, dict):
        return [_split_struct_array(item) for item in value] if isinstance(value, list) else value
    value = {name: _split_struct_array(item) for name, item in value.items()}
    lists = [item for item in value.values() if isinstance(item, list)]
    if lists and len(lists) == len(value) and len({len(item) for item in lists}) == 1:
        return [dict(zip(value, row, strict=True)) for row in zip(*lists, strict=True)]
    return value


__all__: Sequence[str] = ("open_mat",)

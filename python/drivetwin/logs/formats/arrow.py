# SPDX-License-Identifier: MIT
"""Reader of Arrow IPC files (Feather), by pyarrow: columns and units as in Parquet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from drivetwin._util.optional_dependencies import handle_parser_errors, import_extra
from drivetwin.channels.read_options import ReadOptions
from drivetwin.logs.formats.parquet import ParquetRecording
from drivetwin.logs.raw import Recording

_KIND = "an Arrow file"


@contextmanager
def open_arrow(path: Path, options: ReadOptions) -> Iterator[Recording]:
    """Open an Arrow IPC file with one time column; see `open_parquet` for names and errors."""
    ipc = import_extra("pyarrow.ipc", "io", _KIND, path)
    with path.open("rb") as file:
        with handle_parser_errors(_KIND, path):
            recording = ParquetRecording(_Table(ipc, file), path, options, _KIND)
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

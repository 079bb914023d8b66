# SPDX-License-Identifier: MIT
"""Parquet parts: one for each log at first, a few large ones in the end.

A part is named after the key of its log and also contains the outcome of the log. Writing a part
twice gives the same bytes under the same name.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

from drivetwin._util.atomic import write_bytes
from drivetwin.errors import StoreError, Where
from drivetwin.fleet.task import GO_ON, Outcome, Row, RowKind, make_arrow_table, make_schema

INBOX, ROWS = "inbox", "rows"
"""Folders of a store: parts of single logs, and the large parts that take their place."""

_OUTCOME = b"drivetwin.outcome"
_LOGS_PER_PART = 512
"""Logs that a large part holds on average, at most: it is written and read in one piece."""
_HEX = "0123456789abcdef"


def get_part_name(log: str) -> str:
    """Name of a log's own part below the store; a folder holds 1/256 of them."""
    return f"{INBOX}/{log[:2]}/{log}.parquet"


def write_part(path: Path, log: str, outcome: Outcome, rows: Sequence[Row]) -> None:
    """Write a log's own part; it appears whole or not at all. Raises OSError."""
    made = make_arrow_table(log, rows).replace_schema_metadata(
        {_OUTCOME: json.dumps(outcome.to_tree(), sort_keys=True)}
    )
    write_bytes(path, _encode_rows(made))


@contextmanager
def convert_write_errors() -> Iterator[None]:
    """Convert a worker's write error to a StoreError: no log caused it, and the run stops."""
    try:
        yield
    except OSError as fault:
        what = f"a worker cannot write: {fault.strerror or fault} ({fault.filename})"
        raise StoreError(what, GO_ON) from None


def read_outcome(path: Path) -> Outcome | None:
    """Read the outcome of a log from its part; None if the part is missing or incomplete."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        metadata = pq.read_schema(path).metadata or {}
        return Outcome.from_tree(json.loads(metadata[_OUTCOME]))
    except (OSError, KeyError, ValueError, TypeError, pa.ArrowException):
        return None


def read_rows(path: Path, kinds: Sequence[RowKind] = ()) -> Any:
    """Arrow table of a part's rows of these kinds, or all. Raises StoreError where damaged."""
    import pyarrow as pa
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    try:
        # Not read_table, which brings the whole of Arrow's data sets along for one small file.
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            rows = file.read(use_threads=False).replace_schema_metadata()
        if rows.schema != make_schema():
            raise pa.ArrowInvalid("its columns are not those of a part")
    except (OSError, pa.ArrowException) as fault:
        raise _make_damage_error(fault, path) from None
    if not kinds:
        return rows
    return rows.filter(pc.is_in(rows.column("kind"), pa.array([kind.value for kind in kinds])))


def check_footer(path: Path) -> None:
    """Raise StoreError where a part is cut off: the end of the file has its table of contents."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        pq.read_metadata(path)
    except (OSError, pa.ArrowException) as fault:
        raise _make_damage_error(fault, path) from None


def _make_damage_error(fault: Exception, path: Path) -> StoreError:
    return StoreError(
        f"a part cannot be read: {str(fault).splitlines()[0]}",
        "remove the file and run 'drivetwin fleet' again: its logs are then done anew",
        Where(file=str(path)),
    )


def make_prefixes(count: int) -> list[str]:
    """Return the prefixes by which the keys of `count` logs are divided into large parts.

    The prefixes depend on the number alone, so that the same logs end in the same parts in any
    order.
    """
    found = [""]
    while count > _LOGS_PER_PART * len(found):
        found = [prefix + digit for prefix in found for digit in _HEX]
    return found


def merge_parts(folder: Path, prefix: str, logs: Sequence[str], sources: Sequence[Path]) -> str:
    """Write the large part of `logs` (sorted keys) from the parts that hold them; its name.

    The name is a hash of its logs, so that a part of the same logs is never written twice.
    Raises OSError and StoreError.
    """
    import pyarrow as pa

    digest = hashlib.sha256("\n".join(logs).encode()).hexdigest()[:16]
    name = f"{ROWS}/{prefix or 'all'}-{digest}.parquet"
    if not (folder / name).is_file():
        found = {log: rows for source in sources for log, rows in _iterate_logs(read_rows(source))}
        whole = pa.Table.from_batches([found[log] for log in logs if log in found], make_schema())
        write_bytes(folder / name, _encode_rows(whole))
        sync_folder(folder / ROWS)
    return name


def _iterate_logs(rows: Any) -> Iterator[tuple[str, Any]]:
    """Iterate over the adjacent rows of each log of a part, as record batches without a copy."""
    import pyarrow.compute as pc

    for batch in rows.combine_chunks().to_batches():
        runs = pc.run_end_encode(batch.column("log"))
        start = 0
        for log, end in zip(runs.values.to_pylist(), runs.run_ends.to_pylist(), strict=True):
            yield log, batch.slice(start, end - start)
            start = end


def _encode_rows(whole: Any) -> bytes:
    import pyarrow.parquet as pq

    buffer = BytesIO()
    # Without checksums nearly every flipped bit would come back as another number.
    pq.write_table(whole, buffer, compression="zstd", write_page_checksum=True)
    return buffer.getvalue()


def sync_folder(folder: Path) -> None:
    """Synchronise a folder to disk, if the system supports it, to survive a power failure."""
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)

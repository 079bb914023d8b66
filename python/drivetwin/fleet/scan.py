# SPDX-License-Identifier: MIT
"""From files to tasks: content, rule, key. Only what is needed next is looked at."""

from __future__ import annotations

import hashlib
import json
import math
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from time import monotonic

from drivetwin._util.atomic import compute_digest, measure_regular_file
from drivetwin._util.optional_dependencies import get_program_version
from drivetwin.channels.mapping_file import read_mapping
from drivetwin.errors import DrivetwinError, FileFormatError, Where
from drivetwin.estimation.result.method import Method
from drivetwin.fleet.rules import RulesFile, Source, Sources, name_members, select_rule
from drivetwin.fleet.store import FileRow
from drivetwin.fleet.task import Member, Outcome, State, TaskSpec
from drivetwin.logs.formats.detect import open_recording
from drivetwin.vehicle.card import is_ratio_card

ROWS_FORMAT = 2
"""Counts up when the same identification leaves other rows."""

_READERS = 4
"""Threads that hash files; a disk or network drive answers several at once."""
_LOOKAHEAD = 4 * _READERS
_CHUNK = 2**20
_KEY = 40
"""Hexadecimal digits of a log's key."""


@dataclass(frozen=True)
class Scanned:
    """A scanned file. `recipe` is None if it cannot be used; `fault` then holds the reason.

    `members` are the bus logs of the file's vehicle, each content once; all have the same `log`.
    """

    file: FileRow
    settings: str
    recipe: TaskSpec | None
    fault: Outcome | None = None
    members: tuple[Member, ...] = ()


Known = Callable[[str], FileRow | None]
"""Looks up the index entry of a path."""


@dataclass(frozen=True)
class _Content:
    """A file's SHA-256, size [bytes] and time of change [ns]."""

    digest: str
    size: int
    modified: int


class Scan:
    """Looks at the files of a fleet by its rules, with one method; see `scanned`."""

    def __init__(
        self, rules: RulesFile, method: Method, *, quick: bool = False, seconds: float = math.inf
    ) -> None:
        """Scan by `rules`; reading one file may take `seconds`."""
        self._rules = rules
        self._seconds = seconds
        self._stop = threading.Event()
        self._method, self._quick = method, quick
        self._recipe = lru_cache(self._read_recipe)
        self._is_bus = lru_cache(is_ratio_card)

    def scan_files(self, sources: Sources, known: Known) -> Generator[Scanned | None]:
        """Every file of `sources` in their order, read a little ahead; then bus logs by vehicle.

        None stands for a file that the rules leave out.

        `known` finds what is known of a path: a file of the same size and time of change is not
        read again. Bus logs are those that a rule reads with a card of the ratios alone.
        """
        vehicles: dict[tuple[str, str, str], list[Scanned]] = {}
        for one in self._scan_each(sources, known):
            if one is not None and one.members:
                key = one.file.rule, one.file.unit, one.settings
                vehicles.setdefault(key, []).append(one)
            else:
                yield one
        for logs in vehicles.values():
            yield from _join_vehicle(logs)

    def _scan_each(self, sources: Sources, known: Known) -> Generator[Scanned | None]:
        waiting: deque[tuple[Source, Future[_Content]]] = deque()
        self._stop.clear()
        readers = ThreadPoolExecutor(_READERS)
        try:
            for source in sources:
                entry = known(_format_path(source.path))
                waiting.append((source, readers.submit(self._read_content, source.path, entry)))
                if len(waiting) >= _LOOKAHEAD:
                    yield self._scan_file(*waiting.popleft())
            while waiting:
                yield self._scan_file(*waiting.popleft())
        finally:
            self._stop.set()
            readers.shutdown(cancel_futures=True)

    def _scan_file(self, source: Source, reading: Future[_Content]) -> Scanned | None:
        path = _format_path(source.path)
        unit, content = "", _Content("", 0, 0)
        try:
            content = reading.result()
            unit = self._rules.get_unit(source)
            fields = self._rules.get_fields(source)
            rule = select_rule(self._rules, source, unit, lambda: _read_channel_names(source.path))
            if rule.vehicle is None:
                return None
            recipe = self._recipe(rule.vehicle, rule.channels)
            is_bus = self._is_bus(Path(rule.vehicle))
        except (OSError, DrivetwinError) as fault:
            error = _make_read_error(fault, path) if isinstance(fault, OSError) else fault
            return _make_refusal(path, unit, content, error)
        settings = compute_settings_hash(recipe)
        log = _compute_key(content.digest, settings)
        file = FileRow(
            path, log, content.digest, content.size, content.modified, rule.name, unit, fields
        )
        members = ((path, content.digest),) if is_bus else ()
        return Scanned(file, settings, recipe, members=members)

    def _read_content(self, path: Path, known: FileRow | None) -> _Content:
        """Read content and state of a file, unless it is `known` and did not change.

        Raises FileFormatError for what is no regular file, for one that changes meanwhile or takes
        too long, and for a name that is no text; OSError.
        """
        where = Where(file=_format_path(path))
        if where.file != str(path):
            raise FileFormatError("the file name is no UTF-8 text", "rename the file", where)
        measure_regular_file(path, FileFormatError)
        status = path.stat()
        size, modified = status.st_size, status.st_mtime_ns
        if known is not None and (known.size, known.modified) == (size, modified) and known.content:
            return _Content(known.content, size, modified)
        digest = self._compute_bounded_digest(path, size)
        after = path.stat()
        if (after.st_size, after.st_mtime_ns) != (size, modified):
            raise FileFormatError(
                "the file changed while it was read", "run again when it is complete", where
            )
        return _Content(digest, size, modified)

    def _compute_bounded_digest(self, path: Path, size: int) -> str:
        """Hash the first `size` bytes of a file. Raises FileFormatError after the time limit."""
        digest, deadline = hashlib.sha256(), monotonic() + self._seconds
        with path.open("rb") as file:
            while size > 0 and (chunk := file.read(min(size, _CHUNK))):
                digest.update(chunk)
                size -= len(chunk)
                if self._stop.is_set() or monotonic() > deadline:
                    raise FileFormatError(
                        f"reading took longer than {self._seconds:g} s",
                        "copy the file to a faster disk, or give a larger --time-limit",
                        Where(file=str(path)),
                    )
        return digest.hexdigest()

    def _read_recipe(self, vehicle: str, channels: str | None) -> TaskSpec:
        """The recipe of a rule; its files are read once."""
        return TaskSpec(
            vehicle=vehicle,
            channels=channels,
            method=self._method,
            quick=self._quick,
            inputs=compute_input_hashes(vehicle, channels),
            version=get_program_version(),
            means=self._rules.list_channel_means(),
            mu_slip=self._rules.mu_slip_rad_s,
        )


def _join_vehicle(logs: Sequence[Scanned]) -> Iterator[Scanned]:
    """Give the bus logs of a vehicle one key, which follows from names, contents and settings."""
    files: dict[str, Member] = {}
    for one in sorted(logs, key=lambda log: log.file.path):
        files.setdefault(one.file.content, (one.file.path, one.file.content))
    names = name_members([path for path, _ in files.values()])
    parts = (f"{name} {content}" for name, content in zip(names, files, strict=True))
    log = _compute_key("vehicle", logs[0].settings, *sorted(parts))
    for one in logs:
        yield replace(one, file=replace(one.file, log=log), members=tuple(files.values()))


def compute_input_hashes(vehicle: str, channels: str | None) -> tuple[tuple[str, str], ...]:
    """Compute the SHA-256 of a card, a channel mapping and the DBC files of the mapping."""
    inputs = [("vehicle", _compute_digest(Path(vehicle)))]
    if channels is not None:
        inputs.append(("channels", _compute_digest(Path(channels))))
        databases = read_mapping(Path(channels)).options.bus.databases
        inputs += [("database", _compute_digest(each)) for each in databases]
    return tuple(inputs)


def make_settings_document(recipe: TaskSpec) -> str:
    """Return as JSON the settings that determine a log's rows; paths are not included."""
    tree = {k: v for k, v in asdict(recipe).items() if k not in ("vehicle", "channels")}
    return json.dumps({**tree, "rows": ROWS_FORMAT}, sort_keys=True)


@lru_cache(64)
def compute_settings_hash(recipe: TaskSpec) -> str:
    """Hash of `make_settings_document`."""
    return hashlib.sha256(make_settings_document(recipe).encode()).hexdigest()


def _compute_key(*parts: str) -> str:
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:_KEY]


def _compute_digest(path: Path) -> str:
    measure_regular_file(path, FileFormatError)
    return compute_digest(path)


def _format_path(path: Path) -> str:
    """Return a path as text; bytes of names that are no UTF-8 become escapes."""
    return str(path).encode("utf-8", "backslashreplace").decode()


def _read_channel_names(path: Path) -> frozenset[str]:
    with open_recording(path) as recording:
        return frozenset(column.name for column in recording.columns)


def _make_read_error(fault: OSError, path: str) -> DrivetwinError:
    what = f"cannot read the file: {fault.strerror or fault}"
    return FileFormatError(what, "check that it is there and may be read", Where(file=path))


def _make_refusal(path: str, unit: str, content: _Content, error: DrivetwinError) -> Scanned:
    """Return a file that cannot become a task; the next run scans it again."""
    outcome = Outcome(State.BAD, (), type(error).__name__, error.what, error.remedy)
    log = _compute_key("refused", content.digest or path, unit, error.what)
    file = FileRow(path, log, content.digest, content.size, content.modified, "", unit, {})
    return Scanned(file, "", None, outcome)

# SPDX-License-Identifier: MIT
"""Files of the workbench: its one folder, uploads, and sessions that were saved as JSON.

Uploads are streamed to disk, limited in size, checked, never executed. An upload is bytes under a
name of our own; the name that the browser gives is a label. Its content is parsed in a process of
its own (see `sandboxed_parse.py`).
"""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Annotated, Literal

from pydantic import Field, ValidationError, field_validator

from drivetwin._util.atomic import compute_digest, write_bytes, write_text
from drivetwin._util.optional_dependencies import get_program_version
from drivetwin._util.toml import FromTable, StrictModel, format_key_path
from drivetwin.channels.mapping_file import ChannelTable
from drivetwin.channels.roles import get_quantity
from drivetwin.dyno import ScenarioName
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import format_card, format_log, load_scenario
from drivetwin.errors import RefusedError, Where
from drivetwin.files.twin_file import TwinFile, build_twin_file, restore_twin
from drivetwin.vehicle.locks import Lock
from drivetwin.workbench.forms import Corrections
from drivetwin.workbench.identifying import Boundary, Outcome
from drivetwin.workbench.session_state import MOST_LOGS, OpenLog, SessionState, Source

LIMITS = {
    "log": 200 * 2**20,  # ten minutes of 40 channels at 1 kHz; larger ones are opened by path
    "card": 2 * 2**20,
    "workspace": 20 * 2**20,  # three twins take some 0.3 MB
}
"""Bytes that an upload may have, by what it is for."""
_CHUNK = 2**18
_LONGEST_NAME = 200


def make_label(name: str) -> str:
    """The name that an upload is shown under. Raises RefusedError for one that is a path or none.

    Names are compared after NFKC: a full-width slash is a slash.
    """
    plain = unicodedata.normalize("NFKC", name)
    bad = any(unicodedata.category(one).startswith("C") for one in plain)
    if bad or len(name) > _LONGEST_NAME or re.search(r"[/\\:*?\"<>|]|^\.|^\s*$", plain):
        raise RefusedError(
            "this is no plain file name", "rename the file and upload it again",
            Where(file=repr(name[:80])),
        )  # fmt: skip
    return name


def store_stream(
    stream: IO[bytes], name: str, claimed: int | None, target: Path, limit: int
) -> Source:
    """Write at most `limit` bytes of `stream` to `target`; delete the file if it is refused.

    `claimed` is the length that the browser states, None where it states none.
    Raises RefusedError for a bad name, too many bytes, claimed or sent, and for none at all.
    """
    label = make_label(name)
    if claimed is not None and claimed > limit:
        raise _make_size_error(label, f"{claimed / 1e6:.0f} MB", limit)
    try:
        with target.open("xb") as file:
            size = _copy(stream, file, limit)
        if size > limit:
            raise _make_size_error(label, "more", limit)
        if size == 0:
            raise RefusedError("the file is empty", "upload a file", Where(file=label))
        if claimed is not None and size != claimed:
            raise RefusedError(
                f"{size} of {claimed} bytes arrived", "upload the file again", Where(file=label)
            )
    except BaseException:
        target.unlink(missing_ok=True)
        raise
    return Source(label, target, uploaded=True)


def _copy(stream: IO[bytes], file: IO[bytes], limit: int) -> int:
    """Copy until the end or the first chunk beyond `limit`; returns the bytes seen."""
    size = 0
    while chunk := stream.read(_CHUNK):
        size += len(chunk)
        if size > limit:
            break
        file.write(chunk)
    return size


def _make_size_error(label: str, size: str, limit: int) -> RefusedError:
    return RefusedError(
        f"the file has {size}, the limit is {limit / 1e6:.0f} MB",
        "copy it into the folder of the workbench and open it by its path, or cut the log",
        Where(file=label),
    )


MAX_LISTED = 300
"""Names offered for completion; any other file of the folder can still be typed."""
MAX_DEPTH = 3
"""Levels of folders that are looked into for names to offer."""


@dataclass(frozen=True)
class Folder:
    """A folder by its `root`, absolute and with all links resolved."""

    root: Path

    @classmethod
    def from_path(cls, path: Path) -> Folder:
        """Open the folder at `path`; raise RefusedError if it does not exist."""
        root = path.resolve()
        if not root.is_dir():
            raise RefusedError("this is no folder", "start in a folder", Where(file=str(path)))
        return cls(root)

    def get_file(self, name: str) -> Path:
        """A regular file inside the folder by its path in it; links are followed, then checked.

        Raises RefusedError for a path that leads outside, to nothing, or to no regular file.
        """
        path = self._resolve_inside(name)
        if not path.is_file():
            raise RefusedError(
                "there is no such file in the folder of the workbench",
                f"give a path inside {self.root}, or upload the file",
                Where(file=name),
            )
        return path

    def make_new_path(self, name: str, suffix: str) -> Path:
        """Return the path of a new file called `name`; append `suffix` if it is missing.

        Raises RefusedError for a path that leads outside, into a folder that does not exist, or to
        something that is no regular file.
        """
        path = self._resolve_inside(name if name.endswith(suffix) else name + suffix)
        is_other = path.exists() and not path.is_file()
        if path.name == suffix or not path.parent.is_dir() or is_other:
            raise RefusedError(
                "no file can be written there",
                f"give a name in an existing folder inside {self.root}",
                Where(file=name),
            )
        return path

    def get_name(self, path: Path) -> str:
        """Return the path of a file relative to the folder, with forward slashes."""
        return path.relative_to(self.root).as_posix()

    def list_names(self, endings: Collection[str]) -> list[str]:
        """Names of files with one of the `endings`, for completion; hidden ones are left out."""
        found = sorted(name for name in self._walk() if name.lower().endswith(tuple(endings)))
        return found[:MAX_LISTED]

    def _resolve_inside(self, name: str) -> Path:
        what = "this path leads outside the folder of the workbench"
        try:
            path = (self.root / name.strip()).resolve()
            path.exists()  # raises an error for a string that is not a valid path
        except (OSError, ValueError, RuntimeError):
            path, what = Path("/"), "this is no path"
        if not name.strip():
            path, what = Path("/"), "no file is named"
        if not path.is_relative_to(self.root):
            remedy = f"give a path inside {self.root}, or upload the file"
            raise RefusedError(what, remedy, Where(file=name[:200] or None))
        return path

    def _walk(self) -> Iterator[str]:
        for folder, inner, files in os.walk(self.root):
            place = Path(folder).relative_to(self.root)
            deep = len(place.parts) >= MAX_DEPTH
            inner[:] = [] if deep else sorted(one for one in inner if not one.startswith("."))
            yield from ((place / one).as_posix() for one in files if not one.startswith("."))


ENDING = ".workspace.json"
LARGEST = LIMITS["workspace"]


class FileEntry(StrictModel):
    """A file of the folder by its path there, and what it held when the workspace was saved."""

    path: str = Field(min_length=1, max_length=1000)
    sha256: str = Field(pattern="^[0-9a-f]{64}$")


class LogEntry(StrictModel):
    """A log with corrections of its mapping: `channels` by role, `ignored` columns, `time_unit`.

    `phases` [s] go by index of the shift; `held` are the indices of the shifts to predict.
    """

    file: FileEntry
    channels: dict[str, ChannelTable] = Field(default_factory=dict)
    ignored: list[str] = Field(default_factory=list)
    time_unit: str | None = Field(default=None, max_length=40)
    phases: dict[int, dict[Boundary, float]] = Field(default_factory=dict)
    held: list[int] = Field(default_factory=list)

    @field_validator("channels")
    @classmethod
    def _check_roles(cls, channels: dict[str, ChannelTable]) -> dict[str, ChannelTable]:
        for role in channels:
            try:
                get_quantity(role)
            except KeyError:
                raise ValueError(f"{role!r} is no channel role") from None
        return channels

    def to_corrections(self) -> Corrections:
        """Return the corrections of the mapping."""
        return Corrections(self.channels, tuple(self.ignored), self.time_unit)


class WorkspaceFile(StrictModel):
    """The whole file. `twins` go by the name of the log, `sliders` (SI) by parameter id."""

    format: Literal["drivetwin workspace"] = "drivetwin workspace"
    version: Literal[3] = 3
    program: str
    logs: list[LogEntry] = Field(min_length=1, max_length=MOST_LOGS)
    card: FileEntry
    log: int = Field(default=0, ge=0)
    locks: dict[str, Annotated[Lock, FromTable]] = Field(default_factory=dict)
    twins: dict[str, TwinFile] = Field(default_factory=dict)
    shift: int = Field(default=0, ge=0)
    sliders: dict[str, float] = Field(default_factory=dict)

    @field_validator("logs")
    @classmethod
    def _check_names(cls, logs: list[LogEntry]) -> list[LogEntry]:
        """Refuse a log that is listed twice, as results go by the name of their log."""
        if len({one.file.path for one in logs}) < len(logs):
            raise ValueError("a log is listed twice")
        return logs


def save_workspace(work: SessionState, path: Path, folder: Folder) -> None:
    """Write the workspace; the file appears whole or not at all.

    Uploaded files are kept beside it, so that it can be reopened. Raises InputError before a log is
    open, RefusedError where another file has the name of an upload or of the workspace, OSError.
    """
    work.require_opened()
    if path.exists() and not _is_workspace(path):
        raise RefusedError(
            "a file of this name exists and is no workspace", "choose another name",
            Where(file=path.name),
        )  # fmt: skip
    twins = {} if work.result is None else work.result.twins
    content = WorkspaceFile(
        program=get_program_version(),
        logs=[_make_log_entry(one, path.parent, folder) for one in work.logs],
        card=_make_file_entry(work.card, path.parent, folder),
        log=work.at,
        locks=dict(work.locks),
        twins={name: build_twin_file(twin) for name, twin in twins.items()},
        shift=work.shift,
        sliders=dict(work.changes),
    )
    write_text(path, content.model_dump_json(by_alias=True, indent=1) + "\n")


def load_workspace(path: Path, label: str) -> WorkspaceFile:
    """Read a workspace. Raises RefusedError that names every fault by its key."""
    where = Where(file=label)
    if path.stat().st_size > LARGEST:
        text = f"the file has more than {LARGEST / 1e6:.0f} MB"
        raise RefusedError(text, "open a workspace that the workbench has saved", where)
    try:
        return WorkspaceFile.model_validate_json(path.read_bytes())
    except ValidationError as error:
        faults = error.errors(include_url=False, include_context=False, include_input=False)
        listed = "; ".join(
            f"{format_key_path(one['loc'])} {one['msg']}".strip() for one in faults[:5]
        )
        raise RefusedError(
            f"this is no workspace of this version: {listed}",
            "open a workspace that the workbench has saved",
            where,
        ) from None


def locate_sources(
    content: WorkspaceFile, folder: Folder, label: str
) -> tuple[list[Source], Source]:
    """Locate logs and card of a workspace in the folder. Raises RefusedError if one has changed."""
    logs = [_locate_source(one.file, folder, label) for one in content.logs]
    return logs, _locate_source(content.card, folder, label)


def restore_workspace(content: WorkspaceFile, work: SessionState) -> SessionState:
    """Return `work`, whose logs were read again, with the saved state of the workspace.

    Raises InputError where phases, locks or sliders do not belong to the logs.
    """
    for index, entry in enumerate(content.logs):
        work = work.select_log(index)
        for shift, times in entry.phases.items():
            work = work.apply_moves(shift, times)
    work = work.hold_out([frozenset(entry.held) for entry in content.logs])
    for name, lock in content.locks.items():
        work = work.set_lock(name, lock)
    work = work.select_log(content.log)
    if content.twins:
        twins = {name: restore_twin(twin) for name, twin in content.twins.items()}
        work = work.add_result(Outcome(twins))
        if content.shift < len(work.shifts):
            work = replace(work, shift=content.shift, changes=dict(content.sliders))
    return work


def _locate_source(entry: FileEntry, folder: Folder, label: str) -> Source:
    path = folder.get_file(entry.path)
    if compute_digest(path) != entry.sha256:
        raise RefusedError(
            f"{entry.path} is no longer the file that the workspace was saved with",
            "put the original file back, or open the changed one as a new log",
            Where(file=label),
        )
    return Source(entry.path, path)


def _make_log_entry(one: OpenLog, beside: Path, folder: Folder) -> LogEntry:
    return LogEntry(
        file=_make_file_entry(one.source, beside, folder),
        channels=dict(one.corrections.channels),
        ignored=list(one.corrections.ignored),
        time_unit=one.corrections.time_unit,
        phases={index: dict(times) for index, times in one.moves.items()},
        held=sorted(one.held),
    )


def _make_file_entry(source: Source | None, beside: Path, folder: Folder) -> FileEntry:
    if source is None:
        raise RefusedError("no vehicle card is open", "open one in the step Card")
    if not source.uploaded:
        return FileEntry(path=source.name, sha256=compute_digest(source.path))
    target = folder.make_new_path(folder.get_name(beside / source.name), "")
    content = compute_digest(source.path)
    if target.exists() and compute_digest(target) != content:
        raise RefusedError(
            f"the upload {source.name} cannot be kept: another file has its name",
            "save the workspace into another folder",
            Where(file=source.name),
        )
    if not target.exists():
        write_bytes(target, source.path.read_bytes())
    return FileEntry(path=folder.get_name(target), sha256=content)


def _is_workspace(path: Path) -> bool:
    try:
        load_workspace(path, path.name)
    except RefusedError:
        return False
    return True


LOG, CARD = "sample.csv", "sample.card.toml"


def write_sample(folder: Path) -> tuple[Path, Path]:
    """Write log and vehicle card of the sample into a folder; return their paths."""
    made = run(load_scenario(ScenarioName.PAPER_STEPS), seed=1)
    log, card = folder / LOG, folder / CARD
    log.write_text(format_log(made), encoding="utf-8", newline="\n")
    card.write_text(format_card(made.scenario), encoding="utf-8", newline="\n")
    return log, card

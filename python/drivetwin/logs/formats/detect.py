# SPDX-License-Identifier: MIT
"""Detection of the file format from the first bytes, and opening with a channel mapping."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

from drivetwin._util.atomic import measure_regular_file
from drivetwin.channels.mapping import Mapped, recall_options
from drivetwin.channels.mapping_file import describe_way_on
from drivetwin.channels.roles import ReadOptions
from drivetwin.errors import DrivetwinError, FileFormatError, MappingError, Where
from drivetwin.findings import Code, report
from drivetwin.logs.formats.can.texts import refuse_bus_tool
from drivetwin.logs.formats.guarded import open_guarded
from drivetwin.logs.raw import HEAD_BYTES, Joined, Opener, Recording
from drivetwin.vehicle.card import VehicleCard


@dataclass(frozen=True)
class LogFormat:
    """Registered format of logs.

    A file has it if it starts with one of `starts`, or if `recognises` is True for its first
    bytes. A folder is searched for files with its `endings`. With `guarded` the file is read in a
    child process, because the library trusts damaged bytes. `plain` opens simple files of a guarded
    format without that library, and returns None for the others.

    `opener`, `recognises` and `plain` name functions of modules of this folder, such as
    `mdf.open_mdf`. A module is imported when a file may have its format.
    """

    opener: str
    endings: tuple[str, ...]
    starts: tuple[bytes, ...] = ()
    recognises: str | None = None
    guarded: bool = False
    plain: str | None = None

    def load_opener(self) -> Opener:
        """Import the function that opens a file."""
        opener: Opener = _import_function(self.opener)
        return opener

    def open_plain(
        self, path: Path, options: ReadOptions
    ) -> AbstractContextManager[Recording] | None:
        """Open a simple file without the library of the format; None for other files."""
        if self.plain is None:
            return None
        found: AbstractContextManager[Recording] | None = _import_function(self.plain)(
            path, options
        )
        return found

    def fits(self, head: bytes) -> bool:
        """Return whether a file with these first bytes and no mark has the format."""
        return self.recognises is not None and bool(_import_function(self.recognises)(head))


def _import_function(name: str) -> Any:
    module, _, function = name.rpartition(".")
    return getattr(import_module(f"drivetwin.logs.formats.{module}"), function)


_CSV = LogFormat("csv.open_csv", (".csv", ".txt", ".tsv", ".dat", ".lvm", ".msl", ".vbo"))
FORMATS: tuple[LogFormat, ...] = (
    LogFormat(
        "mdf.open_mdf",
        (".mf4", ".mdf"),
        (b"MDF     ", b"UnFinMF "),
        guarded=True,
        plain="mdf_plain.open_plain",
    ),
    LogFormat(
        "mat.open_mat",
        (".mat",),
        (b"MATLAB 5.0", b"MATLAB 7.3"),
        recognises="mat.is_version4",
        guarded=True,
    ),
    LogFormat("parquet.open_parquet", (".parquet",), (b"PAR1",), guarded=True),
    LogFormat("parquet.open_arrow", (".feather", ".arrow"), (b"ARROW1",), guarded=True),
    LogFormat("can.open.open_blf", (".blf",), (b"LOGG",), guarded=True),
    LogFormat(
        "can.open.open_bus_text", (".asc", ".trc", ".log"), recognises="can.texts.is_bus_text"
    ),
    _CSV,
)
"""Formats in the order in which they are tried; a file that none of them recognises is CSV."""

SUFFIXES = frozenset(ending for one in FORMATS for ending in one.endings)
"""Endings by which a folder's logs are known; a file that is named by itself may have any."""

_REFUSED = {
    b"\x89HDF": "an HDF5 file without MATLAB header",
    b"PK\x03\x04": "a zip archive or Excel workbook",
    b"\x1f\x8b": "a gzip archive",
}
"""First bytes of unsupported formats that an error names instead of `binary`."""


def is_binary_log(head: bytes) -> bool:
    """Return whether the first bytes of a file are those of a binary log format."""
    return any(head.startswith(one.starts) for one in FORMATS if one.starts)


def open_recording(
    path: Path, options: ReadOptions | None = None
) -> AbstractContextManager[Recording]:
    """Open a log of any format for reading its columns one by one.

    Libraries for binary formats run in a child process, see `open_guarded`; plain MDF 4 files need
    none. Raises FileFormatError where the file cannot be read, MissingExtraError where the library
    for its format is not installed, and the errors of its reader.
    """
    measure_regular_file(path, FileFormatError)
    try:
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
    except OSError as fault:
        what = f"cannot read the file: {fault.strerror}"
        raise FileFormatError(what, "check the path", Where(file=str(path))) from None
    chosen = _select_format(head, path)
    options = options or ReadOptions()
    if (plain := chosen.open_plain(path, options)) is not None:
        return _add_net_torque(plain)
    if chosen.guarded:
        return _add_net_torque(open_guarded(chosen.load_opener(), path, options))
    return _add_net_torque(chosen.load_opener()(path, options))


@contextmanager
def _add_net_torque(opened: AbstractContextManager[Recording]) -> Iterator[Recording]:
    """Add the net torque of the engine where a decoded bus has it in percent."""
    with opened as recording:
        if not any("percenttorque" in one.name.casefold() for one in recording.columns):
            yield recording
            return
        from drivetwin.logs.formats.can.j1939 import find_net_torque  # few logs are of a bus

        net = find_net_torque(recording)
        yield recording if net is None else Joined((recording, net))


def _select_format(head: bytes, path: Path) -> LogFormat:
    for one in FORMATS:
        if one.starts and head.startswith(one.starts):
            return one
    for magic, name in _REFUSED.items():
        if head.startswith(magic):
            raise FileFormatError(
                f"this is {name}, for which there is no reader",
                "export the channels as CSV with a row of units, MDF 4, MATLAB or Parquet, frames "
                "of a bus as ASC, BLF, TRC or candump",
                Where(file=str(path)),
            )
    for one in FORMATS:
        if one.fits(head):
            return one
    refuse_bus_tool(head, path)
    return _CSV


NOTHING_STATED = Mapped({})
"""Mapping of a log without a mapping file."""


@contextmanager
def open_as_mapped(
    path: Path, stated: Mapped, card: VehicleCard | None
) -> Iterator[tuple[Recording, Mapped]]:
    """Open a log with the `stated` options, completed by the remembered ones of the twin.

    Yields the recording and the mapping with the options that were used. A log that cannot be
    opened with the remembered options is opened without them. See `open_stated`.
    """
    bare = NOTHING_STATED
    with ExitStack() as stack:
        if card is not None:
            completed = _complete_options(stated, card, path)
            if completed != stated:
                bare = _complete_options(NOTHING_STATED, card, path)
                try:
                    opened = stack.enter_context(open_stated(path, completed, bare))
                except DrivetwinError:
                    bare = NOTHING_STATED
                else:
                    yield opened
                    return
        yield stack.enter_context(open_stated(path, stated, bare))


def _complete_options(stated: Mapped, card: VehicleCard, path: Path) -> Mapped:
    """Complete the options of a mapping by the remembered options of the twin of the card."""
    options = recall_options(stated.options, card.remembered.options, path.parent)
    if options == stated.options:
        return stated
    findings = (*stated.findings, report(Code.OPTIONS_REMEMBERED))
    return replace(stated, options=options, findings=findings)


@contextmanager
def open_stated(
    path: Path, stated: Mapped, bare: Mapped = NOTHING_STATED
) -> Iterator[tuple[Recording, Mapped]]:
    """Open a log with a mapping; yield the recording and the mapping that applies.

    A mapping found beside the log that fits no column is reported and not applied; the log is then
    opened with the mapping `bare`. Raises the errors of `open_recording`.
    """
    with ExitStack() as stack:
        refusal: DrivetwinError | None = None
        try:
            with name_project_mapping(stated, opening=True):
                recording = stack.enter_context(open_recording(path, stated.options))
        except DrivetwinError as fault:
            if not (stated.beside and stated.channels) or stated.options == bare.options:
                raise
            refusal = fault
        if refusal is None and _fits(stated, recording):
            yield recording, stated
            return
        if refusal is not None or stated.options != bare.options:
            recording = _open_bare(stack, path, bare, refusal)
            if refusal is not None and _fits(stated, recording):
                raise refusal
        absent = ", ".join(repr(spec.source) for spec in stated.channels.values())
        finding = report(Code.MAPPING_NOT_APPLIED, file=str(stated.file), columns=absent)
        yield recording, replace(bare, findings=(*bare.findings, finding))


def _open_bare(
    stack: ExitStack, path: Path, bare: Mapped, refusal: DrivetwinError | None
) -> Recording:
    """Open a log with the mapping `bare`; raises the `refusal` with the other mapping, if any."""
    try:
        return stack.enter_context(open_recording(path, bare.options))
    except DrivetwinError as fault:
        raise refusal or fault from None


def _fits(stated: Mapped, recording: Recording) -> bool:
    """Return False if the mapping was found beside the log and fits no column."""
    if not stated.beside or not stated.channels:
        return True
    specs = stated.channels.values()
    return any(spec.matches(column) for column in recording.columns for spec in specs)


@contextmanager
def name_project_mapping(stated: Mapped, *, opening: bool = False) -> Iterator[None]:
    """Add to errors that a mapping beside the log may cause how to go on without the mapping.

    These are errors of the mapping, of the channels that it maps and, while `opening` a log, of its
    options.
    """
    try:
        yield
    except DrivetwinError as fault:
        mapped = any(fault.where.channel == spec.source for spec in stated.channels.values())
        caused = isinstance(fault, MappingError) or mapped
        if opening:
            caused = caused or stated.options != ReadOptions()
        if stated.beside and stated.file is not None and caused:
            fault.remedy += f"; {describe_way_on(stated.file)}"
        raise

# SPDX-License-Identifier: MIT
"""Opening of a log with the options of its channel mapping."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

from drivetwin.channels.mapping import Mapped, recall_options
from drivetwin.channels.mapping_file import describe_way_on
from drivetwin.channels.read_options import ReadOptions
from drivetwin.errors import DrivetwinError, MappingError
from drivetwin.findings import Code, report
from drivetwin.logs.formats.detect import open_recording
from drivetwin.logs.raw import Recording
from drivetwin.vehicle.card import VehicleCard

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

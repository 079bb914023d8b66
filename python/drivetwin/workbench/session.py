# SPDX-License-Identifier: MIT
"""Sessions of a server, one for each tab: work, running job, scratch folder in that of the run."""

from __future__ import annotations

import secrets
import shutil
import tempfile
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import wraps
from pathlib import Path
from typing import IO, Any, Concatenate, ParamSpec, TypeVar

from drivetwin._util.atomic import (
    FOLDER_PREFIX,
    make_owner_name,
    remove_unfinished,
    write_text,
)
from drivetwin.authoring.card_text import refuse_faults
from drivetwin.authoring.log_survey import LogSurvey
from drivetwin.authoring.question import Key
from drivetwin.channels.mapping_file import find_project_mapping
from drivetwin.errors import InputError, RefusedError, Where
from drivetwin.estimation.result.validation import Validation
from drivetwin.logs.formats.guarded import compute_parser_limits
from drivetwin.report.figure import Figure
from drivetwin.workbench import jobs, sandboxed_parse, what_if, workspace
from drivetwin.workbench.forms import CardForm, Corrections, Entry, apply_entries
from drivetwin.workbench.identifying import Task, identify_bus_logs, identify_logs
from drivetwin.workbench.sandboxed_parse import ColumnKey, Preview, make_column_key
from drivetwin.workbench.session_state import MOST_LOGS, OpenLog, SessionState, Source
from drivetwin.workbench.what_if import View
from drivetwin.workbench.workspace import Folder

MOST_UPLOADS = 8
"""Maximum number of uploads of a session; the oldest one that is not open is deleted.

Above `MOST_LOGS`, as all logs and the card may be uploads.
"""


CARD_TEXT: Key = ("text",)
"""Key of the text of an edited card."""


@dataclass(frozen=True, eq=False)
class Live:
    """State of the sliders' simulation: identified run, present run and the figure of both."""

    identified: Validation
    present: Validation
    figure: Figure


P = ParamSpec("P")
R = TypeVar("R")


def _hold_lock(
    method: Callable[Concatenate[Session, P], R],
) -> Callable[Concatenate[Session, P], R]:
    """Return a method during which the lock of its session is held."""

    @wraps(method)
    def locked(self: Session, /, *args: P.args, **kwargs: P.kwargs) -> R:
        with self.lock:
            return method(self, *args, **kwargs)

    return locked


@dataclass(eq=False)
class Session:
    """Mutable shell around an immutable `SessionState`; every change holds its lock."""

    folder: Folder
    scratch: Path
    work: SessionState = field(default_factory=SessionState)
    job: jobs.Job | None = None
    live: Live | None = None
    uploads: dict[str, Source] = field(default_factory=dict)
    form: CardForm | None = None
    preview: tuple[ColumnKey, Preview] | None = None
    view: View | None = None
    lock: threading.RLock = field(default_factory=threading.RLock)

    def store_upload(self, stream: IO[bytes], name: str, claimed: int | None, limit: int) -> str:
        """Take an upload; returns the key to open it by. Raises RefusedError."""
        key = secrets.token_hex(8)
        upload = workspace.store_stream(stream, name, claimed, self.scratch / key, limit)
        with self.lock:
            used = {one.source.path for one in self.work.logs}
            used |= set() if self.work.card is None else {self.work.card.path}
            while len(self.uploads) >= MOST_UPLOADS:
                oldest = next(k for k, one in self.uploads.items() if one.path not in used)
                self.uploads.pop(oldest).path.unlink(missing_ok=True)
            self.uploads[key] = upload
        return key

    def get_uploaded(self, key: str) -> Source:
        """Return an upload by its key. Raises RefusedError if it was deleted."""
        if key not in self.uploads:
            raise RefusedError("this upload is no longer there", "upload the file again")
        return self.uploads[key]

    def get_folder_source(self, name: str) -> Source:
        """A file of the folder. Raises RefusedError for a path that leads elsewhere."""
        path = self.folder.get_file(name)
        return Source(self.folder.get_name(path), path)

    @_hold_lock
    def open(self, log: Source, card: Source | None = None, mapping: Path | None = None) -> None:
        """Open a log, with its card if there is one; discard the work on the previous logs.

        Raises the typed errors of the readers; the work stays as it was then, and goes on.
        """
        fresh = self._read_log(log, card, mapping, Corrections())
        self.cancel()
        self._set(SessionState(logs=(fresh,), card=card))
        self.form = None

    def open_log(self, log: Source) -> None:
        """Open a log with the card that is open, if any; see `open`."""
        self.open(log, self.work.card)

    @_hold_lock
    def add_log(self, log: Source) -> None:
        """Open a log of the same vehicle beside the others, read as the selected one is mapped.

        Raises InputError for a log that is open or one too many, and the errors of the readers.
        """
        work, like = self.work, self.work.require_open_log()
        if log.name in (one.source.name for one in work.logs):
            raise InputError(f"a log called {log.name} is open", "rename one of them")
        if len(work.logs) >= MOST_LOGS:
            raise InputError(
                f"{MOST_LOGS} logs are open, which is the limit", "remove one in the step Log"
            )
        fresh = self._read_log(log, work.card, like.mapping, like.corrections)
        self.cancel()
        self._set(replace(work, logs=(*work.logs, fresh)).drop_results())

    @_hold_lock
    def update(self, change: Callable[[SessionState], SessionState]) -> None:
        """Change the state. Errors of the change pass on; the state stays as it was then."""
        self._set(change(self.work))

    @_hold_lock
    def open_card(self, card: Source) -> None:
        """Open a card for the open logs; results on another card are discarded.

        Raises the typed errors of the readers; the work stays as it was then, and goes on.
        """
        self.work.require_opened()
        logs = tuple(
            self._read_log(one.source, card, one.mapping, one.corrections) for one in self.work.logs
        )
        self.cancel()
        self._set(replace(self.work, logs=logs, card=card, locks={}, shift=0).drop_results())

    def open_sample(self) -> None:
        """Open a synthetic log with its card, as an example."""
        log, card = workspace.write_sample(self.scratch)
        self.open(Source(log.name, log, uploaded=True), Source(card.name, card, uploaded=True))

    @_hold_lock
    def read_column(self, index: int) -> Preview:
        """Read the column `index` of the survey as recorded. Raises InputError without numbers."""
        one = self.work.require_open_log()
        key = make_column_key(one.opened.survey, index)
        if self.preview is None or self.preview[0] != key:
            corrections = Corrections(time_unit=one.corrections.time_unit)
            request = _make_request(one.source, self.work.card, one.mapping, corrections)
            limit = compute_parser_limits(request.log).seconds
            preview = jobs.call(sandboxed_parse.read_column, request, key, limit=limit)
            self.preview = (key, preview)
        return self.preview[1]

    @_hold_lock
    def begin_card(self) -> None:
        """Begin the form of a new card from the log. Raises the typed errors of the readers."""
        one = self.work.require_open_log()
        request = _make_request(one.source, None, one.mapping, one.corrections)
        surveyed: LogSurvey = jobs.call(
            sandboxed_parse.survey_for_card,
            request,
            self.scratch / "mapping.toml",
            limit=compute_parser_limits(request.log).seconds,
        )
        self.form = CardForm(surveyed)
        self.form.fill_in({})

    @_hold_lock
    def write_card(self, name: str, texts: Mapping[Key, str], *, can_replace: bool) -> Source:
        """Write the card of the form into the folder; over an existing file only if that may be.

        Raises InputError for open answers, RefusedError for a name that cannot be or exists.
        """
        if self.form is None:
            raise InputError("no card is begun", "press Begin a card from the log first")
        path = self.folder.make_new_path(name, ".toml")
        self.form.file_name = path.name
        self.form.fill_in({key: text for key, text in texts.items() if text})
        return self._write_text(path, self.form.format_card(path.name), can_replace)

    @_hold_lock
    def write_edited_card(
        self, name: str, texts: Mapping[Key, str], *, can_replace: bool
    ) -> Source:
        """Write the text of a card under CARD_TEXT into the folder; see `write_card`.

        Raises CardError with all faults of the text.
        """
        path = self.folder.make_new_path(name, ".toml")
        text = texts.get(CARD_TEXT, "")
        refuse_faults(text, path.name)
        return self._write_text(path, text, can_replace)

    def read_card_text(self) -> str:
        """Return the text of the open vehicle card. Raises InputError without one."""
        self.work.require_card()
        card = self.work.card
        return "" if card is None else card.path.read_text(encoding="utf-8-sig")

    @_hold_lock
    def correct_mapping(self, entries: Sequence[Entry], time_unit: str = "") -> None:
        """Read the selected log again with the corrected mapping; discard the previous results.

        Raises MappingError, UnitError; the work stays as it was then, and goes on.
        """
        one = self.work.require_open_log()
        corrections = apply_entries(one.opened.survey, entries, time_unit)
        fresh = self._read_log(one.source, self.work.card, one.mapping, corrections)
        self.cancel()
        self._set(self.work.set_log(fresh))

    @_hold_lock
    def identify(self, *, is_quick: bool = False) -> None:
        """Start the identification in a separate process; with `is_quick` of one model alone.

        Raises InputError on failure.
        """
        if self.job is not None:
            raise InputError("an identification is running", "wait for it or cancel it")
        work = self.work
        if work.ratios is not None:
            bus = work.build_bus_task()
            self._set(work.drop_results())
            self.job = jobs.start(identify_bus_logs, bus)
            return
        task = Task(work.build_sources(), work.apply_locks_to_card(), is_quick)
        self._set(work.drop_results())
        self.job = jobs.start(identify_logs, task)

    @_hold_lock
    def collect_job_results(self) -> bool:
        """Take in what the job has found; True where something came or it ended."""
        if self.job is None:
            return False
        results = self.job.get_results()
        for result in results:
            self._set(self.work.add_result(result))
        if not self.job.finished:
            return bool(results)
        fault, self.job = self.job.fault, None
        if fault is not None:
            error = fault.to_error()
            self._set(replace(self.work, ended=error.format_for_shell()))
            raise error
        return True

    @_hold_lock
    def cancel(self) -> None:
        """Stop the running job, if any; results that have come in stay."""
        if self.job is not None:
            self.job.cancel()
            self.job = None

    @_hold_lock
    def set_view(self, view: View) -> bool:
        """Note the time window that was zoomed to.

        Returns True if another shift was selected: the only one in the window, unless sliders of
        the selected one were moved.
        """
        inside = [
            k for k, one in enumerate(self.work.shifts) if view[0] <= one.lockup_time <= view[1]
        ]
        can_select = len(inside) == 1 and not self.work.changes
        is_other = can_select and inside[0] != self.work.shift
        if is_other:
            self._set(replace(self.work, shift=inside[0]))
        self.view = view
        return is_other

    @_hold_lock
    def get_simulation(self) -> Live:
        """Run and figure at the present sliders. Raises what the simulation needs and lacks."""
        if self.live is None:
            work = self.work = replace(self.work, has_viewed=True)
            twin, log = work.require_twin(), work.require_log()
            identified = what_if.simulate_identified(twin, log, work.require_shift())
            present = what_if.simulate_changes(identified, twin, log, work.changes)
            self.live = Live(identified, present, what_if.plot_what_if(identified, present))
        return self.live

    @_hold_lock
    def apply_sliders(self, changes: Mapping[str, float]) -> dict[int, dict[str, Any]]:
        """Simulate with other parameters (SI); returns what changes in the figure, by trace."""
        live, work = self.get_simulation(), self.work
        present = what_if.simulate_changes(
            live.identified, work.require_twin(), work.require_log(), changes
        )
        self.work = replace(work, changes=dict(changes))
        self.live = replace(live, present=present)
        return what_if.collect_changed_curves(live.figure, present, self.view)

    @_hold_lock
    def save(self, name: str) -> str:
        """Save the workspace in the folder; returns the name it has there."""
        path = self.folder.make_new_path(name, workspace.ENDING)
        workspace.save_workspace(self.work, path, self.folder)
        return self.folder.get_name(path)

    @_hold_lock
    def reopen(self, source: Source) -> None:
        """Go on with a saved workspace. Raises RefusedError, and the errors of log and card."""
        content = workspace.load_workspace(source.path, source.name)
        logs, card = workspace.locate_sources(content, self.folder, source.name)
        read = tuple(
            self._read_log(one, card, None, entry.to_corrections())
            for one, entry in zip(logs, content.logs, strict=True)
        )
        work = workspace.restore_workspace(content, SessionState(logs=read, card=card))
        self.cancel()
        self._set(work)

    def close(self) -> None:
        """Stop what runs and remove the scratch folder."""
        self.cancel()
        shutil.rmtree(self.scratch, ignore_errors=True)

    def _set(self, work: SessionState) -> None:
        if work.log != self.work.log:
            self.preview = None
        if (work.log, work.shift) != (self.work.log, self.work.shift):
            self.view = None
        self.work = work
        self.live = None

    def _write_text(self, path: Path, text: str, can_replace: bool) -> Source:
        if path.exists() and not can_replace:
            raise RefusedError(
                "this file exists", "choose another name, or 'replace it' beside the name",
                Where(file=path.name),
            )  # fmt: skip
        write_text(path, text)
        return Source(self.folder.get_name(path), path)

    def _read_log(
        self,
        log: Source,
        card: Source | None,
        mapping: Path | None,
        corrections: Corrections,
    ) -> OpenLog:
        request = _make_request(log, card, mapping, corrections)
        opened: sandboxed_parse.Opened = jobs.call(
            sandboxed_parse.open_log,
            request,
            self.scratch / "mapping.toml",
            limit=compute_parser_limits(request.log).seconds,
        )
        shifts = () if opened.found is None else opened.found.shifts
        return OpenLog(log, opened, mapping, corrections, shifts)


def _make_request(
    log: Source, card: Source | None, mapping: Path | None, corrections: Corrections
) -> sandboxed_parse.Request:
    """The files to read; a log of the folder has the mapping of its project."""
    project = None if log.uploaded else find_project_mapping(log.path)
    return sandboxed_parse.Request(
        log=log.path,
        label=log.name,
        card=None if card is None else card.path,
        card_label="" if card is None else card.name,
        mapping=mapping or project,
        beside=mapping is None and project is not None,
        corrections=corrections,
    )


def make_run_folder() -> Path:
    """Make a folder that only this user can read; those of runs that were killed are removed."""
    remove_unfinished([Path(tempfile.gettempdir(), FOLDER_PREFIX)])
    return Path(tempfile.mkdtemp(prefix=f"{FOLDER_PREFIX}{make_owner_name()}."))


@dataclass(eq=False)
class Sessions:
    """All sessions of a server by an unguessable key, in a temporary folder of the run."""

    folder: Folder
    place: Path = field(default_factory=make_run_folder)
    _held: dict[object, Session] = field(default_factory=dict)

    def create(self) -> str:
        """Open a session and return its key."""
        key = secrets.token_urlsafe(24)
        scratch = Path(tempfile.mkdtemp(prefix="session-", dir=self.place))
        self._held[key] = Session(self.folder, scratch)
        return key

    def __contains__(self, key: object) -> bool:
        return isinstance(key, str) and key in self._held

    def get(self, key: object) -> Session:
        """Return a session. Raises RefusedError for a key without one."""
        if key not in self:
            raise RefusedError("this session has ended", "load the page again")
        return self._held[key]

    def close(self) -> None:
        """End all sessions."""
        while self._held:
            self._held.popitem()[1].close()
        shutil.rmtree(self.place, ignore_errors=True)

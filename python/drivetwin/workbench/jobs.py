# SPDX-License-Identifier: MIT
"""Jobs in separate processes: they report progress, can be cancelled, and crash separately.

What is handed in and comes back are dataclasses of the program itself, through a pipe between
parent and child; bytes of a user's file never take that way.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext
from typing import Any

from drivetwin._util.child_process import describe_end
from drivetwin._util.progress import attach_listener
from drivetwin.errors import DrivetwinError, InputError, Where

Emit = Callable[[object], None]
"""Callback that a job calls with each result."""
Work = Callable[..., None]
"""A function of a module: called as work(emit, *arguments) in the child."""

_PRELOADED = ["drivetwin.workbench.sandboxed_parse", "drivetwin.workbench.identifying"]
_PATIENCE = 2.0
"""Time [s] that a process may take to end after the request."""
_PAUSE = 0.1
"""Shortest time [s] between two messages about progress."""


@dataclass(frozen=True)
class Fault:
    """Error of a job in a form that can be sent through the pipe."""

    what: str
    remedy: str
    where: Where = field(default_factory=Where)

    def to_error(self) -> InputError:
        """Convert the fault to an exception."""
        return InputError(self.what, self.remedy, self.where)


def to_fault(error: Exception) -> Fault:
    """Convert an exception to a fault; print the traceback of an unexpected error."""
    match error:
        case DrivetwinError():
            return Fault(error.what, error.remedy, error.where)
        case MemoryError() | RecursionError():
            return Fault("the file needs more memory than is available", "cut or split the file")
    traceback.print_exception(error)
    return Fault(
        f"internal error of the workbench ({type(error).__name__}: {error})",
        "its terminal has the details: please report them",
    )


@dataclass(frozen=True)
class Progress:
    """Share done (0 to 1) and what is being done."""

    share: float
    text: str


@dataclass(frozen=True)
class _Done:
    """The last message of a job that came to its end."""


@dataclass(eq=False)
class Job:
    """A running process. `share` and `text` are its progress, `fault` the cause of an early end."""

    process: Any
    pipe: Connection
    share: float = 0.0
    text: str = ""
    fault: Fault | None = None
    finished: bool = False
    started: float = field(default_factory=time.monotonic)

    @property
    def elapsed(self) -> float:
        """Time since the start [s]."""
        return time.monotonic() - self.started

    def get_results(self) -> list[Any]:
        """Return the results received since the last call, without waiting."""
        found: list[Any] = []
        while not self.finished and self.pipe.poll():
            try:
                message = self.pipe.recv()
            except (EOFError, OSError):
                self._record_death()
                break
            match message:
                case Progress(share, text):
                    self.share, self.text = share, text
                case Fault():
                    self.fault = message
                    self._end()
                case _Done():
                    self._end()
                case _:
                    found.append(message)
        return found

    def collect_results(self, limit: float) -> list[Any]:
        """Wait for all results; raise InputError on failure or after `limit` [s]."""
        found: list[Any] = []
        while not self.finished:
            left = limit - self.elapsed
            if left <= 0.0 or not self.pipe.poll(left):
                self.cancel()
                raise InputError(
                    f"this took longer than {limit:.0f} s and was stopped",
                    "open a shorter log, or cut it to the shift",
                )
            found += self.get_results()
        if self.fault is not None:
            raise self.fault.to_error()
        return found

    def cancel(self) -> None:
        """Stop the process; nothing of it stays."""
        if not self.finished:
            self.process.terminate()
            self._end()

    def _record_death(self) -> None:
        self.process.join(_PATIENCE)
        self.fault = Fault(
            f"the process that did this {describe_end(self.process.exitcode)}",
            "the file may be damaged, or expand to more memory than is available",
        )
        self._end()

    def _end(self) -> None:
        _live.discard(self)
        self.finished = True
        self.pipe.close()
        self.process.join(_PATIENCE)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()


_live: set[Job] = set()
"""Jobs whose process may run."""


def start(work: Work, *arguments: object) -> Job:
    """Run `work(emit, *arguments)` in a separate process."""
    context = _get_context()
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(  # type: ignore[attr-defined]
        target=_run_child, args=(theirs, work, arguments), daemon=True
    )
    process.start()
    theirs.close()
    job = Job(process, ours)
    _live.add(job)
    return job


def call(work: Work, *arguments: object, limit: float) -> Any:
    """Run `work` in a separate process; return its only result. Raises InputError on failure."""
    return start(work, *arguments).collect_results(limit)[-1]


def end_all() -> None:
    """End the processes of all jobs; whoever waits for one gets its error."""
    processes = [job.process for job in _live.copy()]
    for process in processes:
        process.terminate()
    for process in processes:
        process.join(_PATIENCE)
        if process.is_alive():
            process.kill()


def warm_up() -> None:
    """Import what jobs need before the first one is started."""
    start(_run_nothing)


def _run_nothing(emit: Emit) -> None:
    emit(None)


def _get_context() -> BaseContext:
    """Children of a server with the libraries loaded start at once; elsewhere they load them."""
    if sys.platform == "win32":
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOADED)
    return context


def _end_with_parent() -> None:
    """End this process when the server is gone, also if that was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _run_child(pipe: Connection, work: Work, arguments: tuple[Any, ...]) -> None:
    threading.Thread(target=_end_with_parent, daemon=True).start()
    last = 0.0

    def tell(share: float, text: str) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= _PAUSE:
            last = now
            pipe.send(Progress(share, text))

    with suppress(BrokenPipeError, KeyboardInterrupt):
        try:
            with attach_listener(tell):
                work(pipe.send, *arguments)
            pipe.send(_Done())
        except BrokenPipeError:
            raise
        except Exception as error:
            pipe.send(to_fault(error))

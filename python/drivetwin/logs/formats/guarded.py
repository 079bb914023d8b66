# SPDX-License-Identifier: MIT
"""Recordings whose library runs in a child process with limits on memory and time.

Libraries that parse binary formats crash, hang or exhaust the memory on some damaged files. In a
child such a file costs the child, and becomes a ReaderFailureError. Samples come back as plain
bytes, straight into their arrays.

The child answers pickled requests from standard input. A reply is a line of JSON, followed by the
time stamps and the values of a column as bytes; stamps that are those of the column before are not
sent again. The child ends with its input.
"""

from __future__ import annotations

import contextlib
import json
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import traceback
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from queue import SimpleQueue
from threading import Timer
from time import sleep
from typing import IO, Any, NoReturn

import numpy as np

from drivetwin import errors
from drivetwin._util.child_process import (
    GRACE,
    describe_end,
    end_process,
    limit_computing_time,
    limit_memory,
)
from drivetwin.channels.roles import Column, ReadOptions
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.errors import DrivetwinError, ReaderFailureError, Where
from drivetwin.logs.raw import Opener, RawChannel, Recording, Window

BASE_MEMORY = 2 * 2**30
"""Memory [bytes] that a small file may take beyond that of the libraries."""
MEMORY_PER_BYTE = 16
"""Memory [bytes] that a file may take besides for each of its bytes, which may be packed."""
BASE_TIME = 60.0
"""Time limit [s] for reading a small file."""
TIME_PER_BYTE = 2e-6
"""Time [s] that a log may take besides for each of its bytes: half an hour at 1 kHz, 160 MB of
text, takes a minute on an idle machine and a multiple of it on a busy one."""
MAX_TIME = 600.0
"""Time limit [s] for reading a file of any size."""
_CHILD = f"from {__name__} import serve_file; serve_file()"


@dataclass(frozen=True)
class ParserLimits:
    """Memory [bytes] beyond that of the libraries, and time [s] to open a file or load a column."""

    memory: int
    seconds: float


def compute_parser_limits(path: Path) -> ParserLimits:
    """Compute the limits for reading a log from the size of its file; one that is absent has 0."""
    try:
        size = path.stat().st_size
    except OSError:
        size = 0
    return ParserLimits(
        BASE_MEMORY + MEMORY_PER_BYTE * size, min(BASE_TIME + TIME_PER_BYTE * size, MAX_TIME)
    )


_DAMAGED = "the file is damaged, or the library has a fault: record or export the log again"
_TOO_LARGE = "if the log is only long, read a shorter one; else record or export it again"

_guards_parsers = True


def trust_parsers() -> None:
    """Read files in this process from now on: for a process that is itself guarded and limited."""
    global _guards_parsers
    _guards_parsers = False


@dataclass(frozen=True)
class OpenRequest:
    """First request to the child: the function that opens the file, and its arguments."""

    module: str
    function: str
    path: Path
    options: ReadOptions
    limits: ParserLimits


@dataclass(frozen=True)
class LoadRequest:
    """Request for the samples of a column."""

    index: int
    window: Window | None


def open_guarded(
    opener: Opener, path: Path, options: ReadOptions
) -> AbstractContextManager[Recording]:
    """Open a recording by `opener`, a function of a module, in a child process.

    Raises ReaderFailureError where the child crashes or exceeds its limits, and the errors of
    `opener`, each when the file is opened or a column is loaded.
    """
    return _open_in_child(opener, path, options) if _guards_parsers else opener(path, options)


@contextmanager
def _open_in_child(opener: Opener, path: Path, options: ReadOptions) -> Iterator[Recording]:
    limits = compute_parser_limits(path)
    request = OpenRequest(opener.__module__, opener.__qualname__, path, options, limits)
    with _ReaderProcess(path, limits.seconds) as reader:
        reply = reader.ask(request)
        columns = tuple(Column(**column) for column in reply["columns"])
        yield GuardedRecording(reader, columns, tuple(reply["warnings"]))


class GuardedRecording:
    """A recording that is open in a child process; see `Recording`."""

    def __init__(
        self, reader: _ReaderProcess, columns: tuple[Column, ...], warnings: tuple[str, ...]
    ) -> None:
        self.columns = columns
        self.warnings = warnings
        self._reader = reader
        self._time: FloatArray = np.empty(0)

    def load(self, index: int, window: Window | None = None) -> RawChannel:
        """Read the column at `index` of `columns`; see `Recording`. Raises ReaderFailureError."""
        reply = self._reader.ask(LoadRequest(index, window))
        self.warnings = tuple(reply["warnings"])
        self._time = reply.get("time", self._time)
        return RawChannel(
            reply["name"],
            reply["unit"],
            self._time,
            reply["values"],
            reply["group"],
            tuple(reply["notes"]),
        )


class _ReaderProcess:
    """The child; a context manager that ends it."""

    def __init__(self, path: Path, seconds: float) -> None:
        self._path = path
        self._seconds = seconds
        self._late = False
        self._stderr = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the child
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _CHILD],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._stderr,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )

    def __enter__(self) -> _ReaderProcess:
        return self

    def __exit__(self, *_: object) -> None:
        end_process(self._process)
        self._stderr.close()

    def ask(self, request: OpenRequest | LoadRequest) -> dict[str, Any]:
        """Return the reply to a request, with `values` of a column, and `time` if it is another.

        Raises ReaderFailureError without a reply, else the error that it names.
        """
        watch = Timer(self._seconds, self._end_late)
        watch.daemon = True
        watch.start()
        try:
            return self._exchange(request)
        except (BrokenPipeError, EOFError):
            self._raise_failure()
        finally:
            watch.cancel()

    def _exchange(self, request: OpenRequest | LoadRequest) -> dict[str, Any]:
        pipe, replies = self._process.stdin, self._process.stdout
        assert pipe is not None
        assert replies is not None
        pickle.dump(request, pipe)
        pipe.flush()
        line = replies.readline()
        if not line.endswith(b"\n"):
            raise EOFError
        reply: dict[str, Any] = json.loads(line)
        if "error" in reply:
            raise _parse_error(reply)
        for name in reply.get("numbers", ()):
            reply[name] = self._read_numbers(reply["size"])
        return reply

    def _read_numbers(self, size: int) -> FloatArray:
        assert self._process.stdout is not None
        numbers = np.empty(size)
        if self._process.stdout.readinto(numbers.view(np.uint8)) != numbers.nbytes:  # type: ignore[attr-defined]
            raise EOFError
        return numbers

    def _end_late(self) -> None:
        self._late = True
        self._process.kill()

    def _raise_failure(self) -> NoReturn:
        """Name the cause for which the child ended without an answer."""
        where = Where(file=str(self._path))
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(GRACE)
        code = self._process.returncode
        if self._late or (code is not None and code == -getattr(signal, "SIGXCPU", sys.maxsize)):
            what = f"it is not read after {self._seconds:.0f} s: the library that reads it hangs"
            raise ReaderFailureError(what, _TOO_LARGE, where) from None
        ended = describe_end(code, self._stderr)
        what = f"the library that reads this format crashes on the file: its process {ended}"
        raise ReaderFailureError(what, _DAMAGED, where) from None


def make_memory_error(path: Path, memory: int) -> ReaderFailureError:
    """Return the error for a file that takes more than its `memory` [bytes]."""
    return ReaderFailureError(
        f"reading it takes more than {memory / 2**30:.1f} GiB of memory",
        _TOO_LARGE,
        Where(file=str(path)),
    )


def format_error(error: DrivetwinError) -> dict[str, Any]:
    """Return a typed error as a reply."""
    where = error.where
    public = next(one for one in type(error).__mro__ if one.__module__ == errors.__name__)
    return {
        "error": public.__name__,
        "what": error.what,
        "remedy": error.remedy,
        "where": [where.file, where.channel, where.time, where.key],
    }


def _parse_error(reply: dict[str, Any]) -> Exception:
    kind = getattr(errors, reply["error"], None)
    if not (isinstance(kind, type) and issubclass(kind, DrivetwinError)):
        return RuntimeError(reply["what"])  # a fault of the reader itself, as without a child
    error: DrivetwinError = kind(reply["what"], reply["remedy"], Where(*reply["where"]))
    return error


def serve_file() -> None:
    """Open the file of the first request in the child, then load columns until the input ends."""
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints must not stand between the replies
    requests: SimpleQueue[LoadRequest | None] = SimpleQueue()
    opening: OpenRequest = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_read_requests, args=(requests,), daemon=True).start()
    limit_memory(opening.limits.memory)
    limit_computing_time(opening.limits.seconds)
    try:
        opener = getattr(import_module(opening.module), opening.function)
        with opener(opening.path, opening.options) as recording:
            columns = [asdict(column) for column in recording.columns]
            _send(replies, {"columns": columns, "warnings": recording.warnings})
            sent: FloatArray | None = None
            while (request := requests.get()) is not None:
                limit_computing_time(opening.limits.seconds)
                sent = _answer(replies, opening, recording, request, sent)
    except Exception as fault:
        _send_error(replies, opening, fault)
    os._exit(0)  # without the time that libraries take to be unloaded


def _read_requests(requests: SimpleQueue[LoadRequest | None]) -> None:
    """Hand on requests. End the process after its input, even if a library still reads."""
    try:
        while True:
            requests.put(pickle.load(sys.stdin.buffer))
    except EOFError:
        requests.put(None)
    sleep(GRACE)
    os._exit(1)


def _answer(
    replies: IO[bytes],
    opening: OpenRequest,
    recording: Recording,
    request: LoadRequest,
    sent: FloatArray | None,
) -> FloatArray | None:
    """Send a column; return its stamps, of which those `sent` last are not sent again."""
    try:
        channel = recording.load(request.index, request.window)
        time, values = (
            np.ascontiguousarray(numbers, np.float64) for numbers in (channel.time, channel.values)
        )
    except Exception as fault:
        _send_error(replies, opening, fault)
        return sent
    is_known = channel.time is sent
    head = {
        "name": channel.name,
        "unit": channel.unit,
        "group": channel.group,
        "notes": channel.notes,
        "size": time.size,
        "numbers": ("values",) if is_known else ("time", "values"),
        "warnings": recording.warnings,
    }
    _send(replies, head, *(() if is_known else (time.data,)), values.data)
    return channel.time


def _send_error(replies: IO[bytes], opening: OpenRequest, fault: Exception) -> None:
    if isinstance(fault, MemoryError):
        fault = make_memory_error(opening.path, opening.limits.memory)
    if isinstance(fault, DrivetwinError):
        _send(replies, format_error(fault))
    else:
        text = "".join(traceback.format_exception(fault))
        _send(replies, {"error": type(fault).__name__, "what": text})


def _send(replies: IO[bytes], head: dict[str, Any], *numbers: memoryview) -> None:
    replies.write(json.dumps(head).encode() + b"\n")
    for block in numbers:
        replies.write(block)
    replies.flush()

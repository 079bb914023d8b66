# SPDX-License-Identifier: MIT
"""Version of the program, optional libraries of foreign formats, limits of child processes.

A child process may run code that crashes or exhausts the memory. The limits hold where the system
supports them: memory on Linux, computing time on every POSIX system.
"""

from __future__ import annotations

import contextlib
import logging
import math
import os
import signal
import subprocess
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from functools import cache
from importlib import import_module, metadata
from pathlib import Path
from threading import RLock, get_ident
from typing import IO, Any, TextIO, cast

from drivetwin.errors import DrivetwinError, FileFormatError, MissingExtraError, Where


@cache
def get_program_version() -> str:
    """Version of the installed distribution; `unknown` when run from a source tree."""
    try:
        return metadata.version("drivetwin")
    except metadata.PackageNotFoundError:
        return "unknown"


_one_at_a_time = RLock()
"""Held while a foreign library is loaded or parses: standard output, hook and warnings are those
of the process, and threads that change them out of turn would leave them changed."""


def import_extra(module: str, extra: str, kind: str, path: Path) -> Any:
    """Import a library of an extra; MissingExtraError names the install command.

    Its own log lines are silenced: what matters becomes an error or a warning of the reader.
    """
    logging.getLogger(module.partition(".")[0]).setLevel(logging.CRITICAL)
    try:
        with _one_at_a_time, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return import_module(module)
    except ImportError as fault:
        raise MissingExtraError(
            f"{kind} needs the library {module.split('.')[0]} ({fault})",
            f'pip install "drivetwin[{extra}]"',
            Where(file=str(path)),
        ) from None


class _Muted:
    """Standard output without what the thread prints that made this."""

    def __init__(self, out: TextIO) -> None:
        self._out, self._thread = out, get_ident()

    def write(self, text: str) -> int:
        return len(text) if get_ident() == self._thread else self._out.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._out, name)


@contextmanager
def _mute_thread() -> Iterator[None]:
    """Suppress printed output, warnings and unraisable errors of libraries in this thread."""
    with _one_at_a_time:
        hook = sys.unraisablehook
        try:
            sys.unraisablehook = lambda _: None
            with warnings.catch_warnings(), redirect_stdout(cast(TextIO, _Muted(sys.stdout))):
                warnings.simplefilter("ignore")
                yield
        finally:
            sys.unraisablehook = hook


@contextmanager
def handle_parser_errors(kind: str, path: Path) -> Iterator[None]:
    """Turn whatever a foreign parser raises on damaged bytes into FileFormatError.

    Such parsers check little: a flipped bit shows as any exception at all. What they print, warn
    of, and complain about when a half-built object is freed would reach the user without any use.
    Only one thread at a time runs inside the block.
    """
    with _mute_thread():
        try:
            yield
        except DrivetwinError:
            raise
        except Exception as fault:
            fault.__traceback__ = None  # frees what the parser built, while nobody listens
            text = " ".join(str(fault).split())[:120] or "without details"
            raise FileFormatError(
                f"{kind} cannot be read, it may be cut or damaged ({type(fault).__name__}: {text})",
                "record or export the log again",
                Where(file=str(path)),
            ) from None


def limit_memory(memory: int) -> None:
    """Make allocations fail beyond `memory` [bytes] more than the process has now.

    Mapped files do not count.
    """
    if sys.platform == "win32":
        return
    import resource

    status = Path("/proc/self/status")
    present = 0
    if status.exists():
        lines = dict(line.split(":", 1) for line in status.read_text().splitlines())
        present = 1024 * int(lines["VmData"].split()[0])
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    wanted = present + memory
    if hard == resource.RLIM_INFINITY or wanted < hard:
        resource.setrlimit(resource.RLIMIT_DATA, (wanted, hard))


def limit_computing_time(seconds: float) -> None:
    """Have the process ended once it has computed for `seconds` [s] more."""
    if sys.platform == "win32":
        return
    import resource

    usage = resource.getrusage(resource.RUSAGE_SELF)
    wanted = math.ceil(usage.ru_utime + usage.ru_stime + seconds)
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    if hard == resource.RLIM_INFINITY or wanted < hard:
        resource.setrlimit(resource.RLIMIT_CPU, (wanted, hard))


GRACE = 2.0
"""Time [s] for a child process to end by itself after its last task."""
_TAIL = 2000
"""Bytes at the end of what a child wrote to its standard error in which the last line is read."""


def end_process(process: subprocess.Popen[bytes], grace: float = GRACE) -> int:
    """Close the pipes of a child process and end it.

    Parameters
    ----------
    process
        The child; its pipes are closed.
    grace
        Time [s] that it may take to end by itself.

    Returns
    -------
    int
        Its exit code.
    """
    if process.stdin is not None:
        with contextlib.suppress(OSError):
            process.stdin.close()
    try:
        code = process.wait(grace)
    except subprocess.TimeoutExpired:
        process.kill()
        code = process.wait()
    if process.stdout is not None:
        process.stdout.close()
    return code


def describe_end(code: int | None, stderr: IO[bytes] | None = None) -> str:
    """Describe how a child process ended, with the last line of its standard error if given."""
    last = "" if stderr is None else _read_last_line(stderr)
    if code is not None and code < 0:
        return f"was killed by {signal.Signals(-code).name}{last}"
    return f"{BY_ITSELF} {code}{last}"


BY_ITSELF = "ended with code"
"""Beginning of the description of a process that ended by itself."""


def _read_last_line(stderr: IO[bytes]) -> str:
    stderr.seek(max(0, stderr.seek(0, os.SEEK_END) - _TAIL))
    lines = stderr.read().decode("utf-8", "replace").strip().splitlines()
    return f": {lines[-1][:300]}" if lines else ""

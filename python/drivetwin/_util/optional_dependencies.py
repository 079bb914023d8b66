# SPDX-License-Identifier: MIT
"""Version of the program, and the optional libraries that read foreign formats."""

from __future__ import annotations

import logging
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from functools import cache
from importlib import import_module, metadata
from pathlib import Path
from threading import RLock, get_ident
from typing import Any, TextIO, cast

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

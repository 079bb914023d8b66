# SPDX-License-Identifier: MIT
"""Optional libraries that read foreign formats: found, or named with their install command."""

from __future__ import annotations

import logging
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from importlib import import_module
from io import StringIO
from pathlib import Path
from typing import Any

from drivetwin.errors import DrivetwinError, FileFormatError, MissingExtraError, Where


def require(module: str, extra: str, kind: str, path: Path) -> Any:
    """Import a library of an extra; MissingExtraError names the install command.

    Its own log lines are silenced: what matters becomes an error or a warning of the reader.
    """
    logging.getLogger(module.partition(".")[0]).setLevel(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return import_module(module)
    except ImportError as fault:
        raise MissingExtraError(
            f"{kind} needs the library {module.split('.')[0]} ({fault})",
            f'pip install "drivetwin[{extra}]"',
            Where(file=str(path)),
        ) from None


@contextmanager
def foreign_parser(kind: str, path: Path) -> Iterator[None]:
    """Turn whatever a foreign parser raises on damaged bytes into FileFormatError.

    Such parsers check little: a flipped bit shows as any exception at all. What they print, warn
    of, and complain about when a half-built object is freed would reach the user without any use.
    """
    hook = sys.unraisablehook
    try:
        sys.unraisablehook = lambda _: None
        with warnings.catch_warnings(), redirect_stdout(StringIO()):
            warnings.simplefilter("ignore")
            yield
    except DrivetwinError:
        raise
    except (Exception, MemoryError) as fault:
        fault.__traceback__ = None  # frees what the parser built, while nobody listens
        text = " ".join(str(fault).split())[:120] or "no more is known"
        raise FileFormatError(
            f"{kind} cannot be read, it may be cut or damaged ({type(fault).__name__}: {text})",
            "record or export the log again",
            Where(file=str(path)),
        ) from None
    finally:
        sys.unraisablehook = hook

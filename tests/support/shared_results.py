# SPDX-License-Identifier: MIT
"""Results that many tests share: computed once per state of the sources and kept on disk."""

from __future__ import annotations

import hashlib
import inspect
import os
import pickle
import platform
import shutil
from collections.abc import Callable, Iterator
from functools import cache, wraps
from importlib.metadata import version
from pathlib import Path
from typing import ParamSpec, TypeVar, cast

from filelock import FileLock

import drivetwin

P = ParamSpec("P")
R = TypeVar("R")

TESTS = Path(__file__).resolve().parents[1]
FOLDER = TESTS.parent / ".pytest_cache" / "shared_results"
STATES_KEPT = 3
"""States of the sources whose results stay on disk, so that a change can be undone cheaply."""


def shared(function: Callable[P, R]) -> Callable[P, R]:
    """Cache the results of a function in memory and, for all workers and sessions, on disk.

    The key is the hash of the sources, the name of the function and its arguments. Arguments are
    hashable values whose `repr` determines them. The result must be picklable and is read only,
    as with `functools.cache`. The function must not read files outside the package and the tests.
    """

    @cache
    @wraps(function)
    def cached(*args: P.args, **kwargs: P.kwargs) -> R:
        call = f"{function.__module__}.{function.__qualname__}({_write(args)}, {_write(kwargs)})"
        file = Path(inspect.getfile(function)).read_bytes()
        path = _open_state() / f"{function.__name__}-{_hash(call.encode(), file)}"
        # The lock makes a second worker wait for the result instead of computing it as well.
        with FileLock(path.with_suffix(".lock")):
            if not path.exists():
                partial = path.with_suffix(".partial")
                partial.write_bytes(pickle.dumps(function(*args, **kwargs)))
                partial.replace(path)
        return cast(R, pickle.loads(path.read_bytes()))

    return cast(Callable[P, R], cached)


def _write(value: object) -> str:
    """Text of an argument that is equal in all processes: sets have no order of their own."""
    if isinstance(value, (set, frozenset)):
        return f"{{{', '.join(sorted(map(_write, value)))}}}"
    if isinstance(value, tuple):
        return f"({', '.join(map(_write, value))})"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key}: {_write(each)}' for key, each in sorted(value.items()))}}}"
    return repr(value)


def _hash(*parts: bytes) -> str:
    return hashlib.sha256(b"\0".join(parts)).hexdigest()[:16]


def _read_sources() -> Iterator[bytes]:
    """Yield everything that results depend on: package, test support, numeric libraries."""
    yield f"{platform.python_version()} {platform.machine()}".encode()
    for name in ("numpy", "scipy", "pydantic"):
        yield f"{name} {version(name)}".encode()
    for root, left_out in ((Path(drivetwin.__file__).parent, "."), (TESTS, "test_")):
        for path in sorted(root.rglob("*")):
            if path.is_file() and path.suffix != ".pyc" and not path.name.startswith(left_out):
                yield path.relative_to(root).as_posix().encode()
                yield path.read_bytes()


@cache
def _open_state() -> Path:
    """Return the folder of this state of the sources; remove those used longest ago."""
    folder = FOLDER / _hash(*_read_sources())
    folder.mkdir(parents=True, exist_ok=True)
    os.utime(folder)
    with FileLock(FOLDER / "states.lock"):
        states = sorted(
            (each for each in FOLDER.iterdir() if each.is_dir()),
            key=lambda each: each.stat().st_mtime,
        )
        for state in states[:-STATES_KEPT]:
            shutil.rmtree(state, ignore_errors=True)
    return folder

# SPDX-License-Identifier: MIT
"""Protection of files: a command overwrites nothing that it reads, nor what another one writes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import wraps
from pathlib import Path
from typing import Any

from drivetwin._util.atomic import protect_files, refuse_overwrite
from drivetwin._util.output_lock import lock_outputs

_OUTPUTS = frozenset(("output", "figure", "html", "inputs", "write_mapping", "modelica"))
"""Parameters of commands that name what is written; files that all others name are read."""


def protect_inputs(command: Callable[..., None]) -> Callable[..., None]:
    """Wrap a command: it raises InputError instead of overwriting a file that it reads.

    It is also refused while another command writes to the same place.
    """

    @wraps(command)
    def careful(**given: Any) -> None:
        read = (value for name, value in given.items() if name not in _OUTPUTS)
        with protect_files(path for value in read for path in _collect_paths(value)):
            written = [
                path for name in _OUTPUTS & given.keys() for path in _collect_paths(given[name])
            ]
            for path in written:
                refuse_overwrite(path)  # at once, not after the computation
            with lock_outputs(written):
                command(**given)

    return careful


def _collect_paths(value: object) -> Iterator[Path]:
    """Collect the paths in a parameter's value, which may also name a built-in."""
    for one in value if isinstance(value, list) else [value]:
        if isinstance(one, Path | str):
            yield Path(one)

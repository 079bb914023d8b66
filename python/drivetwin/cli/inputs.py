# SPDX-License-Identifier: MIT
"""Protection of files: a command overwrites nothing that it reads, nor what another one writes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import wraps
from pathlib import Path
from typing import Any

from drivetwin._util.atomic import protect_files, remove_unfinished
from drivetwin._util.output_lock import lock_outputs
from drivetwin.cli.outputs import find_outputs


def protect_inputs(command: Callable[..., None]) -> Callable[..., None]:
    """Wrap a command: it raises InputError instead of overwriting a file that it reads.

    Outputs are the parameters with a marker `Output`; files that all others name are read. Outputs
    are checked before the computation. A command is also refused while another one writes to the
    same place.
    """
    outputs = find_outputs(command)

    @wraps(command)
    def careful(**given: Any) -> None:
        read = (value for name, value in given.items() if name not in outputs)
        with protect_files(path for value in read for path in _collect_paths(value)):
            written = [
                (path, marker)
                for name, marker in outputs.items()
                for path in _collect_paths(given.get(name))
            ]
            for path, marker in written:
                marker.check(path)
            with lock_outputs(path for path, _ in written):
                remove_unfinished(path for path, _ in written)
                command(**given)

    return careful


def _collect_paths(value: object) -> Iterator[Path]:
    """Collect the paths in a parameter's value, which may also name a built-in."""
    for one in value if isinstance(value, list) else [value]:
        if isinstance(one, Path | str):
            yield Path(one)

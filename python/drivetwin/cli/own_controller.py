# SPDX-License-Identifier: MIT
"""Compilation of the user's own controller, for the commands that call it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from drivetwin.cli.output import print_line, show_step
from drivetwin.errors import CompilerError, ControllerError, Where

if TYPE_CHECKING:
    from drivetwin.calibration.policies.own import UserController


@contextmanager
def compile_controller(path: Path, *, bench: bool = False) -> Iterator[UserController]:
    """Compile the controller of a parameter file for the block, perhaps with the test bench.

    Errors of the controller name its source. Warnings that the file asks for go to stderr.
    """
    from drivetwin.calibration.policies import own
    from drivetwin.export.compiler import compile_library, detect_platform
    from drivetwin.files.controller_file import build_user_controller, load_controller_file

    content = load_controller_file(path)
    sources = [one.resolve() for one in content.list_sources(path)]
    folders = [own.HEADER.parent, *((path.parent / one).resolve() for one in content.include)]
    where = Where(file=", ".join(str(one) for one in content.list_sources(path)))
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:  # Windows keeps loaded libraries
        platform = detect_platform()
        library = Path(folder) / f"{sources[0].stem}{platform.suffix if platform else '.so'}"
        files, more = ([own.BENCH], own.BENCH_DEFINES) if bench else ([], ())
        with show_step(f"compiling {sources[0].name}"):
            try:
                message = compile_library(
                    [*files, *sources],
                    library,
                    None,
                    defines=(*more, *content.defines),
                    headers=folders,
                    warnings=content.warnings,
                )
            except CompilerError as error:
                remedy = "correct the C source, or its include folders and defines in the file"
                raise ControllerError(error.what, remedy, where) from None
        if content.warnings and message:
            print_line(message.rstrip(), stderr=True)
        try:
            yield build_user_controller(content, library)
        except ControllerError as error:
            raise replace(error, where=where) from None

# SPDX-License-Identifier: MIT
"""Shared libraries from C sources: the C compiler found, or zig for other platforms."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from itertools import islice
from pathlib import Path

from drivetwin.errors import DrivetwinError, MissingExtraError
from drivetwin.export.platforms import Platform


class CompilerError(DrivetwinError):
    """A C compiler is missing or refuses the sources."""


_ZIG_TARGETS = {
    Platform.LINUX: "x86_64-linux-gnu.2.17",  # runs from RHEL 7 on
    Platform.WINDOWS: "x86_64-windows-gnu",
    Platform.MACOS: "x86_64-macos",
    Platform.MACOS_ARM: "aarch64-macos",
}


def native_platform() -> Platform | None:
    """The platform this program runs on; None where it is none of those known."""
    import platform

    machine = platform.machine().lower()
    if sys.platform == "darwin":
        return Platform.MACOS_ARM if machine == "arm64" else Platform.MACOS
    if machine not in ("x86_64", "amd64"):
        return None
    return Platform.WINDOWS if sys.platform == "win32" else Platform.LINUX


def compile_library(
    sources: Sequence[Path], target: Path, platform: Platform | None, defines: Sequence[str] = ()
) -> None:
    """Compile C99 sources into the shared library `target`; headers stand beside the sources.

    `platform` None builds for this machine by the compiler found (`cc`, `gcc`, `clang`), by zig
    without one. Raises CompilerError with the compiler's words, MissingExtraError without zig.
    """
    includes = sorted({str(path.parent) for path in sources})
    command = [
        *_compiler(platform),
        *("-std=c99", "-O2", "-g0", "-ffp-contract=off", "-shared"),
        *([] if target.suffix == ".dll" else ["-fPIC"]),
        *(f"-D{name}" for name in defines),
        *(f"-I{folder}" for folder in includes),
        *map(str, sources),
        *("-o", str(target)),
        *([] if target.suffix == ".dll" else ["-lm"]),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise CompilerError(
            f"{command[0]} cannot build {target.name}: {done.stderr.strip()[:500]}",
            "check the compiler with a small program, or install the extra: "
            'pip install "drivetwin[fmu]"',
        )


def native_compiler() -> tuple[str, ...]:
    """Command of the C compiler found here; empty without one."""
    found = (name for name in ("cc", "gcc", "clang") if shutil.which(name))
    return tuple(islice(found, 1))


def _compiler(platform: Platform | None) -> list[str]:
    if platform is None and native_compiler():
        return [*native_compiler()]
    if find_spec("ziglang") is None:
        raise MissingExtraError(
            "building for other platforms, or without a C compiler, needs zig",
            'pip install "drivetwin[fmu]"',
        )
    target = [] if platform is None else ["-target", _ZIG_TARGETS[platform]]
    return [sys.executable, "-m", "ziglang", "cc", *target]

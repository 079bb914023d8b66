# SPDX-License-Identifier: MIT
"""Shared libraries from C sources: the C compiler found, or zig for other platforms."""

from __future__ import annotations

import os
import shutil
import signal
import struct
import subprocess
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from itertools import islice
from os.path import relpath
from pathlib import Path

from drivetwin.errors import CompilerError, MissingExtraError
from drivetwin.export.targets import Platform

_ZIG_TARGETS = {
    Platform.LINUX: "x86_64-linux-gnu.2.17",  # runs from RHEL 7 on
    Platform.WINDOWS: "x86_64-windows-gnu",
    Platform.MACOS: "x86_64-macos",
    Platform.MACOS_ARM: "aarch64-macos",
}
_LONGEST = 4000
"""Longest message of a compiler in an error [characters]: that of some ten faults."""


def detect_platform() -> Platform | None:
    """The platform this program runs on; None where it is none of those known."""
    import platform

    machine = platform.machine().lower()
    if sys.platform == "darwin":
        return Platform.MACOS_ARM if machine == "arm64" else Platform.MACOS
    if machine not in ("x86_64", "amd64"):
        return None
    return Platform.WINDOWS if sys.platform == "win32" else Platform.LINUX


def compile_library(
    sources: Sequence[Path],
    target: Path,
    platform: Platform | None,
    defines: Sequence[str] = (),
    headers: Sequence[Path] = (),
    warnings: Sequence[str] = (),
) -> str:
    """Compile C99 sources into the shared library `target`; return the words of the compiler.

    Headers stand beside the sources, or in the folders `headers`. `warnings` are its options.

    `platform` None builds for this machine by the compiler found (`cc`, `gcc`, `clang`), by zig
    without one. Raises CompilerError with the compiler's words, MissingExtraError without zig.
    """
    folder = target.parent
    # Names relative to the target: whole paths would end up in some of the formats.
    folders = {*(path.parent for path in sources), *headers}
    includes = sorted(relpath(path, folder) for path in folders)
    windows = target.suffix == ".dll"
    command = [
        *_find_compiler(platform),
        *("-std=c99", "-O2", "-g0", "-ffp-contract=off", "-shared"),
        *(["-s"] if windows else ["-fPIC"]),
        *warnings,
        *(f"-D{name}" for name in defines),
        *(f"-I{include}" for include in includes),
        *(relpath(path, folder) for path in sources),
        *("-o", target.name),
        *([] if windows else ["-lm"]),
    ]
    status, message = _run_compiler(command, folder)
    if status != 0:
        raise CompilerError(
            f"{command[0]} cannot build {target.name}: {message.strip()[:_LONGEST]}",
            "check the compiler with a small program, or install the extra: "
            'pip install "drivetwin[fmu]"',
        )
    if windows:
        _clear_times(target)
    return message


def _run_compiler(command: Sequence[str], folder: Path) -> tuple[int, str]:
    """Run a compiler in `folder`, which takes its temporary files; return exit code and message.

    An interrupt ends it with all its passes.
    """
    has_groups = os.name == "posix"
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        cwd=folder,
        env={**os.environ, "TMPDIR": str(folder.resolve())},
        process_group=0 if has_groups else None,
    ) as program:
        try:
            _, message = program.communicate()
        except BaseException:
            if has_groups:
                os.killpg(program.pid, signal.SIGKILL)
            program.kill()
            raise
    return program.returncode, message


def find_native_compiler() -> tuple[str, ...]:
    """Command of the C compiler found here; empty without one."""
    found = (name for name in ("cc", "gcc", "clang") if shutil.which(name))
    return tuple(islice(found, 1))


def _find_compiler(platform: Platform | None) -> list[str]:
    if platform is None and find_native_compiler():
        return [*find_native_compiler()]
    if find_spec("ziglang") is None:
        raise MissingExtraError(
            "building for other platforms, or without a C compiler, needs zig",
            'pip install "drivetwin[fmu]"',
        )
    target = [] if platform is None else ["-target", _ZIG_TARGETS[platform]]
    return [sys.executable, "-m", "ziglang", "cc", *target]


def _clear_times(library: Path) -> None:
    """Set the times in a Windows library to zero, so that the same sources give the same bytes.

    They stand in the COFF header and in the export directory; formats by the PE specification.
    """
    data = bytearray(library.read_bytes())
    (header,) = struct.unpack_from("<I", data, 0x3C)
    (sections,) = struct.unpack_from("<H", data, header + 6)
    (optional_length,) = struct.unpack_from("<H", data, header + 20)
    optional = header + 24
    (exports,) = struct.unpack_from("<I", data, optional + 112)
    places = [header + 8]
    for i in range(sections):
        entry = optional + optional_length + 40 * i
        size, address, _, offset = struct.unpack_from("<IIII", data, entry + 8)
        if address <= exports < address + size:
            places.append(offset + exports - address + 4)
    for place in places:
        struct.pack_into("<I", data, place, 0)
    library.write_bytes(bytes(data))

# SPDX-License-Identifier: MIT
"""Compilers are found, or their absence and their words become errors."""

from __future__ import annotations

import ctypes
import os
import signal
import time
from pathlib import Path

import pytest

from drivetwin.errors import CompilerError, MissingExtraError
from drivetwin.export import compiler
from drivetwin.export.compiler import compile_library
from drivetwin.export.targets import Platform


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "one.c"
    path.write_text("int one(void);\nint one(void) { return ONE; }\n", "utf-8")
    return path


def test_a_library_of_this_machine(source: Path) -> None:
    target = source.with_name("libone.so")
    compile_library([source], target, None, ["ONE=41"])
    assert ctypes.CDLL(str(target)).one() == 41


def test_the_compiler_is_quoted(source: Path) -> None:
    with pytest.raises(CompilerError, match="ONE"):
        compile_library([source], source.with_name("libone.so"), None)
    assert not source.with_name("libone.so").exists()


@pytest.mark.skipif(os.name != "posix", reason="process groups")
def test_an_interrupt_ends_all_passes_of_the_compiler(
    source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fake, mark = source.with_name("cc"), source.with_name("pass.pid")
    fake.write_text(f"#!/bin/sh\nsleep 60 &\necho $! > {mark}.new\nmv {mark}.new {mark}\nwait\n")
    fake.chmod(0o700)
    monkeypatch.setenv("PATH", f"{source.parent}{os.pathsep}{os.environ['PATH']}")

    def interrupt(_signal: int, _frame: object) -> None:
        if mark.exists():
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, 0.05, 0.05)
    try:
        with pytest.raises(KeyboardInterrupt):
            compile_library([source], source.with_name("libone.so"), None)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    state = Path(f"/proc/{int(mark.read_text())}/stat")
    until = time.monotonic() + 5.0
    while state.exists() and state.read_text().rpartition(")")[2].split()[0] != "Z":
        assert time.monotonic() < until
        time.sleep(0.01)


@pytest.mark.crosscompile
@pytest.mark.parametrize(
    ("platform", "magic"),
    [
        pytest.param(Platform.LINUX, b"\x7fELF", marks=pytest.mark.short),
        (Platform.MACOS, b"\xcf\xfa\xed\xfe"),
        (Platform.MACOS_ARM, b"\xcf\xfa\xed\xfe"),
        (Platform.WINDOWS, b"MZ"),
    ],
)
def test_libraries_of_other_platforms_by_zig(
    source: Path, platform: Platform, magic: bytes
) -> None:
    pytest.importorskip("ziglang", reason="the extra fmu is not installed")
    target = source.with_name(f"one{platform.suffix}")
    compile_library([source], target, platform, ["ONE=1"])
    assert target.read_bytes().startswith(magic)


def test_without_zig_the_extra_is_named(source: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiler, "find_spec", lambda _: None)
    with pytest.raises(MissingExtraError, match=r"drivetwin\[fmu\]"):
        compile_library([source], source.with_name("one.dll"), Platform.WINDOWS)

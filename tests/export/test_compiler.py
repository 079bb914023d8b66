# SPDX-License-Identifier: MIT
"""Compilers are found, or their absence and their words become errors."""

from __future__ import annotations

import ctypes
from pathlib import Path

import pytest

from drivetwin.errors import MissingExtraError
from drivetwin.export import compiler
from drivetwin.export.compiler import CompilerError, compile_library
from drivetwin.export.platforms import Platform


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


@pytest.mark.parametrize(
    ("platform", "magic"),
    [
        (Platform.LINUX, b"\x7fELF"),
        (Platform.MACOS, b"\xcf\xfa\xed\xfe"),
        (Platform.MACOS_ARM, b"\xcf\xfa\xed\xfe"),
    ],
)
def test_libraries_of_other_platforms_by_zig(
    source: Path, platform: Platform, magic: bytes
) -> None:
    """Windows is left out: zig builds its C library for that first, which takes minutes."""
    pytest.importorskip("ziglang", reason="the extra fmu is not installed")
    target = source.with_name(f"one{platform.suffix}")
    compile_library([source], target, platform, ["ONE=1"])
    assert target.read_bytes().startswith(magic)


def test_without_zig_the_extra_is_named(source: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiler, "find_spec", lambda _: None)
    with pytest.raises(MissingExtraError, match=r"drivetwin\[fmu\]"):
        compile_library([source], source.with_name("one.dll"), Platform.WINDOWS)

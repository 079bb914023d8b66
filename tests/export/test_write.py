# SPDX-License-Identifier: MIT
"""One contract of all registered exporters: files, values, units, refusals, and another reader."""

from __future__ import annotations

import errno
import os
import re
import shutil
import subprocess
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from io import StringIO
from pathlib import Path

import fmpy
import pytest
from fmpy.validation import validate_fmu

from drivetwin.cli import main
from drivetwin.export.parameters.content import Scalar
from drivetwin.export.parameters.files import read_parameters
from drivetwin.files.twin_file import load_twin, save_twin
from tests.export.cases import HAS_PLATFORM_OF_FMI
from tests.export.parameters.sample import twin

LONG_LABEL = '[parameters.eta]\nlabel = "Gbx.eta"\n'
IN_BAR = '[parameters."P0.B3"]\nlabel = "Clt_pKiss"\nunit = "bar"\n'


@dataclass(frozen=True)
class Exporter:
    """Exceptions of an exporter: its files, and content that it refuses by name."""

    check: Callable[[Path], None]
    template: str = '[parameters.etta]\nlabel = "a"\n'
    refusal: str = "did you mean 'eta'"


def check_parameters(path: Path) -> None:
    """Read the value and unit of a parameter."""
    k_o = read_parameters(path)["k_o"]
    assert isinstance(k_o, Scalar)
    assert (k_o.value, k_o.unit) == (1.76e5, "N*m/rad")
    assert "no value of te_delay: the engine torque is constant" in path.read_text("utf-8")


def check_c(folder: Path) -> None:
    """Compile the sources without a warning where there is a compiler."""
    assert "k_o = DT_C(176000.0)" in (folder / "dt_twin.c").read_text("utf-8")
    if gcc := shutil.which("gcc"):
        flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]
        subprocess.run([gcc, *flags, *folder.glob("*.c")], check=True)


def check_fmu(path: Path) -> None:
    """Validate by FMPy, and compare value and unit of a parameter."""
    assert validate_fmu(str(path)) == []
    variables = {one.name: one for one in fmpy.read_model_description(str(path)).modelVariables}
    assert (float(variables["k_o"].start), variables["k_o"].unit) == (1.76e5, "N.m/rad")


def check_modelica(path: Path) -> None:
    """Find the output shaft among the components."""
    text = path.read_text("utf-8")
    assert text.startswith("package sample_truck_2_3 ")
    assert "Components.SpringDamper output_shaft(c=176000.0, d=280.0);" in text


OWN = {
    "c": Exporter(check_c, "", "identified friction curve"),
    "fmu": Exporter(check_fmu, "", "identified friction curve"),
    "modelica": Exporter(check_modelica, "", "identified friction curve"),
    "ssv": Exporter(check_parameters, IN_BAR, "is not made of kg"),
    "m": Exporter(check_parameters, LONG_LABEL, "m files cannot hold the labels Gbx.eta"),
}
"""Exporters that have exceptions; each other registered one writes a parameter file."""


def list_exporters() -> list[str]:
    """List the choices of `--to`."""
    with redirect_stdout(StringIO()) as shown:
        main(["export", "--help"])
    found = re.search(r"--to <([^>]*)>", "".join(shown.getvalue().split("\n")))
    assert found
    return [one.strip() for one in found[1].split("|")]


EVERY = pytest.mark.parametrize(
    "kind",
    [
        pytest.param(one, marks=[] if HAS_PLATFORM_OF_FMI or one != "fmu" else pytest.mark.skip)
        for one in list_exporters()
    ],
)


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "truck.toml"
    save_twin(path, twin())
    return path


def read_all(path: Path) -> dict[str, bytes]:
    """Return the bytes of a file, or of all in a folder."""
    files = path.rglob("*") if path.is_dir() else [path]
    return {one.name: one.read_bytes() for one in files if one.is_file()}


@EVERY
def test_an_export_is_whole_repeatable_and_read_by_others(
    kind: str, source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out" / f"twin.{kind}"
    arguments = ["export", str(source), "--to", kind, "-o", str(out)]
    assert main(arguments) == 0
    assert f"wrote {out}" in "".join(capsys.readouterr().out.split("\n"))
    assert list(out.parent.iterdir()) == [out]
    written = read_all(out)
    OWN.get(kind, Exporter(check_parameters)).check(out)
    assert main(arguments) == 0
    assert read_all(out) == written


@EVERY
def test_a_failed_export_leaves_the_earlier_one(
    kind: str, source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file is written beside and renamed, which fails here."""
    out = tmp_path / "out" / f"twin.{kind}"
    arguments = ["export", str(source), "--to", kind, "-o", str(out)]
    assert main(arguments) == 0
    before = read_all(out)
    other = load_twin(source)
    stiff = replace(other.parameters["k_o"], value=2e5)
    save_twin(source, replace(other, parameters={**other.parameters, "k_o": stiff}))

    def refuse(path: Path, _: Path) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO), str(path))

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", refuse)
        assert main(arguments) == 2
    assert read_all(out) == before
    assert list(out.parent.iterdir()) == [out]


@EVERY
def test_content_that_a_format_cannot_hold_is_refused_by_name(
    kind: str, source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own, out = OWN.get(kind, Exporter(check_parameters)), tmp_path / "out"
    arguments = ["export", str(source), "--to", kind, "-o", str(out)]
    if own.template:
        (tmp_path / "t.toml").write_text(own.template, encoding="utf-8")
        arguments += ["--template", str(tmp_path / "t.toml")]
    else:
        save_twin(source, replace(twin(), friction={}))
    assert main(arguments) == 2
    assert own.refusal in " ".join(capsys.readouterr().err.split())
    source.write_text("schema = 'other'", "utf-8")
    assert main(arguments) == 2
    assert not out.exists()

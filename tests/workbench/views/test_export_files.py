# SPDX-License-Identifier: MIT
"""Every export button gives a file that its reader takes."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from drivetwin.cli import main
from drivetwin.errors import InputError
from drivetwin.export.targets import ExportOptions, FmiVersion, Target
from drivetwin.workbench.views.export import Record, make_product

TARGETS = {
    "c": b"dt_twin.c",
    "fmu": b"modelDescription.xml",
    "modelica": b"Modelica.",
}


@pytest.mark.parametrize("wanted", [*TARGETS, "cdfx", "dcm", "csv"])
def test_models_and_parameters(identified: Any, session: Any, tmp_path: Path, wanted: str) -> None:
    target = Target(wanted)
    product = make_product(identified.work, ExportOptions(to=target), tmp_path)
    assert TARGETS.get(wanted, b"k_o") in product.content
    assert make_product(identified.work, ExportOptions(to=target), tmp_path) == product
    assert target.label
    assert target.text
    with pytest.raises(InputError):
        make_product(session.work, ExportOptions(to=target), tmp_path)


def test_chosen_options_decide_the_file(identified: Any, tmp_path: Path) -> None:
    fmi = ExportOptions(to=Target.FMU, fmi=FmiVersion.FMI3)
    packed = io.BytesIO(make_product(identified.work, fmi, tmp_path).content)
    assert b'fmiVersion="3.0"' in zipfile.ZipFile(packed).read("modelDescription.xml")


def test_own_files_are_read_back(identified: Any, session: Any, tmp_path: Path) -> None:
    made = {one: make_product(identified.work, one, tmp_path) for one in Record}
    twin = tmp_path / "twin.toml"
    twin.write_bytes(made[Record.TWIN].content)
    assert main(["export", str(twin), "--to", "csv", "-o", str(tmp_path / "p.csv")]) == 0
    assert "k_o" in (tmp_path / "p.csv").read_text()
    assert "k_o" in json.loads(made[Record.RESULT].content)["parameters"]
    assert b"[channels" in made[Record.MAPPING].content
    page = made[Record.REPORT]
    assert page.content.startswith(b"<!DOCTYPE html>")
    assert page.name == "bench.report.html"
    for one in Record:
        with pytest.raises(InputError):
            make_product(session.work, one, tmp_path)


def test_a_twin_from_a_workspace_has_no_report(identified: Any, tmp_path: Path) -> None:
    work = identified.work
    bare = replace(work.require_outcome(), found=None)
    with pytest.raises(InputError, match="identify again"):
        make_product(replace(work, result=bare), Record.REPORT, tmp_path)
    assert make_product(replace(work, result=bare), Record.TWIN, tmp_path).content


def test_signals_are_measured_and_simulated_with_the_sliders(
    identified: Any, tmp_path: Path
) -> None:
    work = identified.work
    plain = make_product(work, Record.SIGNALS, tmp_path).content.decode()
    moved = make_product(replace(work, changes={"k_o": 1e5}), Record.SIGNALS, tmp_path)
    names, units, *rows = plain.splitlines()
    assert names.startswith("time,output_torque_measured,output_torque_simulated")
    assert units.startswith("s,N*m,N*m")
    assert len(rows) > 100
    place = names.split(",").index("output_torque_simulated")
    before, after = (
        [float(row.split(",")[place]) for row in text.splitlines()[2:]]
        for text in (plain, moved.content.decode())
    )
    assert max(abs(a - b) for a, b in zip(before, after, strict=True)) > 1.0

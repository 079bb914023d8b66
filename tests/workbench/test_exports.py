# SPDX-License-Identifier: MIT
"""Every export button gives a file that its reader takes."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

from drivetwin.channels.mapping_file import read_mapping
from drivetwin.errors import InputError
from drivetwin.estimation.result.method import Method
from drivetwin.export.parameters.files import ParameterFormat, read_parameters
from drivetwin.export.targets import FmiVersion, Target
from drivetwin.export.write import ExportOptions
from drivetwin.files.twin_file import load_twin
from drivetwin.workbench.exports import Record, make_product
from drivetwin.workbench.identifying import Outcome
from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import SessionState
from drivetwin.workbench.views.export import RECORDS


@pytest.mark.parametrize("target", [Target(one.value) for one in ParameterFormat])
def test_parameter_files_are_read_back(identified: Session, tmp_path: Path, target: Target) -> None:
    product = make_product(identified.work, ExportOptions(to=target), tmp_path)
    path = tmp_path / product.name
    path.write_bytes(product.content)
    assert any(entry.name.startswith("k_o") for entry in read_parameters(path).entries)


def test_c_sources_come_as_an_archive(identified: Session, tmp_path: Path) -> None:
    product = make_product(identified.work, ExportOptions(to=Target.C), tmp_path)
    names = zipfile.ZipFile(io.BytesIO(product.content)).namelist()
    assert {"dt_twin.c", "dt_model.h"} <= set(names)
    assert make_product(identified.work, ExportOptions(to=Target.C), tmp_path) == product


@pytest.mark.parametrize(
    ("target", "says"), [(Target.MODELICA, b"Modelica."), (Target.FMU, b"modelDescription.xml")]
)
def test_models_of_the_shift(
    identified: Session, tmp_path: Path, target: Target, says: bytes
) -> None:
    assert says in make_product(identified.work, ExportOptions(to=target), tmp_path).content


def test_chosen_options_decide_the_file(identified: Session, tmp_path: Path) -> None:
    fmi = ExportOptions(to=Target.FMU, fmi=FmiVersion.FMI3)
    packed = io.BytesIO(make_product(identified.work, fmi, tmp_path).content)
    described = zipfile.ZipFile(packed).read("modelDescription.xml")
    assert b'fmiVersion="3.0"' in described


def test_every_file_has_a_button() -> None:
    assert all(one.label and one.text for one in Target)
    assert set(RECORDS) == set(Record)


def test_own_files_are_read_back(identified: Session, tmp_path: Path) -> None:
    twin = tmp_path / "twin.toml"
    twin.write_bytes(make_product(identified.work, Record.TWIN, tmp_path).content)
    assert load_twin(twin).parameters.keys() == identified.work.require_twin().parameters.keys()
    result = json.loads(make_product(identified.work, Record.RESULT, tmp_path).content)
    assert "k_o" in result["parameters"]
    mapping = tmp_path / "m.toml"
    mapping.write_bytes(make_product(identified.work, Record.MAPPING, tmp_path).content)
    survey = identified.work.require_opened().survey
    assert read_mapping(mapping).channels == dict(survey.mapping)


def test_the_report_is_a_page(identified: Session, tmp_path: Path) -> None:
    page = make_product(identified.work, Record.REPORT, tmp_path)
    assert page.content.startswith(b"<!DOCTYPE html>")
    assert page.name == "bench.report.html"


def test_nothing_to_export_is_told(tmp_path: Path) -> None:
    for wanted in (*(ExportOptions(to=one) for one in Target), *Record):
        with pytest.raises(InputError):
            make_product(SessionState(), wanted, tmp_path)


def test_a_twin_from_a_workspace_has_no_report(identified: Session, tmp_path: Path) -> None:
    from dataclasses import replace

    bare = Outcome(Method.INTEGRAL, identified.work.require_outcome().twins)
    work = replace(identified.work, results={Method.INTEGRAL: bare})
    with pytest.raises(InputError, match="identify again"):
        make_product(work, Record.REPORT, tmp_path)
    assert make_product(work, Record.TWIN, tmp_path).content


def test_signals_are_measured_and_simulated_with_the_sliders(
    identified: Session, tmp_path: Path
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

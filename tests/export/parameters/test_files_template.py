# SPDX-License-Identifier: MIT
"""Templates: labels, units, axes and breakpoints of a calibration project, and back again."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import InputError
from drivetwin.export.parameters.content import Axis, Curve, ParameterSet, Scalar
from drivetwin.export.parameters.files import (
    ParameterFormat,
    Template,
    apply_template,
    read_parameters,
    read_template,
    restore_entries,
    write_parameters,
)
from drivetwin.export.parameters.of_twin import collect_parameters
from drivetwin.export.parameters.to_twin import update_twin
from tests.export.parameters.sample import reread, twin

RPM = math.pi / 30.0
EXAMPLE = """
[parameters."P0.B3"]
label = "Clt_pKissB3_C"
unit = "bar"
text = "kiss point of B3"

[parameters.eta]
label = "Gbx_etaDrv_C"
unit = "%"
resolution = 0.1

[parameters.k_o]
label = "Drv_cShaft_C"
unit = "Nm/deg"
in_si = 57.29577951308232

[parameters."mu.B3"]
label = "Clt_muB3_CUR"
axis = { name = "Clt_nSlip", unit = "rpm", points = [0, 50, 100, 300, 900], beyond = "hold" }
"""
LABELS = ["Clt_pKissB3_C", "Gbx_etaDrv_C", "Drv_cShaft_C", "Clt_muB3_CUR"]
FLAT = sorted(set(ParameterFormat) - {ParameterFormat.SSV})
"""Formats with units as texts."""


def make_template(**entries: str) -> Template:
    """Read a template of keys by parameter, names with `__` for the dot."""
    tables = (f'[parameters."{key.replace("__", ".")}"]\n{body}\n' for key, body in entries.items())
    return _read("".join(tables))


def _read(text: str) -> Template:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "project.toml"
        path.write_text(text, encoding="utf-8")
        return read_template(path)


@pytest.fixture
def template() -> Template:
    return _read(EXAMPLE)


@pytest.mark.parametrize("kind", FLAT)
def test_labels_units_and_breakpoints_are_those_of_the_template(
    template: Template, tmp_path: Path, kind: ParameterFormat
) -> None:
    own = collect_parameters(twin())
    content = apply_template(own, template)
    path = tmp_path / f"project.{kind}"
    write_parameters(content, path, kind)
    back = read_parameters(path)
    assert sorted(one.name for one in back.entries) == sorted(LABELS)
    pressure, curve, before = back["Clt_pKissB3_C"], back["Clt_muB3_CUR"], own["P0.B3"]
    assert isinstance(pressure, Scalar)
    assert isinstance(before, Scalar)
    assert pressure.unit == "bar"
    assert pressure.value == pytest.approx(1e-5 * before.value)
    assert pressure.text == "kiss point of B3"
    efficiency, exact = back["Gbx_etaDrv_C"], own["eta"]
    assert isinstance(efficiency, Scalar)
    assert isinstance(exact, Scalar)
    assert efficiency.value == round(100.0 * exact.value, 1)
    assert isinstance(curve, Curve)
    assert curve.axis.points == (0.0, 50.0, 100.0, 300.0, 900.0)
    assert (curve.axis.name, curve.axis.unit) == ("Clt_nSlip", "rpm")
    law = own["mu.B3"]
    assert isinstance(law, Curve)
    expected = np.interp(np.array(curve.axis.points) * RPM, law.axis.points, law.values)
    assert curve.values == pytest.approx(expected)


def test_edited_values_come_back_in_si(template: Template) -> None:
    own = collect_parameters(twin())
    content = apply_template(own, template)
    curve = content["Clt_muB3_CUR"]
    assert isinstance(curve, Curve)
    edited = replace(
        content,
        scalars=(Scalar("Clt_pKissB3_C", 0.75, "bar"), Scalar("Gbx_etaDrv_C", 95.0, "%")),
        curves=(replace(curve, values=tuple(1.1 * mu for mu in curve.values)),),
    )
    update = update_twin(twin(), restore_entries(edited, own, template))
    assert set(update.changed) == {"P0.B3", "eta", "mu.B3"}
    assert update.twin.get_value("P0.B3", default=0.0) == pytest.approx(0.75e5)
    assert update.twin.get_value("eta", default=0.0) == pytest.approx(0.95)
    friction = update.twin.friction["B3"]
    assert friction.slip[-1] == pytest.approx(900.0 * RPM)
    assert friction.mu == pytest.approx(1.1 * np.array(curve.values))


LABEL = 'label = "a"\n'
WRONG = {
    "no such parameter; did you mean 'eta'": ("etta", LABEL),
    "no known unit of Pa, such as Pa": ("P0.B3", f'{LABEL}unit = "rpm"'),
    "no known unit of N.m/rad": ("k_o", f'{LABEL}unit = "Nm/deg"'),
    "none is named": ("eta", f"{LABEL}in_si = 2.0"),
    "a number has no axis": ("eta", f'{LABEL}axis = {{ name = "x" }}'),
    "exceed the known range": ("mu.B3", f"{LABEL}axis = {{ points = [0.0, 1e4] }}"),
    "do not increase": ("mu.B3", f"{LABEL}axis = {{ points = [1.0, 1.0] }}"),
    "no known unit of rad/s": ("mu.B3", f'{LABEL}axis = {{ unit = "bar" }}'),
}


@pytest.mark.parametrize("says", WRONG)
def test_what_does_not_fit_is_named(says: str) -> None:
    name, body = WRONG[says]
    with pytest.raises(InputError, match=says) as refused:
        apply_template(collect_parameters(twin()), make_template(**{name: body}))
    assert refused.value.where.key == f"parameters.{name}"


@pytest.mark.parametrize(
    "text",
    ["", "[parameters.eta]\n", '[parameters.eta]\nlabel = "a b"\n', '[parameters.eta]\nlabel = ""',
     '[parameters.eta]\nlabel = "1a"\n', '[parameters.eta]\nlabel = "a"\nin_si = 0\nunit = "x"\n',
     '[parameters.eta]\nlabel = "a"\nfactor = 2\n', '[parameters.eta]\nlabel = "a"\nin_si = nan\n',
     '[parameters."mu.B3"]\nlabel = "a"\naxis = { points = [] }\n', "\x00", "[[parameters]]\n"],
)  # fmt: skip
def test_a_damaged_template_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "t.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_template(path)
    assert refused.value.where.file == str(path)


_NUMBERS = st.floats(-1e12, 1e12)
_SIZES = st.floats(1e-6, 1e6)


@st.composite
def labelled(draw: st.DrawFn) -> tuple[ParameterSet, Template]:
    """Numbers and curves, and a template that respells each of them."""
    scalars, curves, tables = [], [], {}
    for k in range(draw(st.integers(1, 4))):
        scalars.append(Scalar(f"s.{k}", draw(_NUMBERS), "Pa"))
        tables[f"s.{k}"] = f'label = "L_{k}"\nunit = "u"\nin_si = {draw(_SIZES)!r}'
    for k in range(draw(st.integers(0, 2))):
        points = sorted(draw(st.sets(st.integers(-1000, 1000), min_size=2, max_size=9)))
        values = tuple(draw(_NUMBERS) for _ in points)
        curves.append(Curve(f"c.{k}", Axis("slip", tuple(map(float, points)), "rad/s"), values))
        along = draw(_SIZES)
        axis = f'name = "A_{k}", unit = "v", in_si = {along!r}, beyond = "hold"'
        if draw(st.booleans()):
            axis += f", points = [{points[0] / along!r}, {points[-1] / along!r}]"
        tables[f"c.{k}"] = f'label = "M_{k}"\naxis = {{ {axis} }}'
    return ParameterSet("set", tuple(scalars), tuple(curves)), make_template(**tables)


@pytest.mark.parametrize("kind", FLAT)
@given(labelled(), st.floats(0.5, 2.0))
def test_round_trip(
    kind: ParameterFormat, given_set: tuple[ParameterSet, Template], factor: float
) -> None:
    own, template = given_set
    back = reread(apply_template(*given_set), kind)
    assert restore_entries(back, own, template).entries == own.entries
    edited = replace(
        back, scalars=tuple(replace(one, value=one.value * factor) for one in back.scalars)
    )
    restored = restore_entries(edited, own, template).scalars
    for one, before in zip(restored, own.scalars, strict=True):
        assert one.name == before.name
        assert one.value == pytest.approx(factor * before.value, rel=1e-12)

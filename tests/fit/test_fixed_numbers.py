# SPDX-License-Identifier: MIT
"""Numbers that are no unknowns: each has a distribution, and widens what depends on it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from drivetwin.errors import InputError
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.findings import Code
from drivetwin.fit.examine import rank_improvements
from drivetwin.fit.fit import fit_network
from drivetwin.fit.fixed_numbers import FixedNumber, Tolerance, list_fixed
from drivetwin.fit.model_file import NetworkFile, format_model, read_model
from drivetwin.fit.number_kinds import USUAL, UsualDeviation
from drivetwin.fit.places import CHANNEL
from drivetwin.fit.result import ModelFit
from drivetwin.fit.synthesize import ModelName
from drivetwin.fit.unknown import Unknown
from drivetwin.simulation.element_schema import ELEMENT_FIELDS, Field, FieldKind
from tests.fit.test_model_file import TEXT
from tests.support.fits import fit_log, make_log, make_small

POINTS = ("speed", "slip", "twist", "throttle", "speed_ratio", "losses.torque", "least_speed")
"""Points at which a table is given, and a numerical limit: exact by definition."""
NUMBERS = (FieldKind.NUMBER, FieldKind.NUMBERS, FieldKind.ROWS)


def list_numbers(fields: Mapping[str, Field], group: str = "") -> Iterator[str]:
    for name, one in fields.items():
        if one.kind in NUMBERS:
            yield group + name
        for inner in one.group:
            yield from list_numbers(inner, f"{group}{name}.")


@pytest.mark.parametrize("kind", ELEMENT_FIELDS)
def test_every_number_of_an_element_has_a_distribution(kind: str) -> None:
    numbers = set(list_numbers(ELEMENT_FIELDS[kind]))
    assert set(USUAL[kind]) == numbers
    exact = {name for name in numbers if USUAL[kind][name] == UsualDeviation()}
    assert all(name.endswith(POINTS) for name in exact)
    assert not any(name.endswith(POINTS) for name in numbers - exact)


WITH_DISTRIBUTION = {"inputs.*.value", "start.speeds.*", "start.twists.*"}
"""Numbers of a model file beside the elements with a distribution of their own."""
OF_CHANNELS = {"scale": "gain", "offset": "offset", "time_shift_s": "delay"}
"""Conversions of a column, with the errors of the channel that have a distribution."""
NO_NUMBERS_OF_THE_MODEL = (
    "unknowns.", "expressions.", "tolerances.", "run.", "inputs.*.sign", "outputs.*.sign",
    "outputs.*.sigma",
)  # fmt: skip
"""Unknowns and distributions themselves, the manoeuvre of a synthesised log, noise of sensors."""


def list_schema_numbers(
    one: Mapping[str, Any], schema: Mapping[str, Any], path: str = ""
) -> Iterator[tuple[str, str]]:
    """Yield the path of each number of a JSON Schema, and the tables in its place."""
    if "$ref" in one:
        name = str(one["$ref"]).rpartition("/")[2]
        if name == "NumberTable":
            yield path, name
            return
        one = schema["$defs"][name]
    if one.get("type") in ("number", "integer") or any(
        isinstance(each, int | float) for each in one.get("enum", ())
    ):
        yield path, ""
    for each in (*one.get("anyOf", ()), *one.get("prefixItems", ())):
        yield from list_schema_numbers(each, schema, path)
    for key in ("items", "additionalProperties"):
        if isinstance(one.get(key), dict):
            below = f"{path}.*" if key == "additionalProperties" else path
            yield from list_schema_numbers(one[key], schema, below)
    for key, each in one.get("properties", {}).items():
        yield from list_schema_numbers(each, schema, f"{path}.{key}" if path else key)


def test_every_number_of_a_model_file_has_a_distribution() -> None:
    schema = NetworkFile.model_json_schema()
    found: dict[str, set[str]] = {}
    for path, table in list_schema_numbers(schema, schema):
        found.setdefault(path, set()).add(table)
    with_table = {path for path, tables in found.items() if "NumberTable" in tables}
    assert with_table == WITH_DISTRIBUTION
    rest = {
        path for path in found.keys() - with_table if not path.startswith(NO_NUMBERS_OF_THE_MODEL)
    }
    conversions = {f"{table}.*.{key}" for table in ("inputs", "outputs") for key in OF_CHANNELS}
    assert rest == conversions
    assert set(OF_CHANNELS.values()) == CHANNEL.keys() - {"curve"}


@pytest.mark.parametrize(
    ("element", "field", "stated", "true"),
    [("lock-up", "friction", {"v_s": 11.0}, 8.0), ("load", "aero", 0.039, 0.03)],
)
def test_a_fixed_number_that_is_off_leaves_the_truth_inside(
    element: str, field: str, stated: object, true: float
) -> None:
    """Held exactly it put 4 and 2 of 9 values outside, with the verdict valid."""
    made = make_log(ModelName.CONVERTER_LOCK_UP, 5)
    elements = [
        {**one, field: {**one[field], **stated} if isinstance(stated, dict) else stated}
        if one["name"] == element
        else one
        for one in made.model.elements
    ]
    found = fit_network(replace(made.model, elements=elements), [made.recording])
    for name, value in made.truth.items():
        low, high = found.intervals[name]
        assert low < value < high, name
        assert found.estimates[name].verdict is Verdict.IDENTIFIED, name
    (moved,) = (one for one in found.moved if one.number.name.startswith(f"{element}.{field}"))
    assert abs(moved.value - true) < 2.0 * moved.std


def fit_small(stiffness: float, tolerance: Tolerance) -> ModelFit:
    model, recording = make_small({"left.stiffness": Unknown(450.0, 100.0)})
    elements = [
        {**one, "stiffness": stiffness} if one["name"] == "right" else one for one in model.elements
    ]
    tolerances = {
        **{name: Tolerance(exact=True) for name in ("motor", "left wheel", "right wheel")},
        "gain.torque": Tolerance(exact=True),
        "right.stiffness": tolerance,
    }
    return fit_network(replace(model, elements=elements, tolerances=tolerances), [recording])


def test_a_number_that_the_recordings_contradict_is_named_and_replaced() -> None:
    found = fit_small(1000.0, Tolerance(std=40.0))
    (finding,) = (one for one in found.findings if one.code is Code.FIXED_NUMBER_OFF)
    assert finding.subject == "right.stiffness"
    assert abs(found.values["left.stiffness"] - 400.0) < 3.0 * found.std["left.stiffness"]
    right = {one["name"]: one for one in found.fitted.elements}["right"]["stiffness"]
    assert right == pytest.approx(800.0, rel=0.01)


def test_an_exact_number_stays() -> None:
    found = fit_small(800.0, Tolerance(exact=True))
    names = {one.number.name for one in found.moved}
    assert names == {"left.damping", "right.damping"}
    (same,) = (one for one in found.fitted.elements if one["name"] == "right")
    assert same["stiffness"] == 800.0


def test_the_friction_has_the_deviation_of_the_gain() -> None:
    """Recordings determine their product alone, however many there are."""
    found = fit_log(ModelName.ENGINE_START)
    value, std = (each["K0.friction.mu_c"] for each in (found.values, found.std))
    assert std / value == pytest.approx(0.05, rel=0.1)
    ranked = {one.unknown: one for one in rank_improvements(found)}["K0.friction.mu_c"]
    assert ranked.known in ("K0.gain", "K0.friction.mu_s")
    assert ranked.then < 0.3 * ranked.now
    assert ranked.repeated == pytest.approx(ranked.now, rel=0.1)


def test_a_point_of_a_converter_map_can_be_an_unknown() -> None:
    """The core has no derivatives by it."""
    made = make_log(ModelName.CONVERTER_LOCK_UP)
    known = {
        name: replace(one, value=made.truth[name]) for name, one in made.model.unknowns.items()
    }
    unknowns = {**known, "converter.map.capacity.1": Unknown(2.6e-3, 3e-4)}
    found = fit_network(replace(made.model, unknowns=unknowns), [made.recording])
    std = found.std["converter.map.capacity.1"]
    assert std < 1e-4
    assert abs(found.values["converter.map.capacity.1"] - 2.4e-3) < 3.0 * std


GEAR = """
[[elements]]
type = "gear"
name = "pair"
a = "end"
b = "out"
ratio = RATIO

[[elements]]
type = "inertia"
name = "out"
node = "out"
inertia = 1.0

"""


def read(folder: Path, change: tuple[str, str]) -> list[FixedNumber]:
    path = folder / "model.toml"
    text = TEXT.replace("[outputs", GEAR.replace("RATIO", change[0]) + "[outputs", 1)
    path.write_text(text + change[1], encoding="utf-8")
    made = read_model(path)
    path.write_text(format_model(*made), encoding="utf-8")
    model, _ = read_model(path)
    places = model.list_places(["T"])
    return list_fixed(model.elements, places, ["wheel.inertia"], model.tolerances)


@pytest.mark.parametrize(
    ("ratio", "tolerance", "std"),
    [
        ("2.1", "", 0.0577),
        ("2.100", "", 0.000577),
        ("2", "", 0.0577),
        ("1.0", "", None),
        ("2.1", '[tolerances."pair.ratio"]\nstd = 0.02', 0.02),
        ("2.1", '[tolerances."pair"]\nexact = true', None),
        ("1.0", '[tolerances."pair.ratio"]\nstd = 0.02', 0.02),
    ],
)
def test_the_written_digits_or_a_tolerance_state_the_deviation_of_a_ratio(
    ratio: str, tolerance: str, std: float | None, tmp_path: Path
) -> None:
    found = {one.name: one.std for one in read(tmp_path, (ratio, tolerance))}
    assert found.get("pair.ratio") == (std and pytest.approx(std, rel=1e-3))
    assert "wheel.inertia" not in found
    assert found["shaft.stiffness"] == 10.0


@pytest.mark.parametrize(
    ("tolerance", "said"),
    [
        ('"pair.ratoi"]\nstd = 0.1', "did you mean 'pair.ratio'"),
        ('"shaft"]\nstd = 0.1', "one standard deviation for shaft.damping, shaft.stiffness"),
        ('"source"]\nstd = 0.1', "one standard deviation for no number"),
        ('"pair.ratio"]\nstd = 0.1\nexact = true', "state std, or exact = true"),
        ('"pair.ratio"]\nexact = false', "state std, or exact = true"),
        ('"pair.ratio"]\nstd = inf', "tolerances.pair.ratio"),
    ],
)
def test_a_tolerance_of_nothing_is_refused(tolerance: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, ("2.1", f"[tolerances.{tolerance}"))
    assert said in str(caught.value)

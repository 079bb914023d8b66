# SPDX-License-Identifier: MIT
"""Model files: what is written reads back equal, and every fault is named by its key."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.channels.roles import ChannelSpec
from drivetwin.errors import InputError
from drivetwin.fit.expression import Expression
from drivetwin.fit.fixed_numbers import Tolerance, list_fixed
from drivetwin.fit.model_file import (
    DrivenInput,
    ModelChannels,
    ModelFileError,
    RunTable,
    format_model,
    read_model,
)
from drivetwin.fit.network_model import NetworkModel
from drivetwin.fit.recording import Samples
from drivetwin.fit.synthesize import ModelName, read_builtin
from drivetwin.fit.unknown import Unknown, get_factors
from drivetwin.modeling.model import Model
from drivetwin.simulation.network import Start

TEXT = """
[[elements]]
type = "torque"
name = "source"
node = "wheel"
input = "T"

[[elements]]
type = "inertia"
name = "wheel"
node = "wheel"
inertia = 2.0

[[elements]]
type = "spring_damper"
name = "shaft"
a = "wheel"
b = "end"
stiffness = 100.0
damping = 1.0

[[elements]]
type = "inertia"
name = "end"
node = "end"
inertia = 1.0

[outputs.speed]
quantity = ["speed", "wheel"]
source = "n"

[start]
speeds = {wheel = 3.0, end = 3.0}

[unknowns."wheel.inertia"]
value = 1.5
std = 0.5
"""

AIR = """[[elements]]
type = "road_load"
name = "air"
node = "end"
constant = 1.0
rolling = 0.0
aero = -0.5

"""
BEARING = """[[elements]]
type = "bearing"
name = "bearing"
a = "end"
b = "ground"
speed = [0.0, 1.0]
torque = [1.0, -1.0]
peak = 1.0

"""

names = st.text(min_size=1, max_size=8).filter(lambda text: "." not in text)
numbers = st.floats(-1e6, 1e6).map(lambda value: value if abs(value) > 1e-100 else 0.0)
positive = st.floats(1e-6, 1e6)
specs = st.builds(
    ChannelSpec,
    source=names,
    unit=st.none() | names,
    sign=st.sampled_from([1, -1]),
    scale=positive,
    offset=numbers,
    time_shift=numbers,
    group=st.none() | names,
)


@st.composite
def models(draw: st.DrawFn) -> tuple[NetworkModel, ModelChannels]:
    """Chain of inertias and shafts with torques on it, some of them recorded."""
    parts = draw(st.lists(names, min_size=4, max_size=8, unique=True))
    nodes = draw(st.lists(names, min_size=2, max_size=4, unique=True))
    nodes = [node for node in nodes if node != "ground"] or ["a"]
    made = Model(draw(names))
    for name, node in zip(parts, nodes, strict=False):
        made.inertia(name, draw(positive), node)
    inputs: dict[str, ChannelSpec] = {}
    constant: dict[str, float] = {}
    for name in parts[len(nodes) :]:
        if draw(st.booleans()):
            given_by = draw(st.none() | specs)
            made.torque(name, nodes[0], 0.0)
            if given_by is None:
                constant[name] = draw(numbers)
            else:
                inputs[name] = given_by
        else:
            stiffness, damping = draw(positive), draw(positive)
            made.spring_damper(name, nodes[0], nodes[-1], stiffness=stiffness, damping=damping)
    made.start(dict.fromkeys(nodes, draw(numbers)))
    bounds = (draw(st.none() | st.floats(1e-9, 1e-8)), draw(st.none() | st.floats(1e7, 1e8)))
    unknowns = {f"{parts[0]}.inertia": Unknown(draw(positive), draw(st.none() | positive), bounds)}
    others = {f"{name}.inertia": draw(positive) for name in parts[1 : len(nodes)]}
    if others:
        unknowns[draw(names)] = Unknown(
            draw(positive), paths=others, unit=draw(st.just("") | names)
        )
    outputs = {draw(names): ("speed", nodes[0])}
    spread = Expression(f"2 * {next(iter(unknowns))!r}", paths=[], value=1.0, std=draw(positive))
    expressions = {"spread": spread} if "spread" not in unknowns else {}
    network = made.describe(unknowns, outputs, None, expressions)  # type: ignore[arg-type]
    known = {nodes[0]: network.start.speeds[nodes[0]]} if draw(st.booleans()) else {}
    run = RunTable(
        end_s=draw(positive), inputs={name: DrivenInput(points=[[0.0, 1.5]]) for name in inputs}
    )
    channels = ModelChannels(
        inputs,
        {name: draw(specs) for name in outputs},
        {name: draw(positive) for name in outputs if draw(st.booleans())},
        {name: draw(st.sampled_from(Samples)) for name in outputs},
        known,
        draw(st.none() | st.just(run)),
    )
    return replace(network, inputs=constant), channels


def describe(model: NetworkModel, channels: ModelChannels) -> dict[str, Any]:
    """Return all that a file states as plain data."""
    start, described = model.start, vars(model) | vars(channels)
    unknowns = {
        name: (one.value, one.std, one.bounds, get_factors(name, one.paths), one.unit)
        for name, one in model.unknowns.items()
    }
    plain = (dict(start.speeds), dict(start.twists), list(start.locked))
    elements = [dict(one) for one in model.elements]
    return {**described, "elements": elements, "start": plain, "unknowns": unknowns}


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(models())
def test_a_written_model_reads_back_equal(
    tmp_path: Path, made: tuple[NetworkModel, ModelChannels]
) -> None:
    path = tmp_path / "model.toml"
    path.write_text(format_model(*made), encoding="utf-8", newline="\n")
    assert describe(*read_model(path)) == describe(*made)


@pytest.mark.parametrize("name", ModelName)
def test_built_in_models_read_back_equal(name: ModelName, tmp_path: Path) -> None:
    made = read_builtin(name)
    path = tmp_path / "model.toml"
    path.write_text(format_model(*made), encoding="utf-8")
    assert describe(*read_model(path)) == describe(*made)


def test_a_column_has_the_name_of_its_input_unless_another_is_stated(tmp_path: Path) -> None:
    model, channels = read_text(tmp_path, TEXT)
    assert channels.inputs == {"T": ChannelSpec("T")}
    assert channels.outputs == {"speed": ChannelSpec("n")}
    assert model.inputs == {}
    constant, channels = read_text(tmp_path, TEXT + "[inputs.T]\nvalue = 3.5\n")
    assert constant.inputs == {"T": 3.5}
    assert channels.inputs == {}


def test_an_open_bound_is_infinite_in_a_file(tmp_path: Path) -> None:
    model, _ = read_text(tmp_path, TEXT + "bounds = [0.5, inf]\n")
    assert model.unknowns["wheel.inertia"].bounds == (0.5, None)


def test_an_input_that_a_file_cannot_state_is_refused() -> None:
    model, _ = read_builtin(ModelName.TIP_IN)
    points = replace(model, inputs={"motor torque": [(0.0, 0.0), (1.0, 2.0)]})
    with pytest.raises(InputError, match="'motor torque' is no constant"):
        format_model(points)


def read_text(folder: Path, text: str) -> tuple[NetworkModel, ModelChannels]:
    path = folder / "model.toml"
    path.write_text(text, encoding="utf-8")
    return read_model(path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("", ""), None),
        (("[start]", "[strat]"), "strat"),
        (("value = 1.5", 'value = "1.5"'), "unknowns.wheel.inertia.value"),
        (("std = 0.5", "std = 0"), "unknowns.wheel.inertia.std"),
        (("std = 0.5", "sdt = 0.5"), "unknowns.wheel.inertia.sdt"),
        (("std = 0.5", "bounds = [2.0, 1.0]"), "bounds are the least and the largest value"),
        (("std = 0.5", "bounds = [nan, 2.0]"), "bounds are the least and the largest value"),
        (("std = 0.5", "bounds = [1.0]"), "unknowns.wheel.inertia.bounds"),
        (("std = 0.5", "paths = 3"), "unknowns.wheel.inertia.paths"),
        (('source = "n"', 'source = "n"\nsign = 2'), "outputs.speed.sign"),
        (('source = "n"', 'source = "n"\nscale = 0.0'), "outputs.speed.scale"),
        (('source = "n"', 'source = "n"\nsigma = inf'), "outputs.speed.sigma"),
        (('quantity = ["speed", "wheel"]', ""), "outputs.speed.quantity"),
        (('["speed", "wheel"]', '["speed"]'), "outputs.speed.quantity"),
        (("{wheel = 3.0, end = 3.0}", "3.0"), "start.speeds"),
        (("end = 3.0}", "end = 3.0}\nknown = ['gear']"), "start.known names gear"),
        (("[start]", "[inputs.U]\nvalue = 1.0\n[start]"), "inputs.U"),
        (("[start]", "[run]\nend_s = -1.0\n[start]"), "run.end_s"),
        (
            ("[start]", "[run]\nend_s = 1.0\n[run.inputs.U]\npoints=[[0.0,1.0]]\n[start]"),
            "inputs.U",
        ),
        (("inertia = 2.0", "inertia = -2.0"), "-2 of inertia 'wheel' is out of range, ≥ 0"),
        (("[outputs", AIR + "[outputs"), "elements[4].aero"),
        (("[outputs", AIR + "[outputs"), "-0.5 of road_load 'air' is out of range, ≥ 0"),
        (("[outputs", BEARING + "[outputs"), "elements[4].torque"),
        (("[start]", "[start"), "no valid TOML"),
    ],
)
def test_a_wrong_key_is_named(change: tuple[str, str], said: str | None, tmp_path: Path) -> None:
    text = TEXT.replace(*change, 1) if change[0] else TEXT
    if said is None:
        read_text(tmp_path, text)
        return
    assert text != TEXT
    with pytest.raises(ModelFileError) as caught:
        read_text(tmp_path, text)
    assert said in f"{caught.value} {caught.value.where}"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("inertia = 2.0", 'inertia = "heavy"'), "wheel: inertia"),
        (("inertia = 2.0", "mass = 2.0"), "wheel: unknown field 'mass'"),
        (('type = "inertia"', 'type = "inertai"'), "did you mean 'inertia'"),
        (("wheel.inertia", "weel.inertia"), "did you mean 'wheel'"),
        (("wheel.inertia", "start.weel"), "did you mean 'start.wheel'"),
        (("wheel.inertia", "delay.U"), "delay.U: no number of the model"),
        (('["speed", "wheel"]', '["sped", "wheel"]'), "did you mean 'speed'"),
        (("value = 1.5", "value = -1.5"), "the value -1.5 is outside 0 to inf"),
    ],
)
def test_a_fault_of_the_driveline_is_named(
    change: tuple[str, str], said: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError) as caught:
        read_text(tmp_path, TEXT.replace(*change, 1))
    assert said in str(caught.value)


@pytest.mark.parametrize("text", ["", "elements = 3", "elements = []", "[elements]", "x = 1"])
def test_a_file_without_elements_is_no_model(text: str, tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match=r"elements|faults|required"):
        read_text(tmp_path, text)


STATED = """[[elements]]
type = "gear"
name = "pair"
a = "end"
b = "49/33"
ratio = "49/33 * 2/1"

[[elements]]
type = "clutch"
name = "K0"
a = "49/33"
b = "ground"
friction.mu_c = {value = 0.1, std = 0.01}
friction.mu_s = 0.12
friction.v_s = {value = 5.0, exact = true}
friction.mu_v = 0.0
gain = {value = 0.02, std = 1e-3}
p0 = 5e4
peak = 1.0
drum_inertia = 0.0
pressure = "p"

[[elements]]
type = "inertia"
name = "out"
node = "49/33"
inertia = {value = 1.0, exact = true}

[inputs.T]
value = {value = 3.5, std = 0.2}

[outputs"""


def test_a_number_may_state_its_distribution(tmp_path: Path) -> None:
    text = TEXT.replace("[outputs", STATED, 1).replace(
        "{wheel = 3.0,", "{wheel = {value = 3, std = 0.1},"
    )
    model, channels = read_text(tmp_path, text)
    assert model.tolerances == {
        "pair.ratio": Tolerance(exact=True),
        "K0.friction.mu_c": Tolerance(0.01),
        "K0.friction.v_s": Tolerance(exact=True),
        "K0.gain": Tolerance(1e-3),
        "out.inertia": Tolerance(exact=True),
        "input.T": Tolerance(0.2),
        "start.wheel": Tolerance(0.1),
    }
    by_name = {one["name"]: one for one in model.elements}
    assert by_name["pair"]["ratio"] == pytest.approx(98.0 / 33.0)
    assert (by_name["pair"]["b"], by_name["out"]["node"]) == ("49/33", "49/33")
    assert (by_name["K0"]["gain"], by_name["K0"]["friction"]["mu_c"]) == (0.02, 0.1)
    assert (model.inputs, channels.known) == ({"T": 3.5}, {"wheel": 3.0})
    places = model.list_places(channels.inputs)
    found = {one.name: one.std for one in list_fixed(model.elements, places, (), model.tolerances)}
    assert (found["input.T"], found["K0.gain"], found["K0.friction.mu_c"]) == (0.2, 1e-3, 0.01)
    assert not found.keys() & {"out.inertia", "K0.friction.v_s", "pair.ratio", "start.wheel"}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("inertia = 2.0", "inertia = {value = 2.0}"), "wheel.inertia is no distribution"),
        (("inertia = 2.0", "inertia = {value = 2.0, sdt = 1.0}"), "tolerances.wheel.inertia.sdt"),
        (("inertia = 2.0", "inertia = {value = 2.0, std = 0.0}"), "tolerances.wheel.inertia.std"),
        (("inertia = 2.0", "inertia = {std = 2.0}"), "wheel: inertia"),
        (("inertia = 2.0", 'inertia = {value = "x", std = 2.0}'), "wheel: inertia"),
        (("inertia = 2.0", 'inertia = "2/0"'), "2/0"),
        (("wheel = 3.0", "wheel = {value = 3.0, sdt = 1}"), "sdt"),
        (("wheel = 3.0", 'wheel = {value = "fast"}'), "start.speeds.wheel"),
        (
            ("[unknowns", "[tolerances.'shaft.damping']\nstd = 0.1\n[unknowns"),
            "'tolerances.shaft.damping': stated twice",
        ),
        (("[unknowns", "[expressions.x]\nformula = 3\n[unknowns"), "expressions.x.formula"),
        (("[unknowns", "[expressions.'end.inertia']\nformula = 'J'\n[unknowns"), "'J': no unknown"),
    ],
)
def test_a_wrong_distribution_or_function_is_named(
    change: tuple[str, str], said: str, tmp_path: Path
) -> None:
    text = TEXT.replace("damping = 1.0", "damping = {value = 1.0, std = 0.1}")
    if "twice" not in said:
        text = TEXT
    with pytest.raises(InputError) as caught:
        read_text(tmp_path, text.replace(*change, 1))
    assert said in f"{caught.value} {caught.value.where}"


def test_a_function_of_python_cannot_be_written() -> None:
    model, _ = read_builtin(ModelName.TIP_IN)
    name = next(iter(model.unknowns))
    given = {"twice": Expression(lambda x: 2.0 * x, (name,), paths=[])}
    with pytest.raises(InputError, match="'twice' is a function"):
        format_model(replace(model, expressions=given))


def test_all_faults_are_reported_together(tmp_path: Path) -> None:
    text = TEXT.replace("std = 0.5", "std = -1.0").replace("[start]", "[strat]")
    with pytest.raises(ModelFileError) as caught:
        read_text(tmp_path, text)
    assert "2 faults" in str(caught.value)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match="file"):
        read_model(tmp_path / "absent.toml")


def test_a_start_of_known_nodes_has_their_speeds(tmp_path: Path) -> None:
    _, channels = read_text(tmp_path, TEXT.replace("[start]", '[start]\nknown = ["wheel"]'))
    assert channels.known == {"wheel": 3.0}
    model, _ = read_text(tmp_path, TEXT)
    assert model.start == Start({"wheel": 3.0, "end": 3.0})
    assert not any(math.isnan(value) for value in model.start.speeds.values())

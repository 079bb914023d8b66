# SPDX-License-Identifier: MIT
"""Unknowns against the elements: paths, bounds by the fields, coordinates."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import InputError
from drivetwin.fit.places import list_places
from drivetwin.fit.unknown import Unknown, resolve_unknown
from drivetwin.simulation.network import Element, Start, build_element

MAP = {"speed_ratio": [0.0, 0.8, 1.0], "capacity": [3e-3, 2e-3, 0.0], "torque_ratio": [1.9, 1.1, 1]}
ELEMENTS: list[Element] = [
    build_element("inertia", "engine", node="engine", inertia=0.2),
    build_element("torque_converter", "converter", pump="engine", turbine="turbine", map=MAP),
    build_element("clutch", "K0", a="engine", b="turbine", gain=0.01, p0=8e4, peak=1.0,
        friction={"mu_c": 0.11, "mu_s": 0.13, "v_s": 15.0, "mu_v": 0.0}, pressure="p",
        drum_inertia=0.0),
    build_element("road_load", "load", node="turbine", constant=3.0, rolling=0.0, aero=0.0),
]  # fmt: skip
START = Start({"engine": 3.0})
PLACES = list_places(ELEMENTS, START, ["p"], {"T": 5.0}, {"n": ("speed", "engine")})


@given(st.floats(1e-6, 1e6), st.floats(1e-3, 1e3))
def test_a_positive_number_is_sought_by_its_logarithm(value: float, std: float) -> None:
    one = resolve_unknown("engine.inertia", Unknown(value, std), PLACES)
    assert one.is_positive
    assert one.start == pytest.approx(math.log(value))
    assert one.spread == pytest.approx(std / value)
    assert one.to_value(one.to_coordinate(value)) == pytest.approx(value)


def test_units_and_limits_come_from_the_elements() -> None:
    one = resolve_unknown("engine.inertia", Unknown(0.2), PLACES)
    assert one.spec.unit == "kg*m^2"
    assert (one.spec.lower, one.spec.upper) == (0.0, math.inf)
    assert resolve_unknown("K0.friction.mu_c", Unknown(0.1), PLACES).spec.unit == "1"
    assert resolve_unknown("delay.p", Unknown(0.0), PLACES).spec.unit == "s"
    assert not resolve_unknown("start.engine", Unknown(3.0), PLACES).is_positive


def test_a_number_of_a_table_is_addressed_by_its_place() -> None:
    one = resolve_unknown("converter.map.capacity.1", Unknown(2e-3, 1e-3), PLACES)
    assert one.factors == {"converter.map.capacity.1": 1.0}


def test_bounds_narrow_the_limits_and_a_factor_scales_those_of_its_field() -> None:
    stated = Unknown(0.2, bounds=(0.1, None))
    assert resolve_unknown("engine.inertia", stated, PLACES).spec.lower == 0.1
    narrow = resolve_unknown("engine.inertia", Unknown(0.2, bounds=(0.1, 0.4)), PLACES)
    assert narrow.limits == pytest.approx((math.log(0.1), math.log(0.4)))
    mirrored = Unknown(-0.2, paths={"engine.inertia": -1.0})
    spec = resolve_unknown("inverse", mirrored, PLACES).spec
    assert (spec.lower, spec.upper) == (-math.inf, 0.0)


@pytest.mark.parametrize(
    ("name", "said", "remedy"),
    [
        (
            "K1.gain",
            "K1.gain: no number of the model; known here",
            "engine, converter, K0, load",
        ),
        ("K0.friction.mu_x", "did you mean 'K0.friction.mu_", "K0.friction.mu_c, K0.friction.mu_s"),
        ("K0.friction", "did you mean 'K0.friction.", "K0.friction.v_s"),
        ("K0.gain.x", "K0.gain.x: no number of the model; did you mean 'K0.gain'", ""),
        ("K0.pressure", "K0.pressure: no number of the model", "K0.gain, K0.p0"),
        ("converter.map.capacity", "name one of the list, such as converter.map.capacity.0", ""),
        ("converter.map.capacity.9", "no number of the model", "converter.map.capacity"),
        ("converter.map.capacity.9.2", "no number of the model", ""),
        ("converter.map.capacity.x", "no number of the model", ""),
        ("", "no number of the model", "engine, converter, K0, load"),
    ],
)
def test_a_path_that_leads_to_no_number_is_named_with_the_known_ones(
    name: str, said: str, remedy: str
) -> None:
    with pytest.raises(InputError) as caught:
        resolve_unknown(name, Unknown(1.0), PLACES)
    assert said in caught.value.what
    assert remedy in caught.value.remedy


@given(st.lists(st.sampled_from(["K0", "converter", "map", "capacity", "1", "-1", "x", ""])))
def test_any_path_is_resolved_or_refused(parts: list[str]) -> None:
    try:
        resolve_unknown(".".join(parts), Unknown(1.0), PLACES)
    except InputError:
        return


@pytest.mark.parametrize(
    ("unknown", "said"),
    [
        (Unknown(-1.0), "the value -1 is outside 0 to inf"),
        (Unknown(math.nan), "the value nan"),
        (Unknown(1.0, bounds=(2.0, 3.0)), "the value 1 is outside 2 to 3"),
        (Unknown(1.0, 0.0), "the standard deviation 0 is no spread"),
        (Unknown(1.0, math.nan), "the standard deviation nan"),
        (Unknown(1.0, paths={}), "there is no path"),
        (Unknown(1.0, paths={"engine.inertia": 0.0}), "a factor is zero"),
    ],
)
def test_impossible_numbers_are_refused(unknown: Unknown, said: str) -> None:
    with pytest.raises(InputError, match=said):
        resolve_unknown("engine.inertia", unknown, PLACES)


@pytest.mark.parametrize(
    ("name", "unit", "positive"),
    [
        ("gain.n", "1", True),
        ("gain.p", "1", True),
        ("offset.n", "rad/s", False),
        ("offset.p", "Pa", False),
        ("delay.n", "s", False),
        ("delay.p", "s", False),
        ("input.T", "1", False),
        ("start.engine", "rad/s", False),
    ],
)
def test_numbers_beside_the_elements_have_units(name: str, unit: str, positive: bool) -> None:
    one = resolve_unknown(name, Unknown(1.0), PLACES)
    assert one.spec.unit == unit
    assert one.is_positive == positive


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("start.engin", "start.engin: .* did you mean 'start.engine'"),
        ("delay.q", "delay.q: no number of the model; did you mean 'delay.p'"),
        ("gain.T", "gain.T: no number of the model"),
        ("input.p", "input.p: no number of the model"),
        ("offset", "offset: no number of the model"),
    ],
)
def test_numbers_beside_the_elements_need_a_name_of_the_network(name: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        resolve_unknown(name, Unknown(1.0), PLACES)

# SPDX-License-Identifier: MIT
"""The examples of the page on elements run, and the core refuses what its tables exclude."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from drivetwin._native import simulate_network
from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.element_schema import ELEMENT_FIELDS, GROUND, list_ports
from drivetwin.simulation.network import OutputKind, Start, simulate

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "reference" / "elements.md").read_text(
    encoding="utf-8"
)
TIME = np.array([0.0, 0.01])
INPUTS = {"P B2", "P F1", "T_e", "pedal", "wheel speed"}


def sections() -> dict[str, str]:
    """Text below each heading that is the name of a type."""
    parts = re.split(r"^## ([a-z_]+)$", PAGE, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


SECTIONS = sections()


def documented(kind: str, group: str) -> dict[str, str]:
    """Fields with their defaults from a table; `group` is the head of its first column."""
    table = SECTIONS[kind].split(f"| {group} | unit |", 1)[1].split("\n\n", 1)[0]
    rows = re.findall(r"^\| `(\w+)` \|.*\| ([^|;]+)(?:;[^|]*)? \|$", table, re.MULTILINE)
    return dict(rows)


def example(kind: str) -> dict[str, Any]:
    (text,) = re.findall(r"^```json\n(.*?)^```", SECTIONS[kind], re.MULTILINE | re.DOTALL)
    element = json.loads(text)
    assert isinstance(element, dict)
    return element


def run(element: Mapping[str, Any]) -> str:
    """Status of a short run in which every node of the element has an inertia and stands still."""
    nodes = sorted(set(list_ports(element).values()) - {GROUND})
    masses = [
        {"type": "inertia", "name": f"mass of {node}", "node": node, "inertia": 1.0}
        for node in nodes
    ]
    zero = Signal(TIME, np.zeros(2))
    start = Start(dict.fromkeys(nodes, 0.0))
    inputs = dict.fromkeys(INPUTS, zero)
    return simulate([element, *masses], inputs, start, TIME, []).status


def accepted(element: Mapping[str, Any]) -> list[str]:
    """What the core lists where it refuses a field or type."""
    options = (1e-12, np.inf, None, True, False)
    with pytest.raises(ValueError, match=r"expected one of|expected `") as caught:
        simulate_network(json.dumps([element]), [], (([], []), ([], [], [])), TIME, options)
    return re.findall(r"`(\w+)`", str(caught.value))[1:]


@pytest.mark.parametrize("kind", SECTIONS)
def test_a_misspelt_field_is_refused_with_a_suggestion(kind: str) -> None:
    element = example(kind)
    key = list(element)[-1]
    wrong = {name if name != key else f"{name}s": value for name, value in element.items()}
    with pytest.raises(InputError, match=f"unknown field '{key}s'; did you mean '{key}'"):
        run(wrong)


def test_every_type_has_its_section() -> None:
    assert list(ELEMENT_FIELDS) == list(SECTIONS)
    assert list(SECTIONS) == accepted({"type": "none", "name": "x", "node": "n"})


@pytest.mark.parametrize("kind", SECTIONS)
def test_the_example_names_every_field_and_runs(kind: str) -> None:
    element = example(kind)
    assert element["type"] == kind
    assert set(element) == {"type", "name", *documented(kind, "field")}
    assert run(element) == "completed"


@pytest.mark.parametrize("kind", SECTIONS)
def test_the_fields_are_those_of_the_core(kind: str) -> None:
    fields = accepted({**example(kind), "nonsense": 1.0})
    assert sorted(fields) == sorted(["name", *documented(kind, "field")])


@pytest.mark.parametrize("kind", SECTIONS)
def test_what_is_called_required_is(kind: str) -> None:
    element = example(kind)
    for field, default in documented(kind, "field").items():
        rest = {key: value for key, value in element.items() if key != field}
        if default == "required":
            with pytest.raises(InputError, match=f"missing field '{field}'"):
                run(rest)
        else:
            assert run(rest) == "completed"


NESTED = [
    ("gear", "loss"),
    ("gear", "losses"),
    ("clutch", "drag"),
    ("torque_converter", "map"),
    ("engine_map", "map"),
]


@pytest.mark.parametrize(("kind", "group"), NESTED)
def test_the_fields_of_a_group_are_those_of_the_core(kind: str, group: str) -> None:
    element = example(kind)
    fields = documented(kind, f"field of `{group}`")
    assert set(element[group]) == set(fields)
    assert accepted({**element, group: {**element[group], "nonsense": 1.0}}) == list(fields)
    for field, default in fields.items():
        part = {key: value for key, value in element[group].items() if key != field}
        if default == "required":
            with pytest.raises(InputError, match=f"missing field '{field}'"):
                run({**element, group: part})
        else:
            assert run({**element, group: part}) == "completed"


def test_every_kind_of_output_is_listed() -> None:
    table = PAGE.split("| kind of output |")[1].split("\n\n")[0]
    assert re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE) == list(get_args(OutputKind))

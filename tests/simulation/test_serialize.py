# SPDX-License-Identifier: MIT
"""Descriptions and arrays on their way to the core, and what is refused there by name."""

from __future__ import annotations

import json
import math
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import FrictionTable
from drivetwin.simulation.network import Start
from drivetwin.simulation.serialize import as_array, as_json, as_names


def test_what_describes_may_be_of_dataclasses_numpy_and_mappings() -> None:
    table = FrictionTable((0.0, 5.0), (0.12, 0.1))
    given = [MappingProxyType({"friction": table, "gain": np.float32(0.5), "n": np.arange(3)})]
    plain = [{"friction": {"slip": [0.0, 5.0], "mu": [0.12, 0.1]}, "gain": 0.5, "n": [0, 1, 2]}]
    assert json.loads(as_json(given)) == plain


@pytest.mark.parametrize(
    ("description", "message"),
    [
        ({"c_o": math.nan, "k_o": 1.0}, "number: c_o"),
        ([{"name": "J a", "inertia": math.inf}], r"number: \[J a\]\.inertia"),
        ({"elements": [{"mu": np.array([0.1, math.nan])}]}, r"number: elements\[0\]\.mu\[1\]"),
        ([{"inertia": {"radius"}}], "{'radius'} in the description"),
    ],
)
def test_what_is_no_description_is_refused_by_name(description: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        as_json(description)


@pytest.mark.parametrize("values", [[[1.0]], ["on"], [object()]])
def test_what_is_no_column_of_numbers_is_refused(values: Any) -> None:
    with pytest.raises(InputError, match="an array"):
        as_array(values)


def test_names_are_a_list_and_a_text_is_none() -> None:
    assert as_names(("B2", "B3")) == ["B2", "B3"]
    with pytest.raises(InputError, match="'B2' where a list"):
        Start({"engine": 100.0}, locked="B2")  # type: ignore[arg-type]

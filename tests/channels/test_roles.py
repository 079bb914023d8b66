# SPDX-License-Identifier: MIT
"""The role of a pressure and the element it belongs to, there and back."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.channels.roles import (
    ROLES,
    Quantity,
    get_command_element,
    get_element,
    get_pressure_element,
    get_quantity,
    make_command_role,
    make_pressure_role,
)


@given(st.text())
def test_an_element_returns_from_the_role_of_its_pressure(element: str) -> None:
    assert get_pressure_element(make_pressure_role(element)) == element
    assert get_quantity(make_pressure_role(element)) is Quantity.PRESSURE


@given(st.text())
def test_an_element_returns_from_the_role_of_its_command(element: str) -> None:
    role = make_command_role(element)
    assert get_command_element(role) == get_element(role) == element
    assert get_pressure_element(role) is None
    assert get_quantity(role) is Quantity.PRESSURE


@pytest.mark.parametrize("role", [*ROLES, "pressure", "P.pressure."])
def test_other_roles_are_the_pressure_of_nothing(role: str) -> None:
    assert get_pressure_element(role) is None

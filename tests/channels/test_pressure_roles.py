# SPDX-License-Identifier: MIT
"""The role of a pressure and the element it belongs to, there and back."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.channels.pressure_roles import pressed_element, pressure_role
from drivetwin.channels.roles import ROLES, quantity_of
from drivetwin.channels.shiftlog import Quantity


@given(st.text())
def test_an_element_returns_from_the_role_of_its_pressure(element: str) -> None:
    assert pressed_element(pressure_role(element)) == element
    assert quantity_of(pressure_role(element)) is Quantity.PRESSURE


@pytest.mark.parametrize("role", [*ROLES, "pressure", "P.pressure."])
def test_other_roles_are_the_pressure_of_nothing(role: str) -> None:
    assert pressed_element(role) is None

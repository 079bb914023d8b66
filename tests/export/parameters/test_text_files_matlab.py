# SPDX-License-Identifier: MIT
"""The MATLAB script against an example written by hand."""

from __future__ import annotations

import pytest

from drivetwin.errors import InputError
from drivetwin.export.parameters.content import Axis, Curve, ParameterSet, Scalar
from drivetwin.export.parameters.files import ParameterFormat
from tests.export.parameters.sample import format_parameters, parse_parameters

CONTENT = ParameterSet(
    "truck",
    (Scalar("P0.B3", 82000.0, "Pa", "fill ends; 95 % sure"), Scalar("end", -1.5)),
    (Curve("mu.B3", Axis("slip", (0.0, 20.0), "rad/s"), (0.13, 1e-22), text="friction"),),
    notes=("drivetwin",),
)

EXPECTED = """%% Parameters of truck
% drivetwin

P0_B3 = 82000.0; % [Pa] fill ends; 95 % sure (P0.B3)
p_end = -1.5; % [1] (end)

mu_B3_slip = [0.0 20.0]; % [rad/s] breakpoints slip of mu_B3
mu_B3 = [0.13 1.0e-22]; % [1] friction (mu.B3)
"""


def test_the_text_is_that_of_the_example() -> None:
    assert format_parameters(CONTENT, ParameterFormat.M) == EXPECTED


def test_lines_by_hand_are_read_and_the_rest_is_named() -> None:
    text = "clear all\nk_o=1.8e5;\nv = [1, 2,3]; % [m] no axis\n% remark\n\n"
    found = parse_parameters(text, ParameterFormat.M, "by_hand.m")
    assert found.scalars == (Scalar("k_o", 1.8e5),)
    assert found.skipped == ("clear all", "v")


def test_a_name_too_long_for_its_breakpoints_is_refused() -> None:
    """Cut to 63 characters the breakpoints would have the name of the curve and be overwritten."""
    curve = Curve("mu." + 60 * "x", Axis("slip", (0.0, 20.0)), (0.13, 0.12))
    with pytest.raises(InputError, match="both written as"):
        format_parameters(ParameterSet("t", (), (curve,)), ParameterFormat.M)

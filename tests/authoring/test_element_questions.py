# SPDX-License-Identifier: MIT
"""Map of the torque converter on a new card."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import InputError
from tests.authoring.sessions import load_session, make_session

MAP = "0:1.9:900, 0.8:1.09:640, 1:1:0"
PLAIN = {
    "--ratios": "1.86,1.41", "--gears": "2,3", "--elements": "B2,B3", "--final-drive": "4.88",
    "--engine-inertia": "4..20", "--vehicle-inertia": "2500..6500",
}  # fmt: skip


def _make_session(converter: str) -> Any:
    return make_session({**PLAIN, "--converter": converter}, ["P0_bar=0.8,gain_m3=0.03"])


def test_a_map_comes_back_from_the_card(tmp_path: Path) -> None:
    session = _make_session(MAP)
    session.fill_defaults()
    converter = load_session(session, tmp_path).converter
    assert converter is not None
    assert converter.speed_ratio == (0.0, 0.8, 1.0)
    assert converter.torque_ratio == (1.9, 1.09, 1.0)
    pump = float(converter.compute_pump_torque(104.72, 0.0))
    assert pump == pytest.approx(900.0, rel=1e-4)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("0:1.9", "no point NU:MU:TORQUE"),
        ("0:1.9:900:1", "no point NU:MU:TORQUE"),
        ("0:1.9:x, 1:1:0", "no number"),
        ("0:1.9:900", "at least 2"),
        ("1:1:0, 0:1.9:900", "must increase"),
        ("0:1.9:900, 0.8:2:640, 1:1:0", "more power leaves than enters"),
        ("0:-1:900, 1:1:0", "must not be negative"),
    ],
)
def test_a_map_that_cannot_be_is_refused_with_the_reason(text: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        _make_session(text)


@given(st.text(alphabet="0123456789.:,; -+en", max_size=40))
def test_any_text_is_a_map_or_refused(text: str) -> None:
    try:
        session = _make_session(text)
    except InputError as fault:
        assert "--converter" in str(fault)  # noqa: PT017
    else:
        assert session.answers

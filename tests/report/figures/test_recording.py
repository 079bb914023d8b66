# SPDX-License-Identifier: MIT
"""The whole log: its shifts shaded, a button for each."""

from __future__ import annotations

from drivetwin.report.figures.recording import plot_log
from tests.report.sample import SHIFT, log


def test_each_shift_has_a_button_and_its_phases() -> None:
    figure = plot_log(log(), [SHIFT])
    labels = [button.label for button in figure.layout.updatemenus[0].buttons]
    assert labels == ["whole", "2→3, 1.6 s"]
    assert [(s.x0, s.x1) for s in figure.layout.shapes] == [
        SHIFT.torque_phase,
        SHIFT.inertia_phase,
    ]


def test_a_shift_is_named_once_where_its_phases_have_no_room_for_numbers() -> None:
    (name,) = plot_log(log(), [SHIFT]).layout.annotations
    assert name.text == "<b>2→3</b>"
    assert SHIFT.torque_phase[0] < name.x < SHIFT.inertia_phase[1]


def test_without_shifts_nothing_is_shaded() -> None:
    figure = plot_log(log())
    assert not figure.layout.shapes
    assert tuple(figure.layout.xaxis.range) == (0.0, 2.999)

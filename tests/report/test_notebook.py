# SPDX-License-Identifier: MIT
"""What results show in a notebook."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel
from drivetwin.twin.build import build_twin
from tests.report.sample import card, log, simulated, validation


def test_a_summary_fits_a_terminal_and_names_every_parameter() -> None:
    text = str(simulated().summary())
    assert max(len(line) for line in text.splitlines()) <= 80
    assert all(name in text.split() for name in simulated().estimates)
    assert "τ_e: the engine torque is constant; record throttle steps" in text
    assert "Warnings\n  Engine torque varies by only 1.0 %" in text
    assert repr(simulated().summary()) == text


def test_numbers_stand_in_display_units_with_their_interval() -> None:
    lines = [line.split() for line in str(simulated().summary()).splitlines()]
    assert ["Fill", "pressure", "P0", "(B3)", "0.820", "0.043", "bar", "identified"] in lines
    delay = next(line for line in lines if line[:3] == ["Engine", "torque", "delay"])
    assert delay[3:] == ["τ_e", "–", "–", "ms", "not", "identifiable", "(2)"]


def test_the_rich_representation_escapes_names() -> None:
    html = simulated()._repr_html_()
    assert "sample &lt;1&gt;.csv" in html
    assert "<1>" not in html
    assert html.count("<table") == 4


def test_a_twin_shows_its_friction() -> None:
    twin = build_twin(simulated(), card())
    assert [trace.name for trace in twin.plot().data if trace.name] == ["B3"]
    assert "Twin of sample truck" in str(twin.summary())


def test_a_log_shows_every_channel_in_its_unit() -> None:
    names = {trace.name for trace in log().plot().data}
    assert names == {
        "engine torque",
        "output torque",
        "pressure B2",
        "pressure B3",
        "input speed",
        "output speed",
        "wheel speed",
    }
    lines = str(log().summary()).splitlines()
    assert any("pressure.B2" in line and line.endswith("bar") for line in lines)


def test_channels_of_any_quantity_are_shown() -> None:
    time = np.arange(0.0, 3.0, 0.1)
    gear = Channel("gear", Quantity.STATE, time, np.full(30, 2.0), "G", "")
    pedal = Channel("throttle", Quantity.FRACTION, time, np.full(30, 0.6), "P", "%")
    more = replace(log(), channels={"gear": gear, "throttle": pedal})
    assert len(more.plot().data) == 2
    assert "60" in str(more.summary())


def test_a_validation_is_the_figure_of_the_report() -> None:
    assert "simulated" in {trace.name for trace in validation().plot().data}
    assert "simulated: completed" in str(validation().summary())

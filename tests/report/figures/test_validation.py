# SPDX-License-Identifier: MIT
"""Simulation over measurement: overview, slip from both speeds, signals beyond the fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.result.validation import SignalTrace
from drivetwin.report.figures.validation import (
    build_validation_panels,
    plot_further_signals,
    plot_overview,
)
from tests.report.sample import SHIFT, TIME, validation


def test_the_overview_has_torque_and_speed_of_the_shift() -> None:
    assert [panel.quantity for panel in plot_overview(validation()).panels] == [
        "output torque",
        "input speed",
    ]
    start, end = plot_overview(validation()).layout.xaxis.range
    assert start < SHIFT.torque_phase[0] < SHIFT.lockup_time < end


def test_without_an_output_torque_the_overview_has_two_speeds() -> None:
    one = validation()
    traces = {name: each for name, each in one.traces.items() if name != "output_torque"}
    panels = plot_overview(replace(one, traces=traces)).panels
    assert [panel.quantity for panel in panels] == ["input speed", "output speed"]


def test_measured_slip_of_a_held_element_is_zero() -> None:
    one = validation()
    start, lockup = SHIFT.torque_phase[0], SHIFT.lockup_time + 0.01
    held = {"B2": np.less(TIME, start), "B3": np.greater(TIME, lockup)}
    slips = {name: np.zeros(TIME.size) for name in held}
    run = replace(one.trajectory, slip=slips)
    panels = {
        panel.quantity: panel for panel in plot_further_signals(replace(one, trajectory=run)).panels
    }
    for name, inside in held.items():
        simulated, measured = panels[f"slip of {name}"].curves
        assert (measured.name, simulated.name) == ("measured", "simulated")
        assert np.mean(measured.values[inside]) == pytest.approx(0.0, abs=0.5)
        assert np.abs(np.mean(measured.values[~inside])) > 5.0


def test_signals_beyond_the_fit_have_panels_of_their_own() -> None:
    speed = SignalTrace(TIME, np.full_like(TIME, 9.0), np.full_like(TIME, 8.0), 9.0)
    panels = plot_further_signals(replace(validation(), extra_traces={"wheel_speed": speed})).panels
    wheel, residual = panels[-2:]
    assert (wheel.quantity, residual.quantity) == ("wheel speed", "residual")
    assert residual.curves[0].values == pytest.approx(np.ones(TIME.size))


@pytest.mark.parametrize(("factor", "label"), [(1.0, "Nm"), (4.0, "kNm")])
def test_large_torques_are_shown_in_kilo(factor: float, label: str) -> None:
    one = validation()
    trace = one.traces["output_torque"]
    grown = replace(trace, measured=factor * trace.measured, simulated=factor * trace.simulated)
    panels = build_validation_panels(replace(one, traces={**one.traces, "output_torque": grown}))
    assert {p.display.label for p in panels if p.quantity == "output torque"} == {label}

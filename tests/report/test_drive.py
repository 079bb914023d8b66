# SPDX-License-Identifier: MIT
"""Page and table of a drive."""

from __future__ import annotations

import re

import numpy as np
import pytest

from drivetwin.drive import DriveRun, load_powertrain, plan_launch, run
from drivetwin.gearbox import load_gearbox
from drivetwin.report.drive import (
    format_traces,
    plot_energy,
    plot_maneuver,
    plot_motion,
    render_drive,
)


@pytest.fixture(scope="module")
def motion() -> DriveRun:
    box, car = load_gearbox("simpson-3"), load_powertrain("car-350nm")
    return run(box, car, plan_launch(box, car.control))


def test_page_opens_offline_and_shows_every_shift(motion: DriveRun) -> None:
    page = render_drive(motion, "A <drive>")
    assert "A &lt;drive&gt;" in page
    assert not re.findall(r'(?:src|href)="https?:', page)
    # The drive, its two shifts, the energy.
    assert page.count("<figure>") == 4
    for each in motion.maneuvers:
        assert each.action.label in page


def test_traces_are_the_motion(motion: DriveRun) -> None:
    names, units, *rows = format_traces(motion).splitlines()
    assert names.split(",")[:3] == ["time", "engine_speed", "input_speed"]
    assert units.split(",")[:3] == ["s", "rad/s", "rad/s"]
    table = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    assert np.allclose(table[:, 0], motion.time[::10])
    assert np.allclose(table[:, 1], motion.engine_speed[::10], rtol=1e-8)


def test_energy_closes_from_the_written_columns(motion: DriveRun) -> None:
    """Works of engine and road, heats, and gains of stored energy on every row."""
    names, _, *rows = format_traces(motion).splitlines()
    table = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    columns = dict(zip(names.split(","), table.T, strict=True))
    parts = {
        name: values for name, values in columns.items() if name.startswith(("work.", "heat."))
    }
    parts |= {n: values - values[0] for n, values in columns.items() if n.startswith("energy.")}
    largest = max(float(np.abs(values).max()) for values in parts.values())
    assert np.abs(np.sum(list(parts.values()), axis=0)).max() < 1e-8 * largest
    assert {"pedal", "brake_torque", "pump_torque", "turbine_torque"} <= set(columns)
    taken = columns["pump_torque"] * columns["engine_speed"]
    given = columns["turbine_torque"] * columns["input_speed"]
    assert (taken - given).min() > -1e-6 * np.abs(taken).max()


def test_figures_show_display_units_and_all_elements(motion: DriveRun) -> None:
    whole = plot_motion(motion)
    for figure in (whole, plot_energy(motion)):
        assert len(figure.to_plotly().data) == len(figure.data)
    assert {"engine", "speed ratio", "lock-up", "direct"} <= {trace.name for trace in whole.data}
    engine = next(trace for trace in whole.data if trace.name == "engine")
    assert max(engine.y) == pytest.approx(motion.engine_speed.max() * 30.0 / np.pi, rel=1e-6)
    single = plot_maneuver(motion, motion.maneuvers[-1])
    start, end = single.layout.xaxis.range
    assert start < motion.maneuvers[-1].action.start < motion.maneuvers[-1].action.end < end
    (bars,) = plot_energy(motion).data
    assert dict(zip(bars.y, bars.x, strict=True))["direct"] == pytest.approx(
        motion.work["direct"] / 1e3
    )

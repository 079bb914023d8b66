# SPDX-License-Identifier: MIT
"""Freewheels and a converter in a gearbox card, and the refusal of power splits."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetwin.errors import CardError, InputError, NoFixedRatioError, ReductionError
from drivetwin.gearbox import (
    Gearbox,
    build_network_elements,
    compare,
    load_gearbox,
    reduce,
    solve_gear,
)
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Start, build_element, simulate

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "gearbox-card.md"
GEOMETRY = "surfaces = 8\narea_m2 = 0.02\nradius_m = 0.1\n"
CARD = f"""
name = "three speeds"
source = "test"
input = "input"
output = "output"
friction = {{ mu_c = 0.12, mu_s = 0.12, v_s_rad_s = 10.0 }}
inertia_kgm2 = {{ engine = 0.1, input = 0.05, S1 = 0.01, R1 = 0.02, output = 0.05 }}

[sets.P]
sun = "S1"
ring = "R1"
carrier = "output"
z = 2.5

[elements.LC]
kind = "clutch"
members = ["engine", "input"]
{GEOMETRY}
[elements.C1]
kind = "clutch"
members = ["input", "S1"]
{GEOMETRY}
[elements.C2]
kind = "clutch"
members = ["input", "R1"]
{GEOMETRY}
[elements.B]
kind = "brake"
members = ["S1"]
{GEOMETRY}
[elements.F]
kind = "freewheel"
members = ["R1"]

[[gears]]
name = "1"
elements = ["C1", "F", "LC"]
ratio = 3.5

[[gears]]
name = "2"
elements = ["C2", "B", "LC"]
ratio = 1.4

[[gears]]
name = "3"
elements = ["C2", "C1", "LC"]
ratio = 1.0

[converter]
pump = "engine"
turbine = "input"
speed_ratio = [0.0, 0.5, 0.8, 0.9, 1.0, 1.1]
torque_ratio = [1.9, 1.4, 1.1, 1.0, 1.0, 1.0]
pump_torque_at_1000rpm_Nm = [180, 170, 130, 90, 0, -30]

[drive]
engine_inertia_kgm2 = 0.2
engine_torque_Nm = 150.0
overrun_torque_Nm = -40.0
engine_speed_rpm = 2000.0
final_drive = 3.5
vehicle_inertia_kgm2 = 150.0
shaft_stiffness_Nm_rad = 8000.0
shaft_damping_Nms_rad = 20.0
load_torque_Nm = 100.0
"""


def card(folder: Path, *changes: tuple[str, str]) -> Gearbox:
    text = CARD
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / "card.toml"
    path.write_text(text, encoding="utf-8")
    return load_gearbox(path)


def test_ratios_are_counted_from_the_turbine_with_and_without_the_lock_up(tmp_path: Path) -> None:
    box = card(tmp_path, ('"F", "LC"]', '"F"]'))
    assert [solve_gear(box, name).ratio for name in "123"] == pytest.approx([3.5, 1.4, 1.0])
    assert solve_gear(box, "1").speeds["engine"] is None
    assert solve_gear(box, "2").speeds["engine"] == pytest.approx(1.0)
    assert solve_gear(box, "1").get_torque("F", "R1") == pytest.approx(2.5)


def test_a_freewheel_against_its_direction_is_refused(tmp_path: Path) -> None:
    freewheel = 'kind = "freewheel"\nmembers = ["R1"'
    box = card(tmp_path, (freewheel, f'{freewheel}, "ground"'))
    with pytest.raises(InputError, match="the freewheel F would have to take torque from ground"):
        solve_gear(box, "1")


def test_a_freewheel_that_would_block_another_gear_is_named(tmp_path: Path) -> None:
    free = '[elements.G]\nkind = "freewheel"\nmembers = ["R1", "ground"]\n\n[[gears]]'
    box = card(tmp_path, ("[[gears]]", free))
    with pytest.raises(InputError, match="gear 2 of three speeds: the freewheel G would block R1"):
        solve_gear(box, "2")


def test_a_shift_between_clutches_behind_the_locked_converter_is_the_dual_clutch(
    tmp_path: Path,
) -> None:
    reduction = reduce(card(tmp_path), "2", "3")
    assert set(reduction.common) == {"C2", "LC"}
    assert compare(reduction, keep_coupling=True).error.shaft_torque < 1e-3


def test_a_shift_from_a_freewheel_is_reduced_and_not_simulated(tmp_path: Path) -> None:
    box = card(tmp_path, ('elements = ["C2", "B", "LC"]', 'elements = ["C1", "C2", "LC"]'))
    first = reduce(box, "1", "2")
    assert first.off_going.element == "F"
    with pytest.raises(ReductionError, match="F of three speeds is a freewheel"):
        compare(first)


def test_an_open_converter_has_no_reference_shift(tmp_path: Path) -> None:
    reduction = reduce(card(tmp_path, ('"B", "LC"]', '"B"]'), ('"C1", "LC"]', '"C1"]')), "2", "3")
    with pytest.raises(ReductionError, match="converter of three speeds is open in gear 2"):
        compare(reduction)


def test_the_network_launches_through_converter_and_freewheel(tmp_path: Path) -> None:
    """Second gear takes over from the freewheel, which overruns without a pressure of its own."""
    box = card(tmp_path)
    elements = [
        *build_network_elements(box),
        build_element("inertia", "crank", node="engine", inertia=0.2),
        build_element("torque", "T", node="engine", input="T"),
        build_element("inertia", "vehicle", node="output", inertia=10.0),
    ]
    end = np.array([0.0, 3.0])

    def line(*values: float) -> Signal:
        return Signal(np.linspace(0.0, 3.0, len(values)), np.array(values))

    inputs = {
        "T": line(150.0, 150.0),
        "C1": line(8e5, 8e5, 0.0, 0.0, 0.0),
        "C2": line(0.0, 0.0, 8e5, 8e5, 8e5),
        "B": line(0.0, 0.0, 8e5, 8e5, 8e5),
        "LC": Signal(end, np.zeros(2)),
    }
    grid = np.linspace(0.0, 3.0, 301)
    start = Start({"engine": 100.0, "input": 0.0, "S1": 0.0, "R1": 0.0, "output": 0.0})
    outputs: list[Any] = [("speed", "output"), ("slip", "F"), ("speed", "input"), ("speed", "R1")]
    run = simulate(elements, inputs, start, grid, outputs, audit=True)
    assert run.status == "completed"
    assert run.columns["slip", "F"].max() < 1e-9
    assert run.columns["speed", "output"][-1] > 5.0
    assert run.columns["speed", "R1"][-1] > 1.0
    audit = run.audit
    assert audit is not None
    assert abs(audit.error) < 1e-8 * audit.source


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (
            'turbine = "input"',
            'turbine = "S1"',
            r"converter\.turbine.*the turbine must be the input",
        ),
        ('pump = "engine"', 'pump = "input"', r"converter\.pump.*a member of its own"),
        ('kind = "freewheel"', 'kind = "freewheel"\nsurfaces = 4', "has no surfaces"),
        ('input = "input"', 'input = ["engine", "motor"]', r"one input.*drivetwin\.Model"),
        ("[sets.P]", "[sets.converter]", "the name is that of the torque converter"),
    ],
)
def test_faults_of_the_card_are_told_by_key(tmp_path: Path, old: str, new: str, text: str) -> None:
    with pytest.raises(CardError, match=re.compile(text, re.DOTALL)):
        card(tmp_path, (old, new))


def test_a_power_split_is_refused_with_the_network_as_remedy(tmp_path: Path) -> None:
    box = card(tmp_path, ('elements = ["C1", "F", "LC"]', 'elements = ["C1", "LC"]'))
    with pytest.raises(
        NoFixedRatioError, match=r"2 free speeds remain[^>]*(\n.*)*drivetwin\.Model"
    ):
        solve_gear(box, "1")


def test_the_power_split_of_the_page_follows_willis() -> None:
    (text,) = re.findall(
        r"^```python\n(.*?)^```", PAGE.read_text("utf-8"), re.MULTILINE | re.DOTALL
    )
    names: dict[str, Any] = {}
    exec(text, names)
    run, car = names["run"], names["car"]
    motor, ring, engine = (run[car.node(name).speed] for name in ("motor", "split.ring", "engine"))
    assert run.status == "completed"
    assert motor + 2.6 * ring == pytest.approx(3.6 * engine, rel=1e-9)

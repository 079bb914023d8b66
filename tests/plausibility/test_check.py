# SPDX-License-Identifier: MIT
"""Slips of the pen on a vehicle card: each is reported with entry, value expected and reason."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import tomlkit

from drivetwin.errors import CardError
from drivetwin.findings import Finding
from drivetwin.logs.read import read_log
from drivetwin.plausibility.check import check_card, select_card_findings
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.card import load_card
from tests.plausibility.fixtures import CORRECT, Synthetic, make_log
from tests.support.repeats import mark_repeats

Change = Callable[[dict[str, Any]], None]


def scale_entry(table: dict[str, Any], key: str, factor: float) -> None:
    old = table[key]
    table[key] = (
        {name: factor * one for name, one in old.items()}
        if isinstance(old, dict)
        else [factor * one for one in old]
        if isinstance(old, list)
        else factor * old
    )


def scale_gain(element: str, factor: float) -> Change:
    return lambda card: scale_entry(card["elements"][element], "gain_m3", factor)


def scale_fill(element: str, factor: float) -> Change:
    return lambda card: scale_entry(card["elements"][element], "P0_bar", factor)


def scale_inertia(key: str, factor: float) -> Change:
    return lambda card: scale_entry(card["inertia"], key, factor)


def state_geometry(element: str, surfaces: int, radius: float = 0.15) -> Change:
    """State the gain of 10 surfaces of 0.15 m by another number or radius."""

    def change(card: dict[str, Any]) -> None:
        table = card["elements"][element]
        area = table.pop("gain_m3") / (10 * 0.9 * 0.15)
        table.update(surfaces=surfaces, derating=0.9, area_m2=area, radius_m=radius)

    return change


def set_ratio(index: int, ratio: float) -> Change:
    def change(card: dict[str, Any]) -> None:
        card["gears"][index]["ratio"] = ratio

    return change


def set_final_drive(factor: float) -> Change:
    return lambda card: scale_entry(card, "final_drive", factor)


def state_tolerance(value: float) -> Change:
    def change(card: dict[str, Any]) -> None:
        card["sensors"] = {"output_torque": {"gain_tolerance": value}}

    return change


@dataclass(frozen=True)
class Slip:
    """A wrong entry, its key, and the value that must lie in the range expected."""

    name: str
    change: Change
    key: str
    right: float | None


SLIPS = (
    Slip("gain x 10", scale_gain("B3", 10.0), "elements.B3.gain_m3", 2.7e-2),
    Slip("gain x 0.1", scale_gain("B3", 0.1), "elements.B3.gain_m3", 2.7e-2),
    Slip("gain x 10 of the other", scale_gain("B2", 10.0), "elements.B2.gain_m3", 3.78e-2),
    Slip("gain x 0.1 of the other", scale_gain("B2", 0.1), "elements.B2.gain_m3", None),
    Slip("cm for m", state_geometry("B3", 10, 15.0), "elements.B3.radius_m", 0.15),
    Slip("half of the plates", state_geometry("B3", 5), "elements.B3.surfaces", 10.0),
    Slip("twice the plates", state_geometry("B3", 20), "elements.B3.surfaces", 10.0),
    Slip("ratio of 5th gear", set_ratio(1, 0.74), "gears[1].ratio", 1.43),
    Slip("ratio of 1st gear", set_ratio(0, 3.51), "gears[0].ratio", 1.91),
    Slip("another axle", set_final_drive(0.9), "final_drive", 5.38),
    Slip("an axle far off", set_final_drive(1.6), "final_drive", 5.38),
    Slip("P0 in Pa", scale_fill("B3", 1e5), "elements.B3.P0_bar", 0.8),
    Slip("P0 in kPa", scale_fill("B2", 1e2), "elements.B2.P0_bar", 0.8),
    Slip("J' in g m²", scale_inertia("J_prime_kgm2", 1e3), "inertia.J_prime_kgm2", 17.5),
    Slip("J3 in g m²", scale_inertia("J_vehicle_kgm2", 1e3), "inertia.J_vehicle_kgm2", 6056),
    Slip("Jo' in g m²", scale_inertia("J_out_kgm2", 1e3), "inertia.J_out_kgm2", 0.9),
    Slip("J' / 5", scale_inertia("J_prime_kgm2", 0.2), "inertia.J_prime_kgm2", 17.5),
    Slip("J3 x 4", scale_inertia("J_vehicle_kgm2", 4.0), "inertia.J_vehicle_kgm2", None),
    Slip("0.5 % as 0.5", state_tolerance(0.5), "sensors.output_torque.gain_tolerance", 0.005),
)


DAILY = ("open_converter", "paper")


def mark_slips() -> list[object]:
    """Each slip by its name; half of those of gains and inertias run at night."""
    repeats = {one.name for one in (*SLIPS[1:4], *SLIPS[6:7], *SLIPS[14:15])}
    return [
        pytest.param(
            one, id=one.name, marks=[pytest.mark.exhaustive] if one.name in repeats else []
        )
        for one in SLIPS
    ]


@pytest.fixture(scope="module")
def paper(tmp_path_factory: pytest.TempPathFactory) -> Synthetic:
    return make_log("paper_steps", tmp_path_factory.mktemp("paper"))


def check_file(card: Path, log: Path) -> tuple[Finding, ...]:
    vehicle = load_card(card)
    read = read_log(log, vehicle, None, needed=(), sound=(), gearing=False)
    found = check_card(vehicle, read, detect_shifts(read, vehicle).shifts)
    return (*found, *select_card_findings(vehicle, read.findings))


@pytest.mark.parametrize("slip", mark_slips())
def test_slip_is_reported_with_its_entry_and_what_is_expected(
    slip: Slip, paper: Synthetic, tmp_path: Path
) -> None:
    document = tomlkit.parse(paper.card.read_text(encoding="utf-8")).unwrap()
    slip.change(document)
    card = tmp_path / "card.toml"
    card.write_text(tomlkit.dumps(document), encoding="utf-8")
    by_key = {one.place.key: one for one in check_file(card, paper.log)}
    assert slip.key in by_key
    assert len(by_key) == 1 or slip not in SLIPS[:8]
    finding = by_key[slip.key]
    assert finding.place.file in (str(card), None)
    assert "expected" in finding.text or "card has" in finding.text or "gives" in finding.text
    assert finding.remedy
    if slip.right is not None:
        numbers = {name: one.value for name, one in finding.numbers.items()}
        if "low" in numbers:
            assert numbers["low"] <= slip.right <= numbers["high"]
        else:
            expected = numbers.get("expected", numbers.get("ratio"))
            assert expected == pytest.approx(slip.right, rel=5e-3)


@pytest.mark.parametrize("scenario", mark_repeats(CORRECT, DAILY))
def test_nothing_is_reported_on_a_correct_card(scenario: str, tmp_path: Path) -> None:
    made = make_log(scenario, tmp_path)
    assert check_file(made.card, made.log) == ()


def test_card_of_another_vehicle_is_reported(paper: Synthetic, tmp_path: Path) -> None:
    document = tomlkit.parse(paper.card.read_text(encoding="utf-8")).unwrap()
    for index, ratio in enumerate((1.86, 1.41)):
        document["gears"][index]["ratio"] = ratio
    document["final_drive"] = 4.88
    card = tmp_path / "card.toml"
    card.write_text(tomlkit.dumps(document), encoding="utf-8")
    keys = {one.place.key for one in check_file(card, paper.log)}
    assert {"gears[0].ratio", "gears[1].ratio", "final_drive"} <= keys


def test_tolerance_of_one_percent_is_refused_with_its_share(
    paper: Synthetic, tmp_path: Path
) -> None:
    document = tomlkit.parse(paper.card.read_text(encoding="utf-8")).unwrap()
    state_tolerance(1.0)(document)
    card = tmp_path / "card.toml"
    card.write_text(tomlkit.dumps(document), encoding="utf-8")
    with pytest.raises(CardError, match=r"sensors\.output_torque\.gain_tolerance.*0\.01"):
        load_card(card)

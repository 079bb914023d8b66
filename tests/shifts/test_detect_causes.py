# SPDX-License-Identifier: MIT
"""Exchanged pressures and a card of another gearbox are named, with the remedy for that cause."""

from __future__ import annotations

from dataclasses import replace

import pytest

import drivetwin
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.errors import DrivetwinError
from drivetwin.findings import Code
from drivetwin.plausibility.check import check_card
from drivetwin.shifts.detect import refuse_without_shifts
from drivetwin.vehicle.spec import PriorValue
from tests.support.bench import read_run


def exchange(log: ShiftLog, first: str, second: str) -> ShiftLog:
    one, other = f"pressure.{first}", f"pressure.{second}"
    swapped = {one: replace(log[other], role=one), other: replace(log[one], role=other)}
    return replace(log, channels={**log.channels, **swapped})


@pytest.mark.parametrize(
    ("scenario", "pair"),
    [
        ("paper_steps", ("B2", "B3")),
        ("power_on_down", ("B3", "B2")),
        ("gearbox_chain", ("C4", "C3")),
    ],
)
def test_exchanged_pressures_get_their_remedy(scenario: str, pair: tuple[str, str]) -> None:
    log, card = read_run(run(load_scenario(scenario), seed=1))
    log = exchange(log, *pair)
    found = drivetwin.detect_shifts(log, card)
    with pytest.raises(DrivetwinError, match="are exchanged") as refusal:
        drivetwin.identify(log, card, found)
    assert "xchange the columns of pressure." in refusal.value.remedy
    codes = [one.code for one in check_card(card, log, found.shifts)]
    assert codes == [Code.PRESSURES_EXCHANGED]


def test_a_card_of_another_gearbox_gets_its_remedy() -> None:
    log, card = read_run(run(load_scenario("paper_steps"), seed=1))
    ratios = {"2": 2.35, "3": 1.62}
    gears = tuple(replace(one, ratio=PriorValue(ratios[one.name])) for one in card.gears)
    other = replace(card, gears=gears)
    with pytest.raises(DrivetwinError, match=r"1\.91 for .*, 1\.43 for") as refusal:
        refuse_without_shifts(log, other, drivetwin.detect_shifts(log, other))
    assert "another gearbox" in refusal.value.remedy
    assert Code.RATIO_UNKNOWN in {one.code for one in check_card(other, log)}


def test_pressures_in_another_unit_get_the_remedy_of_their_channel() -> None:
    log, card = read_run(run(load_scenario("paper_steps"), seed=1))
    role = "pressure.B3"
    small = replace(log[role], values=0.01 * log[role].values)
    log = replace(log, channels={**log.channels, role: small})
    with pytest.raises(DrivetwinError, match="pressures contradict the speeds") as refusal:
        refuse_without_shifts(log, card, drivetwin.detect_shifts(log, card))
    assert "unit and offset of pressure.B3" in refusal.value.remedy


def test_absolute_pressures_are_named() -> None:
    log, card = read_run(run(load_scenario("paper_steps"), seed=1))
    found = drivetwin.detect_shifts(log, card)
    assert check_card(card, log, found.shifts) == ()
    roles = ("pressure.B2", "pressure.B3")
    absolute = {role: replace(log[role], values=log[role].values + 1.013e5) for role in roles}
    log = replace(log, channels={**log.channels, **absolute})
    codes = [one.code for one in check_card(card, log, found.shifts)]
    assert codes == [Code.PRESSURES_ABSOLUTE]

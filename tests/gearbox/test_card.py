# SPDX-License-Identifier: MIT
"""Gearbox cards: built-in names, paths, and every fault reported by its key."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.errors import CardError, InputError, ReductionError
from drivetwin.gearbox import Gearbox, list_builtin_gearboxes, load_gearbox

SMALL = """
name = "small"
source = "test"
input = "input"
output = "output"

[sets.P]
sun = "input"
ring = "ring"
carrier = "output"
sun_teeth = 30
ring_teeth = 75

[elements.B]
kind = "brake"
members = ["ring"]

[elements.C]
kind = "clutch"
members = ["input", "ring"]

[[gears]]
name = "1"
elements = ["B"]
ratio = 3.5

[[gears]]
name = "2"
elements = ["C"]
ratio = 1.0
"""


def card(folder: Path, text: str) -> Gearbox:
    path = folder / "card.toml"
    path.write_text(text, encoding="utf-8")
    return load_gearbox(path)


def test_every_built_in_card_is_sound_and_names_its_source() -> None:
    assert len(list_builtin_gearboxes()) == 11
    for name in list_builtin_gearboxes():
        box = load_gearbox(name)
        assert box.source
        assert box.drive is not None


def test_a_card_is_read_from_a_path(tmp_path: Path) -> None:
    box = card(tmp_path, SMALL)
    assert box.sets[0].z == 2.5
    assert box.get_gear("1").published == 3.5
    assert box.get_gear("1").tolerance == pytest.approx(0.005)
    assert box.elements["B"].b == "ground"
    assert box.dogs == ()


def test_tooth_counts_give_signed_ratios(tmp_path: Path) -> None:
    pairs = """
[pairs.simple]
a = "output"
b = "x"
teeth = [20, 50]
[pairs.idler]
a = "output"
b = "y"
teeth = [20, 17, 50]
[pairs.stepped]
a = "output"
b = "z"
teeth = [[20, 40], [30, 45]]
"""
    box = card(tmp_path, SMALL + pairs)
    assert [pair.ratio for pair in box.pairs] == [-2.5, 2.5, 3.0]


@pytest.mark.parametrize(
    ("old", "new", "key", "text"),
    [
        ("sun_teeth = 30", "sun_teeth = 30\nz = 2.5", "sets.P", "either z or both"),
        ("sun_teeth = 30\n", "", "sets.P", "either z or both"),
        ('members = ["ring"]', 'members = ["ring", "output"]', "elements.B", "holds one member"),
        ('members = ["ring"]', 'members = ["rnig"]', "elements.B.members", "did you mean 'ring'"),
        ('elements = ["B"]', 'elements = ["b"]', "gears[0].elements", "did you mean 'B'"),
        ('name = "2"', 'name = "1"', "gears[1].name", "given twice"),
        ('output = "output"', 'output = "outptu"', "output", "did you mean 'output'"),
        ('kind = "brake"', 'kind = "brake"\nsurfaces = 8', "elements.B", "belong together"),
        ("ratio = 3.5", "ratio = 3.5\nrevers = true", "gears[0].revers", "unknown key"),
        ("[elements.C]", "[elements.P]", "elements.P", "already that of sets.P"),
        ("[[gears]]", "[inertia_kgm2]\nfoo = 1.0\n[[gears]]", "inertia_kgm2.foo", "this member"),
        ("[[gears]]", "[inertia_kgm2]\nground = 1.0\n[[gears]]", "inertia_kgm2.ground", "not turn"),
        ('output = "output"', 'output = "input"', "output", "the same member"),
        ('output = "output"', 'output = "ground"', "output", "the ground does not turn"),
        ('carrier = "output"', 'carrier = "input"', "sets.P", "three members"),
        (
            "[[gears]]",
            "[pairs.G]\na = 'ring'\nb = 'ring'\nratio = 2.0\n[[gears]]",
            "pairs.G",
            "same",
        ),
        ('elements = ["B"]', 'elements = ["B", "B"]', "gears[0].elements", "given twice"),
        ("ratio = 3.5", "ratio = 0.0", "gears[0]", "must not be 0"),
        (
            'kind = "brake"',
            'kind = "dog"\nsurfaces = 8\narea_m2 = 0.01\nradius_m = 0.1',
            "elements.B",
            "never slips",
        ),
    ],
)
def test_faults_are_told_by_key(tmp_path: Path, old: str, new: str, key: str, text: str) -> None:
    with pytest.raises(CardError) as caught:
        card(tmp_path, SMALL.replace(old, new, 1))
    assert key in str(caught.value)
    assert text in str(caught.value)


def test_an_unknown_name_lists_the_built_in_cards() -> None:
    with pytest.raises(CardError, match="did you mean 'zf-8hp70'"):
        load_gearbox("zf-8hp-70")


def test_what_a_card_leaves_out_is_asked_for_when_needed(tmp_path: Path) -> None:
    box = card(tmp_path, SMALL)
    with pytest.raises(CardError, match=r"no \[drive\]"):
        box.require_drive()
    with pytest.raises(ReductionError, match="B of small states no capacity"):
        box.get_capacity("B")
    with pytest.raises(InputError, match="no gear '3'"):
        box.get_gear("3")

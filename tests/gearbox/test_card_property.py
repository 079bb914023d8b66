# SPDX-License-Identifier: MIT
"""Damaged gearbox cards: every one is either read or refused by key, never with another error."""

from __future__ import annotations

import copy
import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import InputError
from drivetwin.gearbox import list_builtin_gearboxes, solve_gear
from drivetwin.gearbox.card import build_gearbox, find_gearbox_faults

CARDS = Path(str(files("drivetwin"))) / "gearbox" / "cards"
DOCUMENTS = [
    tomllib.loads((CARDS / f"{name}.toml").read_text(encoding="utf-8"))
    for name in list_builtin_gearboxes()
]
JUNK = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 100),
    st.floats(allow_nan=True, allow_infinity=True),
    st.sampled_from(["", "input", "ground", "R1", "nowhere"]),
    st.lists(st.sampled_from(["C1", "B", "x"]), max_size=3),
    st.dictionaries(st.sampled_from(["z", "a", "ratio"]), st.floats(-5, 5), max_size=2),
)


def places(node: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """All key paths of a document."""
    items: list[tuple[Any, Any]] = []
    if isinstance(node, dict):
        items = list(node.items())
    elif isinstance(node, list):
        items = list(enumerate(node))
    found = [(*path, key) for key, _ in items]
    return found + [deep for key, value in items for deep in places(value, (*path, key))]


@given(st.data())
def test_a_damaged_card_is_read_or_refused_by_key(data: st.DataObject) -> None:
    document = copy.deepcopy(data.draw(st.sampled_from(DOCUMENTS)))
    *path, last = data.draw(st.sampled_from(places(document)))
    holder = document
    for key in path:
        holder = holder[key]
    if data.draw(st.booleans()):
        holder[last] = data.draw(JUNK)
    else:
        del holder[last]
    faults = find_gearbox_faults(document)
    if faults:
        assert all(fault.text for fault in faults)
        return
    box = build_gearbox(document)
    for gear in box.gears:
        try:
            solved = solve_gear(box, gear.name)
        except InputError:
            continue
        assert solved.power_error < 1e-6 * max(1.0, abs(solved.ratio))

# SPDX-License-Identifier: MIT
"""Tables with a time column of its own name beside each channel."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import DrivetwinError, MissingChannelError
from tests.logs.formats.text_logs import read_csv

NAMES = ("EngTrq", "SpdIn", "p1")
UNITS = ("Nm", "rpm", "bar")


def render(clock: str, value: str, sep: str, decimal: str, swapped: bool = False) -> bytes:
    """20 rows of three pairs; `clock` and `value` are the heads with {} for the name."""
    lines = []
    for step in range(-1, 20):
        cells = []
        for place, (name, unit) in enumerate(zip(NAMES, UNITS, strict=True)):
            pair = [clock.format(name), value.format(name, unit)]
            if step >= 0:
                numbers = (0.01 * step + 0.001 * place, step + place + 0.25)
                pair = [f"{number:.4f}".replace(".", decimal) for number in numbers]
            cells += pair[::-1] if swapped else pair
        lines.append(sep.join(cells))
    return "\n".join(lines).encode()


@pytest.mark.parametrize(("sep", "decimal", "swapped"), [
    (",", ".", False), (";", ",", False), ("\t", ".", True),
])  # fmt: skip
@pytest.mark.parametrize(("clock", "value"), [
    ("Time_{} [s]", "{} [{}]"), ("{}_time [s]", "{} [{}]"), ("Time {} (s)", "{} ({})"),
    ("{} [s]", "{} [{}]"), ("{} Time [s]", "{} ValueY [{}]"), ("Zeit_{} [s]", "{} [{}]"),
    ("{} Zeit [s]", "{} Wert [{}]"), ("t_{} [s]", "{} [{}]"), ("{}_t [s]", "{} [{}]"),
    ("{}.t [s]", "{} [{}]"), ("Time{} [s]", "{} [{}]"), ("{}_timestamps [s]", "{} [{}]"),
    ("t({}) [s]", "{} [{}]"), ("TIME_{} [s]", "{} [{}]"), ("Zeitstempel {} [s]", "{} [{}]"),
])  # fmt: skip
def test_each_channel_has_its_own_stamps(
    clock: str, value: str, sep: str, decimal: str, swapped: bool
) -> None:
    log = read_csv(render(clock, value, sep, decimal, swapped))
    assert [one.unit for one in log.channels] == list(UNITS)
    for place, one in enumerate(log.channels):
        assert one.name.startswith(NAMES[place])
        assert one.time == pytest.approx(np.arange(20) * 0.01 + 0.001 * place, abs=1e-9)
        assert one.values.tolist() == [step + place + 0.25 for step in range(20)]
    assert any("each for the column of its name" in text for text in log.warnings)


def test_a_channel_without_a_partner_makes_no_table_of_pairs() -> None:
    data = render("Time_{} [s]", "{} [{}]", ",", ".").replace(b"Time_p1", b"pedal")
    with pytest.raises(MissingChannelError, match="no time column"):
        read_csv(data)


@given(
    names=st.lists(st.text("abcXYZ", min_size=2, max_size=6), min_size=2, max_size=6,
                   unique_by=str.casefold),
    data=st.data(),
)  # fmt: skip
def test_any_order_of_the_columns_gives_the_same_pairs(
    names: list[str], data: st.DataObject
) -> None:
    """Stamps and values of the column at place k count from k."""
    columns = [*(f"Time_{name} [s]" for name in names), *(f"{name} [Nm]" for name in names)]
    order = data.draw(st.permutations(columns))
    start = {column: k % len(names) for k, column in enumerate(columns)}
    rows = [",".join(f"{start[column] + step}.5" for column in order) for step in range(12)]
    log = read_csv("\n".join([",".join(order), *rows]).encode())
    assert sorted(one.name for one in log.channels) == sorted(names)
    for one in log.channels:
        assert one.values[0] == names.index(one.name) + 0.5
        assert one.time[0] == names.index(one.name) + 0.5


@given(st.integers(0, 900), st.binary(max_size=4))
def test_damaged_pairs_give_a_typed_error_at_worst(place: int, other: bytes) -> None:
    table = render("Time_{} [s]", "{} [{}]", ",", ".")
    with contextlib.suppress(DrivetwinError):
        read_csv(table[:place] + other + table[place + 3 :])

# SPDX-License-Identifier: MIT
"""What is written in any accepted layout reads back equal; damage gives a typed error at worst."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import DrivetwinError
from tests.logs.formats.text_logs import read_csv

NAMES = st.text("abcdefghijkXYZ_0123456789", min_size=2, max_size=8).filter(
    lambda name: name[0].isalpha()
)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False, width=32)
COMMENTS = st.text("abc ,;.\t%\"'", max_size=20)


@dataclass(frozen=True)
class Layout:
    delimiter: str
    decimal: str
    unit_row: bool
    quoted: bool
    bom: bool
    newline: str
    comments: tuple[str, ...]


LAYOUTS = st.builds(
    Layout,
    delimiter=st.sampled_from(",;\t"),
    decimal=st.sampled_from(".,"),
    unit_row=st.booleans(),
    quoted=st.booleans(),
    bom=st.booleans(),
    newline=st.sampled_from(["\n", "\r\n"]),
    comments=st.tuples(*[COMMENTS] * 2),
).filter(lambda layout: layout.quoted or layout.delimiter != layout.decimal)

Cells = dict[str, list[float | None]]


@st.composite
def tables(draw: st.DrawFn) -> Cells:
    """Columns `c_<name>` with cells that may be absent, at least one row."""
    names = draw(st.lists(NAMES, min_size=1, max_size=5, unique=True))
    height = draw(st.integers(1, 12))
    cell = st.one_of(st.none(), NUMBERS)
    return {f"c_{name}": [draw(cell) for _ in range(height)] for name in names}


def render(table: Cells, layout: Layout) -> bytes:
    height = len(next(iter(table.values())))
    rows = [["time", *table]]
    if layout.unit_row:
        rows.append(["s", *("Nm" for _ in table)])
    else:
        rows[0] = ["time [s]", *(f"{name} [Nm]" for name in table)]
    for row in range(height):
        cells = [row * 0.5, *(column[row] for column in table.values())]
        texts = ["" if cell is None else repr(float(cell)) for cell in cells]
        rows.append([text.replace(".", layout.decimal) for text in texts])
    if layout.quoted:
        rows = [[f'"{cell}"' for cell in row] for row in rows]
    lines = [f"# {comment}" for comment in layout.comments]
    lines += [layout.delimiter.join(row) for row in rows]
    text = layout.newline.join(lines) + layout.newline
    return text.encode("utf-8-sig" if layout.bom else "utf-8")


@given(table=tables(), layout=LAYOUTS)
def test_round_trip(table: Cells, layout: Layout) -> None:
    log = read_csv(render(table, layout))
    assert [channel.name for channel in log.channels] == list(table)
    for channel, column in zip(log.channels, table.values(), strict=True):
        samples = [(0.5 * row, cell) for row, cell in enumerate(column) if cell is not None]
        assert channel.unit == "Nm"
        assert channel.time.tolist() == [stamp for stamp, _ in samples]
        assert channel.values.tolist() == [value for _, value in samples]
    assert log.warnings == ()


@given(
    table=tables(),
    layout=LAYOUTS,
    place=st.floats(0, 1),
    removed=st.integers(0, 5),
    inserted=st.binary(max_size=5),
)
def test_damaged_bytes_give_channels_or_a_typed_error(
    table: Cells, layout: Layout, place: float, removed: int, inserted: bytes
) -> None:
    data = render(table, layout)
    start = int(place * len(data))
    damaged = data[:start] + inserted + data[start + removed :]
    try:
        channels = read_csv(damaged).channels
    except DrivetwinError as error:
        channels = ()
        refusal = error.remedy
    else:
        refusal = "none"
    assert refusal
    for channel in channels:
        assert channel.time.shape == channel.values.shape
        assert channel.time.dtype == channel.values.dtype == np.float64

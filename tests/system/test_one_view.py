# SPDX-License-Identifier: MIT
"""A result has the same tables, cell by cell and word by word, on every medium."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from html.parser import HTMLParser
from typing import Any

import pytest
from dash import html
from dash.development.base_component import Component

from drivetwin.drive import load_powertrain, plan_launch, run
from drivetwin.fit.fit import predict
from drivetwin.fit.synthesize import ModelName
from drivetwin.gearbox import load_gearbox
from drivetwin.report.drive import build_drive_page, build_energy_table, build_shift_table
from drivetwin.report.fit import build_fit_blocks, build_fit_page
from drivetwin.report.html import (
    build_identification_blocks,
    build_report_page,
    render_fragment,
    render_page,
)
from drivetwin.report.text import format_blocks
from drivetwin.validation.simulate_log import attach_fit
from drivetwin.workbench.views.widgets import render_block
from tests.estimation.multi_log.fixtures import together
from tests.report.sample import identification, log, validation
from tests.support.fits import fit_log, make_log
from tests.workbench.views.texts import iterate_texts

Rows = list[list[str]]
Shown = tuple[Sequence[Any], str]
"""Blocks of a result, and its report."""


def identify() -> Shown:
    """One log."""
    found = attach_fit(identification(), [validation()])
    return build_identification_blocks(found), render_page(build_report_page(found, [log()]))


def identify_jointly() -> Shown:
    """Two logs, and a shift that is predicted."""
    made = together()
    return build_identification_blocks(made.found), render_page(
        build_report_page(made.found, made.fitted)
    )


def fit() -> Shown:
    """A network and a recording that is predicted."""
    found = fit_log(ModelName.ENGINE_START)
    held = {"other.csv": predict(found, [make_log(ModelName.ENGINE_START, 1).recording])[0]}
    return build_fit_blocks(found, ["k0.csv"], held), render_page(
        build_fit_page(found, ["k0.csv"], held)
    )


def drive() -> Shown:
    """A launch."""
    box, car = load_gearbox("simpson-3"), load_powertrain("car-350nm")
    motion = run(box, car, plan_launch(box, car.control))
    tables = [build_shift_table(motion), build_energy_table(motion)]
    return tables, render_page(build_drive_page(motion, "A drive"))


class Tables(HTMLParser):
    """Reader of the rows of all tables of a page; a cell is its texts, one below the other."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: Rows = []
        self._inside = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Begin a row, a cell or a text of it."""
        del attrs
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")
            self._inside = True
        elif tag == "small" and self._inside and self.rows[-1][-1]:
            self.rows[-1][-1] += "\n"

    def handle_endtag(self, tag: str) -> None:
        """End a cell."""
        self._inside &= tag not in ("td", "th")

    def handle_data(self, data: str) -> None:
        """Add a text to the cell."""
        if self._inside:
            self.rows[-1][-1] += data.strip("\n")


def read_page(page: str) -> Rows:
    """Return the rows of the tables of a page."""
    tables = Tables()
    tables.feed(page)
    return tables.rows


def read_view(parts: Sequence[Component]) -> Rows:
    """Return the rows of the tables of a view of the workbench."""
    rows = [one for part in parts for one in iterate_rows(part)]
    return [
        ["\n".join(filter(None, iterate_texts(cell))) for cell in getattr(row, "children", ())]
        for row in rows
    ]


def iterate_rows(part: object) -> Iterator[Component]:
    """Yield the rows in a component."""
    if isinstance(part, html.Tr):
        yield part
    elif isinstance(part, list | tuple):
        for one in part:
            yield from iterate_rows(one)
    elif isinstance(part, Component):
        yield from iterate_rows(getattr(part, "children", None))


def list_lines(row: Sequence[str]) -> Iterator[list[str]]:
    """Yield the words of the lines of a row as text shows them."""
    cells = [cell.split("\n") for cell in row]
    for place in range(max(map(len, cells))):
        yield [word for cell in cells for word in "".join(cell[place : place + 1]).split()]


SHOWN = (identify, identify_jointly, fit, drive)


@pytest.mark.parametrize("show", SHOWN, ids=lambda one: one.__name__)
def test_all_media_have_the_same_cells(show: Callable[[], Shown]) -> None:
    blocks, page = show()
    tables = [one for one in blocks if hasattr(one, "head")]
    rows = [["\n".join(cell.texts) for cell in row] for one in tables for row in one.rows]
    heads = [["\n".join(cell.texts) for cell in one.head] for one in tables]
    assert rows
    on_page = read_page(page)
    in_notebook = read_page(render_fragment(blocks))
    in_workbench = read_view([render_block(one, "block") for one in blocks])
    for row in (*heads, *rows):
        assert row in on_page
        assert row in in_notebook
        assert row in in_workbench
    in_terminal = [line.split() for line in format_blocks(blocks, width=1000).splitlines()]
    for row in rows:
        for line in list_lines(row):
            assert line in in_terminal

# SPDX-License-Identifier: MIT
"""A result has the same tables, cell by cell and word by word, on every medium."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from html.parser import HTMLParser
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from dash import html
from dash.development.base_component import Component

from drivetwin.drive import load_powertrain, plan_launch, run
from drivetwin.fit.fit import predict
from drivetwin.fit.synthesize import ModelName
from drivetwin.gearbox import load_gearbox, reduce
from drivetwin.logs.read import read_log
from drivetwin.logs.survey import Column
from drivetwin.report.blocks import Block, Section, TableBlock
from drivetwin.report.brief import build_identification_blocks
from drivetwin.report.bus_outcome import identify_vehicle
from drivetwin.report.comparison import build_agreement_section, render_comparison
from drivetwin.report.drive import build_energy_table, build_shift_table, render_drive
from drivetwin.report.find_reports import Candidate
from drivetwin.report.fit import build_fit_blocks, render_fit
from drivetwin.report.gearbox import build_reduction_blocks, evaluate_reduction
from drivetwin.report.html import render_fragment, render_joint_report, render_page, render_report
from drivetwin.report.sections.inputs import build_card_tables, build_column_table
from drivetwin.report.text import format_blocks
from drivetwin.twin.build import build_twin
from drivetwin.validation.simulate_log import attach_fit
from drivetwin.vehicle.ratio_card import load_ratio_card
from drivetwin.workbench.views.blocks import render_block
from tests.estimation.multi_log.fixtures import together
from tests.report.sample import card, identification, log, validation
from tests.support.bus_logs import BUS_LOGS, RATIOS, write_bus_logs
from tests.support.fits import fit_log, make_log
from tests.workbench.views.texts import iterate_texts

Rows = list[list[str]]
Shown = tuple[Sequence[Block], str]
"""Blocks of a result, and its report."""


def identify() -> Shown:
    """One log."""
    found = attach_fit(identification(), [validation()])
    return build_identification_blocks(found), render_report(found, log())


def identify_jointly() -> Shown:
    """Two logs, and a shift that is predicted."""
    made = together()
    return build_identification_blocks(made.found), render_joint_report(made.found, made.fitted)


def identify_bus() -> Shown:
    """Bus logs of one vehicle, one of them predicted."""
    with TemporaryDirectory() as name:
        folder = write_bus_logs(Path(name))
        logs = [read_log(folder / one, None) for one in BUS_LOGS]
        made = identify_vehicle(logs, load_ratio_card(folder / RATIOS), held={2})
    return made.build_blocks(), made.render()


def fit() -> Shown:
    """A network and a recording that is predicted."""
    found = fit_log(ModelName.ENGINE_START)
    held = {"other.csv": predict(found, [make_log(ModelName.ENGINE_START, 1).recording])[0]}
    return build_fit_blocks(found, ["k0.csv"], held), render_fit(found, ["k0.csv"], held)


def drive() -> Shown:
    """A launch."""
    box, car = load_gearbox("simpson-3"), load_powertrain("car-350nm")
    motion = run(box, car, plan_launch(box, car.control))
    tables = [build_shift_table(motion), build_energy_table(motion)]
    return tables, render_drive(motion, "A drive")


def compare() -> Shown:
    """Two identifications."""
    twin = build_twin(attach_fit(identification(), [validation()]), card())
    candidates = [Candidate.from_twin(name, twin) for name in ("first", "second")]
    return build_agreement_section(candidates).blocks, render_comparison(candidates, [])


def reduce_gearbox() -> Shown:
    """A shift of a gearbox."""
    blocks = build_reduction_blocks(
        evaluate_reduction(reduce(load_gearbox("three-set-3000"), "2", "3"))
    )
    return blocks, render_page("A gearbox", "", [Section("shift", "2-3", "", blocks)])


def inspect() -> Shown:
    """The columns of a log."""
    columns = [
        Column("n_engine", "CAN 1", "rpm", 100.0, (600.0, 2200.0), 3, ("engine_speed",)),
        Column("spare", "", None, None, None, 0, (), ignored=True),
    ]
    table = build_column_table(columns, "Columns")
    return [table], render_page("A log", "", [Section("columns", "Columns", "", [table])])


def show_card() -> Shown:
    """A vehicle card."""
    tables = build_card_tables(card())
    return tables, render_page("A card", "", [Section("card", "Card", "", tables)])


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


SHOWN = (
    identify,
    identify_jointly,
    identify_bus,
    fit,
    drive,
    compare,
    reduce_gearbox,
    inspect,
    show_card,
)


@pytest.mark.parametrize("show", SHOWN, ids=lambda one: one.__name__)
def test_all_media_have_the_same_cells(show: Callable[[], Shown]) -> None:
    blocks, page = show()
    tables = [one for one in blocks if isinstance(one, TableBlock)]
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

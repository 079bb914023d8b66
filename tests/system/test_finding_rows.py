# SPDX-License-Identifier: MIT
"""Table of a finding: as data in result files, as cells on screen and page."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.cli.output import print_blocks
from drivetwin.files.records import FindingRecord
from drivetwin.findings import Code, make_row, report
from drivetwin.report.blocks import TableBlock, build_findings_section

ROWS = (
    make_row(recording="2-3", channel="output torque", source="engine torque", size=7.4),
    make_row(recording="2-3", channel="output speed", source="pressure of B3", size=-5.6),
)
FOUND = replace(
    report(
        Code.RESIDUAL_CORRELATED, size=7.4, cause="likeliest cause: tyre slip", advice="Slow down"
    ),
    rows=ROWS,
)


def test_rows_survive_a_result_file() -> None:
    record = FindingRecord.from_result(FOUND)
    read = FindingRecord.model_validate_json(record.model_dump_json())
    assert read.to_finding() == FOUND
    assert read.to_finding().rows == ROWS
    assert read.rows[1].numbers["size"].value == -5.6


def test_terminal_and_report_show_the_table(capsys: pytest.CaptureFixture[str]) -> None:
    print_blocks(build_findings_section([FOUND]).blocks)
    printed = capsys.readouterr().out
    assert "pressure of B3" in printed
    assert max(map(len, printed.splitlines())) <= 80
    section = build_findings_section((FOUND,))
    (table,) = [one for one in section.blocks if isinstance(one, TableBlock)]
    assert "likeliest cause: tyre slip" in table.caption
    assert [cell.text for cell in table.rows[0]][1] == "output torque"

# SPDX-License-Identifier: MIT
"""End of the report: assumptions, range of validity, hashes."""

from __future__ import annotations

from drivetwin.report.blocks import NotesBlock, TableBlock
from drivetwin.report.sections.provenance import build_provenance_section
from tests.report.sample import identification


def _rows(blocks: object, caption: str) -> dict[str, str]:
    assert isinstance(blocks, list)
    table = next(b for b in blocks if isinstance(b, TableBlock) and b.caption.startswith(caption))
    return {row[0].text: row[-1].text for row in table.rows}


def test_settings_are_left_to_the_result_file() -> None:
    section = build_provenance_section(identification())
    assert "settings are in the result file" in section.intro
    captions = [block.caption for block in section.blocks if isinstance(block, TableBlock)]
    assert not any("Settings" in caption for caption in captions)


def test_inputs_and_range_of_validity_are_stated() -> None:
    blocks = build_provenance_section(identification()).blocks
    assert _rows(blocks, "Inputs") == {"sample <1>.csv": "ab" * 32}
    assert _rows(blocks, "Range")["pressure"] == "bar"


def test_friction_that_the_simulation_borrows_is_among_what_is_assumed() -> None:
    (assumed,) = (
        block for block in build_provenance_section(identification()).blocks
        if isinstance(block, NotesBlock)
    )  # fmt: skip
    assert (
        "friction of B2 is taken to be that of B3, ± 7 % beside the errors of both gains"
        in assumed.items
    )

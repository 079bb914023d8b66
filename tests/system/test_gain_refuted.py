# SPDX-License-Identifier: MIT
"""A wrong gain of an element that hardly slips: card and log are two witnesses against it."""

from __future__ import annotations

from pathlib import Path

import pytest

import drivetwin
from benchmarks.estimation.validity import identify_validated
from drivetwin.findings import Code
from tests.support.synth import synthesize


@pytest.mark.timeout(600)
def test_a_gain_out_of_proportion_that_the_log_contradicts_is_refuted(tmp_path: Path) -> None:
    """Six times the gain of B2 on the card, 8.4 times that of B3."""
    log, path, _ = synthesize(tmp_path / "log.csv", "paper_steps", 5)
    text, stated = path.read_text(), "gain_m3 = 0.0378"
    assert text.count(stated) == 1
    path.write_text(text.replace(stated, "gain_m3 = 0.2268"))
    card = drivetwin.load_card(path)
    found = identify_validated(drivetwin.read_log(log, card), card)
    assert found.status.value == "not valid"
    errors = {one.code: one for one in found.findings if one.severity.value == "error"}
    assert set(errors) == {Code.GAIN_REFUTED}
    assert errors[Code.GAIN_REFUTED].names["element"] == "B2"

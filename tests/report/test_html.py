# SPDX-License-Identifier: MIT
"""The report page: one file, offline, complete, safe against names with markup in them."""

from __future__ import annotations

import base64
import gzip
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.estimation.identification import Identification
from drivetwin.findings import render
from drivetwin.report.html import build_report_page, render_page, save_report
from tests.report.sample import build_section, list_blocks, log, simulated


@pytest.fixture(scope="module")
def found() -> Identification:
    return simulated()


@pytest.fixture(scope="module")
def page(found: Identification) -> str:
    return render_page(build_report_page(found, [log()]))


def test_opens_offline(page: str) -> None:
    markup = _without_scripts(page)
    assert not re.search(r"""(?:src|href)\s*=\s*["'](?!#)""", markup)
    assert "@import" not in markup
    assert "url(" not in markup


def test_plotly_stands_in_it_once(page: str) -> None:
    (packed,) = re.findall(r'id="plotly">([^<]*)</script>', page)
    library = gzip.decompress(base64.b64decode(packed)).decode()
    assert len(re.findall(r"\* plotly\.js v", library)) == 1
    assert "plotly.js v" not in page


def test_the_page_opens_with_the_verdict(page: str, found: Identification) -> None:
    markup = _without_scripts(page)
    verdict = markup.index(f"Model: {found.status}")
    assert verdict < markup.index("<table")
    assert verdict < markup.index('class="plot"')
    assert "10 of 12 parameters are identified, 1 weak, 1 not ident" in markup


def test_every_parameter_and_reason_is_shown(page: str, found: Identification) -> None:
    markup = _without_scripts(page)
    for estimate in found.estimates.values():
        assert estimate.id in markup
        assert estimate.reason in markup
    for text in (*render(found.findings), *found.assumptions, *found.inputs.values()):
        assert text in markup


def test_names_from_files_are_escaped(page: str) -> None:
    assert "sample <1>" not in page
    assert "sample &lt;1&gt;.csv" in page


def test_figures_are_json_with_units_on_their_axes(page: str) -> None:
    figures = [
        json.loads(text, parse_constant=pytest.fail)
        for text in re.findall(r'application/json">(.*?)</script>', page)
    ]
    assert len(figures) == 7
    titles = [
        axis["title"]["text"]
        for figure in figures
        for name, axis in figure["layout"].items()
        if name.startswith(("xaxis", "yaxis"))
    ]
    assert all("[" in title for title in titles if title)
    assert any("[rpm]" in title for title in titles)


def test_plotly_knows_every_entry_of_the_figures(found: Identification) -> None:
    """The Python library refuses a wrong entry that plotly.js ignores."""
    for section in ("result", "shift", "friction", "validation"):
        for block in list_blocks(found, section, "figure"):
            drawn = block.figure.to_plotly()
            assert len(drawn.data) == len(block.figure.data)
            assert drawn.layout.height == block.figure.layout.height


def test_equal_inputs_give_equal_text(page: str, found: Identification) -> None:
    assert render_page(build_report_page(found, [log()])) == page


def test_stays_small_for_long_logs(found: Identification, tmp_path: Path) -> None:
    long = log(np.arange(0.0, 200.0, 1e-3))
    save_report(tmp_path / "report.html", found, long)
    assert (tmp_path / "report.html").stat().st_size < 6_000_000


def test_sparse_identification_leaves_sections_out(found: Identification) -> None:
    sparse = replace(
        found, estimates={}, friction={}, fit={}, correlation=None, findings=(),
        evidence=replace(found.evidence, validation=()),
    )  # fmt: skip
    page = render_page(build_report_page(sparse, [log()]))
    assert page.startswith("<!DOCTYPE html>")
    assert 'id="friction"' not in page
    assert 'id="validation"' not in page


def test_several_shifts_are_shown_in_the_whole_log_first(found: Identification) -> None:
    twice = replace(found, shifts=found.shifts * 2)
    (whole, *_) = list_blocks(twice, "shift", "figure")
    assert len(whole.figure.layout.shapes) == 4
    labels = [button.label for button in whole.figure.layout.updatemenus[0].buttons]
    assert labels == ["whole", "2→3, 1.6 s"]
    once, both = (len(build_section(one, "shift").blocks) for one in (found, twice))
    assert once < both


def _without_scripts(page: str) -> str:
    return re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)

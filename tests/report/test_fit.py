# SPDX-License-Identifier: MIT
"""The page of a fit."""

from __future__ import annotations

import re

from drivetwin.findings import Code, report
from drivetwin.fit.fit import fit_network, predict
from drivetwin.fit.synthesize import ModelName
from drivetwin.fit.unknown import Unknown
from drivetwin.report.fit import render_fit
from tests.support.fits import fit_log, make_log, make_small


def render() -> str:
    found = fit_log(ModelName.ENGINE_START)
    held = predict(found, [make_log(ModelName.ENGINE_START, 1).recording])
    remarks = (report(Code.RECORDING, text="a remark of the reader"),)
    return render_fit(found, ["k0.csv"], {"other.csv": held[0]}, remarks)


def test_the_page_has_all_sections_once_and_is_the_same_each_time() -> None:
    page = render()
    anchors = re.findall(r'<section id="([^"]+)"', page)
    assert anchors == ["result", "findings", "recordings", "search"]
    assert page == render()


def test_the_page_names_unknowns_logs_and_findings() -> None:
    page = render()
    for name in fit_log(ModelName.ENGINE_START).values:
        assert name in page
    assert all(name in page for name in ("K0.gain", "K0.p0", "with the recordings"))
    assert "other.csv, held out" in page
    assert "a remark of the reader" in page
    assert "starts led to the best minimum" in page


def test_names_of_a_model_are_text_and_no_markup() -> None:
    model, recording = make_small({"<b>c</b>": Unknown(450.0, 100.0, paths=["left.stiffness"])})
    page = render_fit(fit_network(model, [recording]), ["<i>.csv"], {})
    assert "<b>c</b>" not in page
    assert "<i>.csv" not in page
    assert "&lt;b&gt;c&lt;/b&gt;" in page


def test_a_page_of_two_recordings_has_a_figure_for_each() -> None:
    model, recording = make_small({"left.stiffness": Unknown(450.0, 100.0)})
    page = render_fit(fit_network(model, [recording, recording]), ["a.csv", "b.csv"], {})
    assert page.count("a.csv.") >= 1
    assert page.count("b.csv.") >= 1

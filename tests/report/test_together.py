# SPDX-License-Identifier: MIT
"""The report of several logs with a prediction."""

from __future__ import annotations

import re
from dataclasses import replace

from drivetwin.report.html import build_report_page, render_page
from tests.estimation.multi_log.fixtures import loaded, together


def test_the_page_shows_logs_predictions_and_every_shift_once() -> None:
    made = together()
    page = render_page(build_report_page(made.found, made.fitted))
    anchors = re.findall(r'<section id="([^"]+)"', page)
    assert len(anchors) == len(set(anchors))
    assert [one for one in anchors[:4] if one != "findings"][:3] == ["result", "logs", "held-out"]
    assert {"shift-1", "shift-2", "validation-1", "validation-2"} <= set(anchors)
    assert "consistent with noise" in page
    assert "log 1 alone" in page
    assert page == render_page(build_report_page(made.found, made.fitted))


def test_a_log_that_could_not_be_simulated_does_not_show_the_runs_of_another() -> None:
    made = together()
    several = made.found.evidence.several
    assert several is not None
    second = several.logs[1].shifts
    runs = tuple(one for one in made.found.evidence.validation if one.shift in second)
    assert 0 < len(runs) < len(made.found.evidence.validation)
    evidence = replace(made.found.evidence, validation=runs)
    page = render_page(build_report_page(replace(made.found, evidence=evidence), made.fitted))
    anchors = re.findall(r'<section id="([^"]+)"', page)
    assert "validation-2" in anchors
    assert "validation-1" not in anchors


def test_a_disagreement_stands_on_the_first_page() -> None:
    made = loaded()
    page = render_page(build_report_page(made.found, made.fitted))
    first = page.partition('<section id="logs"')[0]
    assert "The logs do not agree on their shared parameters" in first
    assert "standard deviations from the others" in first

# SPDX-License-Identifier: MIT
"""The figures are those that their pages show; the ellipse is that of (6.19)."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from tools.theory_figures import FIGURES, FOLDER, build_ellipse


def test_the_page_shows_every_figure() -> None:
    page = (FOLDER.parent / "theory.md").read_text(encoding="utf-8")
    shown = re.findall(r"\(img/([\w-]+\.svg)\)", page)
    assert sorted(shown) == sorted(FIGURES)


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_is_a_drawing_without_requests(name: str) -> None:
    text = FIGURES[name]()
    root = ElementTree.fromstring(text)
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    assert len(root.findall("{*}polyline")) > 5
    assert re.findall(r"https?://[^\"]+", text) == ["http://www.w3.org/2000/svg"]


@pytest.mark.parametrize(("correlation", "power"), [(0.0, 4.0), (0.8, 9.0), (0.8, 1.0)])
def test_the_ellipse_is_as_wide_as_the_variance(correlation: float, power: float) -> None:
    points = build_ellipse(correlation, power)
    variance = 1.0 / (1.0 - correlation**2 * power / (1.0 + power))
    assert np.max(points[:, 0]) == pytest.approx(np.sqrt(variance), rel=1e-3)
    crossing = np.flatnonzero(np.diff(np.sign(points[:, 1])))
    assert np.abs(points[crossing, 0]) == pytest.approx(1.0, rel=0.05)

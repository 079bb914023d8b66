# SPDX-License-Identifier: MIT
"""Rule on figures of benchmarks: pages and pictures show what the raw results give."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePosixPath

from tools.results_page import PICTURES, fill_page, read_raw
from tools.tidy_rules.base import Fault, Tree

_REMEDY = "is not what the raw results give; write it anew: python -m tools.results_page"


def check_figures(tree: Tree) -> Iterator[Fault]:
    """Reject generated sections and pictures that the raw results do not give."""
    for page in tree.below("docs", ".md"):
        text = page.text or ""
        filled = fill_page(text, lambda name: read_raw(name, tree.root))
        if filled != text:
            changed = zip(text.splitlines(), filled.splitlines(), strict=False)
            same = next((n for n, (a, b) in enumerate(changed) if a != b), 0)
            yield Fault("figure", page.path, same + 1, _REMEDY)
    for name, (raw, draw) in PICTURES.items():
        path = PurePosixPath(name)
        drawn = next((one for one in tree.sources if one.path == path), None)
        if drawn is not None and drawn.text != draw(read_raw(raw, tree.root)):
            yield Fault("figure", path, 1, _REMEDY)

# SPDX-License-Identifier: MIT
"""Suggestions for misspelt words."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


def suggest_spelling(word: str, known: Iterable[str]) -> str:
    """Return `; did you mean 'x'?` for the nearest of the `known` words, else what is known."""
    words = list(known)
    by_folded = {each.casefold(): each for each in words}
    near = get_close_matches(word.casefold(), by_folded, n=1)
    if near:
        return f"; did you mean {by_folded[near[0]]!r}?"
    return f"; known here: {', '.join(words)}" if words else ""

# SPDX-License-Identifier: MIT
"""Names by which channels are recognised: `names.toml` as regular expressions."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from itertools import chain
from pathlib import Path

from pydantic import Field

from drivetwin._util.toml import StrictModel, read_toml
from drivetwin.errors import MappingError

_FILE = Path(__file__).with_name("names.toml")


class _Hint(StrictModel):
    name: str
    why: str


class _RoleNames(StrictModel):
    phrases: list[str] = Field(default_factory=list)
    names: list[str] = Field(default_factory=list)
    hints: list[_Hint] = Field(default_factory=list)


class _NamesFile(StrictModel):
    words: dict[str, list[str]]
    roles: dict[str, _RoleNames]


@dataclass(frozen=True)
class NameTable:
    """Words by kind, regular expression of the names of each role, and its hints.

    All are in the form of `normalise_name`. `hints` are reasons by name: names of quantities that
    are related to the role but not the same. `vocabulary` are all words and whole names.
    """

    words: Mapping[str, tuple[str, ...]]
    patterns: Mapping[str, str]
    hints: Mapping[str, Mapping[str, str]]
    vocabulary: frozenset[str]

    def make_alternatives(self, kind: str, least: int = 1) -> str:
        """Return the expression of the words of a kind that have at least `least` letters."""
        return "|".join(word for word in self.words[kind] if len(word) >= least)


def normalise_name(name: str) -> str:
    """Reduce a column name to letters and digits for comparison: `n_Ab [1/min]` -> `nab`."""
    text = unicodedata.normalize("NFC", name).casefold()
    text = re.sub(r"\\.*$|\[[^\]]*\]", "", text, flags=re.DOTALL)
    for umlaut, letters in (("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("ß", "ss"), ("ω", "w")):
        text = text.replace(umlaut, letters)
    return re.sub(r"[^a-z0-9]", "", text)


@cache
def load_name_table() -> NameTable:
    """Read the table of names."""
    file = _NamesFile.model_validate(read_toml(_FILE, MappingError))
    words = {kind: tuple(map(normalise_name, some)) for kind, some in file.words.items()}
    return NameTable(
        words=words,
        patterns={role: _make_pattern(one, words) for role, one in file.roles.items()},
        hints={
            role: {normalise_name(hint.name): hint.why for hint in one.hints}
            for role, one in file.roles.items()
        },
        vocabulary=frozenset(
            chain(
                *words.values(),
                (normalise_name(name) for one in file.roles.values() for name in one.names),
            )
        ),
    )


def _make_pattern(role: _RoleNames, words: Mapping[str, tuple[str, ...]]) -> str:
    """Return the expression that a name of a role matches as a whole."""
    phrases = ("".join(_make_word(word, words) for word in one.split()) for one in role.phrases)
    return "|".join((*phrases, *map(normalise_name, role.names)))


def _make_word(word: str, words: Mapping[str, tuple[str, ...]]) -> str:
    """Return the expression of a word in a phrase: `engine`, `engine?` or `engine*`."""
    kind, repeat = (word[:-1], word[-1]) if word[-1] in "?*" else (word, "")
    return f"({'|'.join(words[kind])}){repeat}"

# SPDX-License-Identifier: MIT
"""Count long sentences of the documents.

`python -m tools.sentences` prints, for each page, the share of sentences of more than 30 words;
with `--list` the sentences too.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MOST_WORDS = 30
"""Longest sentence that counts as short [words]: the limit of the prose rules of this project."""

_CODE = re.compile(r"^ *```.*?^ *```", re.MULTILINE | re.DOTALL)
_INDENTED = re.compile(r"(?:^|(?<=\n\n)) {4,}.*(?:\n {4,}.*)*", re.MULTILINE)
_NO_PROSE = re.compile(r"^\s*(?:\||#|!\[|<!--).*$", re.MULTILINE)
_ITEM = re.compile(r"^\s*(?:- |\d+\. )", re.MULTILINE)
_LINK = re.compile(r"\[([^\]]*)\]\([^)]*\)")
_END = re.compile(r"(?<=[.?!])[\"*)]*\s+(?=[A-Z0-9*(\"μη])")
_ABBREVIATION = re.compile(r"\b(?:e\.g|i\.e|[Ee]qs?|vs|al)\.$")
_WORD = re.compile(r"\w")


def list_pages() -> list[Path]:
    """List the documents, the front page first."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def split_sentences(text: str) -> Iterator[str]:
    """Yield the sentences of a Markdown text: tables, headings and code are none.

    An equation or a piece of code in a line counts as one word.
    """
    text = _CODE.sub("\n\n", text)
    text = _INDENTED.sub("\n\n", text)
    text = _ITEM.sub("\n\n", _NO_PROSE.sub("\n\n", text))
    text = _LINK.sub(r"\1", re.sub(r"\$[^$]+\$", "X", re.sub(r"`[^`]+`", "X", text)))
    for paragraph in re.split(r"\n\s*\n", text):
        start = ""
        for part in _END.split(" ".join(paragraph.split())):
            start = f"{start} {part}".strip()
            if not _ABBREVIATION.search(start):
                if count_words(start):
                    yield start
                start = ""
        if count_words(start):
            yield start


def count_words(sentence: str) -> int:
    """Count the words of a sentence; signs alone are none."""
    return sum(1 for word in sentence.split() if _WORD.search(word))


def find_long(text: str) -> tuple[list[str], int]:
    """Return the long sentences of a text and the number of all."""
    every = list(split_sentences(text))
    return [one for one in every if count_words(one) > MOST_WORDS], len(every)


def main(arguments: list[str]) -> int:
    """Print the share of long sentences of each page and of all."""
    long, total = 0, 0
    for page in list_pages():
        found, count = find_long(page.read_text(encoding="utf-8"))
        long, total = long + len(found), total + count
        if found:
            print(f"{len(found):3d} of {count:4d}  {page.relative_to(ROOT)}")
        if "--list" in arguments:
            print("".join(f"     {count_words(one)} {one}\n" for one in found), end="")
    print(f"{long:3d} of {total:4d}  {100 * long / total:.1f} % have more than {MOST_WORDS} words")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

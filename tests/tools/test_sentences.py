# SPDX-License-Identifier: MIT
"""Sentences of a page are counted without code, tables and headings."""

from __future__ import annotations

from tools.sentences import count_words, find_long, list_pages, split_sentences

PAGE = """\
# A heading of some words

The first sentence, by eq. 3, ends here. The second has `code of four words`, a [link](x.md)
and $a + b = c$.

- An item without an end
- Another. With two.

| a table | is none |
|---|---|

    indented code. It is none.

```python
x = 1  # Nor is this. At all.
```
"""


def test_sentences_are_those_of_the_prose() -> None:
    assert list(split_sentences(PAGE)) == [
        "The first sentence, by eq. 3, ends here.",
        "The second has X, a link and X.",
        "An item without an end",
        "Another.",
        "With two.",
    ]


def test_more_than_thirty_words_are_long() -> None:
    thirty = " ".join(["word"] * 29) + " - end."
    assert count_words(thirty) == 30
    assert find_long(thirty) == ([], 1)
    assert find_long(f"One {thirty}") == ([f"One {thirty}"], 1)


def test_the_documents_have_few_long_sentences() -> None:
    found = [find_long(page.read_text(encoding="utf-8")) for page in list_pages()]
    assert sum(len(long) for long, _ in found) < 0.02 * sum(count for _, count in found)

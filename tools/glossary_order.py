# SPDX-License-Identifier: MIT
"""Find terms of the glossary that a reader meets before their definition.

`python -m tools.glossary_order` walks README.md and the pages in the order of docs/README.md. A
term is defined where a page has it in emphasis (`*term*`) or as the text of a link to the glossary,
and by the glossary itself, so that the pages after it pass. It is used where its words stand in
prose: code, headings and links to other pages do not count. The first use before a definition is
printed; the exit code is then 1.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from tools.sentences import ROOT

DOCS = ROOT / "docs"
GLOSSARY = DOCS / "glossary.md"
EVERYDAY = {
    *("candidate", "capacity", "card", "draw", "effect", "element", "evidence", "finding", "gain"),
    *("gate", "locked", "network", "parameter", "shaft", "spread", "unit"),
}
"""Terms whose words have their everyday meaning too, which a program cannot tell apart."""

_HIDDEN = re.compile(r"^```[\s\S]*?^```|^ {4,}\S.*$|`[^`]+`|\$[^$]+\$|^#.*$|^!\[.*$", re.MULTILINE)
_LINK = re.compile(r"\[([^\]]*)\]\(([^)]*)\)")
_STRONG = re.compile(r"\*\*([^*]+)\*\*")


def list_terms(glossary: str) -> dict[str, re.Pattern[str]]:
    """List the terms that are checked, each with the pattern of its words."""
    heads = re.findall(r"^\*\*([^*]+?)\.\*\*", glossary, re.MULTILINE)
    names = {re.split(r"[,(]", head)[0].strip().lower() for head in heads}
    return {
        name: re.compile(rf"(?<![\w-]){re.escape(name)}(?:s|es)?(?![\w-])", re.IGNORECASE)
        for name in sorted(names)
        if name not in EVERYDAY and len(name) > 2
    }


def list_pages(index: str) -> list[Path]:
    """List the pages in the order of the list of all pages, the front page first."""
    links = re.findall(r"\]\(([\w./-]+\.md)\)", index.partition("## All pages")[2])
    return [ROOT / "README.md", *(DOCS / link for link in dict.fromkeys(links))]


def find_undefined(
    pages: Mapping[str, str], terms: Mapping[str, re.Pattern[str]]
) -> Iterator[tuple[str, str]]:
    """Yield each term that is used before it is defined, with the name of the page."""
    known: set[str] = set()
    for name, text in pages.items():
        if name == GLOSSARY.name:
            return
        prose, defined = split_page(text)
        for term, pattern in terms.items():
            if term in known:
                continue
            used = pattern.search(prose)
            place = min((at for at, words in defined if pattern.search(words)), default=None)
            if used and (place is None or used.start() < place):
                yield term, name
            if used or place is not None:
                known.add(term)


def split_page(text: str) -> tuple[str, list[tuple[int, str]]]:
    """Return the prose of a page, and the emphasised words and links to the glossary by place."""
    text = _STRONG.sub(r"\1", _HIDDEN.sub("", text))
    text = _LINK.sub(
        lambda link: f"*{link[1]}*" if Path(link[2]).name.startswith("glossary.md") else "", text
    )
    defined = [(found.start(), found[1]) for found in re.finditer(r"(?<!\*)\*([^*]+)\*", text)]
    return text, defined


def check_documents() -> list[tuple[str, str]]:
    """Check the documents of this repository."""
    index = (DOCS / "README.md").read_text(encoding="utf-8")
    pages = {page.relative_to(ROOT): page for page in list_pages(index)}
    texts = {
        GLOSSARY.name if page == GLOSSARY else str(name): page.read_text(encoding="utf-8")
        for name, page in pages.items()
    }
    return list(find_undefined(texts, list_terms(GLOSSARY.read_text(encoding="utf-8"))))


def main() -> int:
    """Print the terms that are used before their definition."""
    found = check_documents()
    for term, page in found:
        print(f"{page}: {term!r} is used before it is defined")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

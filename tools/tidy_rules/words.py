# SPDX-License-Identifier: MIT
"""Private words that the field's own terms have replaced, listed in `tools/private_words.tsv`.

A line of the list is a path pattern, a kind and the old words. Kinds `python` and `rust` mean a
definition of that name in a file that matches the pattern, `name` a Python identifier that contains
the word, `phrase` the text of any file. Phrases are separated by `;`, other words by blanks.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import PurePosixPath

from tools.tidy_rules.base import Fault, Source, Tree
from tools.tidy_rules.core import mask
from tools.tidy_rules.prose import EXEMPT_FILES

WORDS = "tools/private_words.tsv"
KINDS = ("file", "folder", "python", "rust", "name", "phrase")

_RUST_DEFINITION = re.compile(
    r"\b(?:struct|enum|union|trait|type|fn|mod|const|static)\s+(?:mut\s+)?(\w+)"
    r"|^[ \t]+([A-Z]\w*)[ \t]*(?:[({][^;=\n]*)?,?[ \t]*$",
    re.MULTILINE,
)
"""Items, and lines that hold a variant of an enumeration alone."""


@dataclass(frozen=True)
class Word:
    """One line of the list: where the name must not be defined, and as what."""

    pattern: str
    kind: str
    name: str


def read_words(text: str) -> tuple[Word, ...]:
    """Parse the list.

    Raises ValueError for an unknown kind or a line that has not three columns.
    """
    words = []
    for line in text.splitlines():
        if not line.strip() or line.startswith("#"):
            continue
        pattern, kind, names = line.split("\t")
        if kind not in KINDS:
            raise ValueError(f"{WORDS}: unknown kind {kind!r}")
        several = names.split(";") if kind == "phrase" else names.split()
        words += [Word(pattern, kind, name.strip()) for name in several]
    return tuple(words)


def _find_python(source: Source) -> Iterator[tuple[int, str]]:
    """Yield line and name of functions and classes at any depth, and of module constants."""
    module = ast.parse(source.data)
    for node in ast.walk(module):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.lineno, node.name
    for node in module.body:
        targets = node.targets if isinstance(node, ast.Assign) else []
        targets += [node.target] if isinstance(node, ast.AnnAssign) else []
        yield from ((node.lineno, each.id) for each in targets if isinstance(each, ast.Name))


def _find_rust(source: Source) -> Iterator[tuple[int, str]]:
    """Yield line and name of items and of variants of enumerations."""
    code = mask(source.text or "")
    for match in _RUST_DEFINITION.finditer(code):
        name = match.group(1) or match.group(2)
        yield code.count("\n", 0, match.start(1 if match.group(1) else 2)) + 1, name


def _find_identifiers(source: Source) -> Iterator[tuple[int, str]]:
    """Yield line and lower-case words of every identifier."""
    for token in tokenize.generate_tokens(io.StringIO(source.text or "").readline):
        if token.type == tokenize.NAME:
            words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", token.string).lower().split("_")
            yield from ((token.start[0], word) for word in words)


def _check_texts(source: Source, words: Sequence[Word]) -> Iterator[Fault]:
    """Reject words within identifiers, and phrases of the text with any line breaks."""
    names = {word.name for word in words if word.kind == "name"}
    if names and source.path.suffix == ".py":
        for line, name in _find_identifiers(source):
            if name in names:
                yield Fault("private-word", source.path, line, f"{name} is a private word")
    phrases = [re.escape(word.name) for word in words if word.kind == "phrase"]
    if phrases:
        text = source.text or ""
        spaced = "|".join(phrases).replace(r"\ ", r"\s+")
        for match in re.finditer(rf"\b(?:{spaced})\b", text, re.IGNORECASE):
            line = text.count("\n", 0, match.start()) + 1
            what = f"{' '.join(match.group().split())} is a private phrase: use the field's term"
            yield Fault("private-word", source.path, line, what)


def check_words(tree: Tree) -> Iterator[Fault]:
    """Reject files, folders, identifiers and phrases that contain a private word again."""
    listed = next((one.text for one in tree.sources if str(one.path) == WORDS), None)
    words = read_words(listed or "")
    seen = set()
    for source in tree.sources:
        path = str(source.path)
        near = [word for word in words if fnmatchcase(path, word.pattern)]
        if not near or path in EXEMPT_FILES:
            continue
        for word in near:
            folders = [*source.path.parents][:-1]
            if word.kind == "file" and source.path.stem == word.name:
                yield Fault("private-word", source.path, 1, f"{word.name} is a private word")
            for folder in folders if word.kind == "folder" else ():
                if folder.name == word.name and folder not in seen:
                    seen.add(folder)
                    yield Fault("private-word", folder, 1, f"{word.name} is a private word")
        yield from _check_definitions(source, {(word.kind, word.name) for word in near})
        yield from _check_texts(source, near)


def _check_definitions(source: Source, words: set[tuple[str, str]]) -> Iterator[Fault]:
    kind = {".py": "python", ".rs": "rust"}.get(source.path.suffix, "")
    names = {name for its_kind, name in words if its_kind == kind}
    if not names:
        return
    for line, name in _find_python(source) if kind == "python" else _find_rust(source):
        if name in names:
            text = f"{name} is a private word: use the field's term"
            yield Fault("private-word", PurePosixPath(source.path), line, text)

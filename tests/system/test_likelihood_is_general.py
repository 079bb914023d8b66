# SPDX-License-Identifier: MIT
"""The likelihood knows recordings of networks, not shifts."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import drivetwin.likelihood

WORDS = ("gear", "offgoing", "oncoming", "shift")


def list_identifiers(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        match node:
            case ast.Name(id=name) | ast.Attribute(attr=name) | ast.alias(name=name):
                yield name
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.arg(arg=name):
                yield name
            case ast.keyword(arg=str(name)):
                yield name


def test_no_identifier_of_the_likelihood_names_a_shift() -> None:
    (root,) = drivetwin.likelihood.__path__
    modules = sorted(Path(root).glob("*.py"))
    found = {
        f"{path.name}: {name}"
        for path in modules
        for name in list_identifiers(ast.parse(path.read_text(encoding="utf-8")))
        if any(word in name.lower() for word in WORDS)
    }
    assert len(modules) > 10
    assert not found

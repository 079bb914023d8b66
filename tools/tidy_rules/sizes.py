# SPDX-License-Identifier: MIT
"""How large files and functions may be."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from tools.tidy_rules import rust
from tools.tidy_rules.base import Fault, Source, Tree

MAX_FILE_LINES = 500
MAX_FUNCTION_LINES = 60
MAX_ARGUMENTS = 7
MAX_FILE_BYTES = 1_000_000


def file_lines(tree: Tree) -> Iterator[Fault]:
    """Source files are short; a Rust file's unit tests do not count."""
    for source in tree.below("", ".py", ".pyi", ".rs"):
        text = source.text or ""
        if source.path.suffix == ".rs":
            text = rust.without_tests(text)
        count = len(text.splitlines())
        if count > MAX_FILE_LINES:
            yield Fault("file-lines", source.path, 1, f"{count} lines, at most {MAX_FILE_LINES}")


def file_bytes(tree: Tree) -> Iterator[Fault]:
    """No large file enters the repository."""
    for source in tree.sources:
        if len(source.data) > MAX_FILE_BYTES:
            text = f"{len(source.data)} bytes, at most {MAX_FILE_BYTES}"
            yield Fault("file-bytes", source.path, 1, text)


def _function_faults(
    source: Source, name: str, line: int, length: int, arguments: int
) -> Iterator[Fault]:
    """Faults of one function; the arguments of a test are fixtures and columns of its table."""
    if length > MAX_FUNCTION_LINES:
        text = f"{name} has {length} lines, at most {MAX_FUNCTION_LINES}"
        yield Fault("function-lines", source.path, line, text, name)
    is_test = source.path.parts[0] == "tests" and name.startswith("test_")
    if arguments > MAX_ARGUMENTS and not is_test:
        text = f"{name} has {arguments} arguments, at most {MAX_ARGUMENTS}: make it a dataclass"
        yield Fault("arguments", source.path, line, text, name)


def _python_length(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines from `def` to the end, without the docstring."""
    length = (node.end_lineno or node.lineno) - node.lineno + 1
    first = node.body[0]
    if ast.get_docstring(node, clean=False) is not None:
        length -= (first.end_lineno or first.lineno) - first.lineno + 1
    return length


def _python_arguments(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Arguments without `self` and `cls`; `*args` and `**kwargs` count one each."""
    every = node.args
    names = [item.arg for item in (*every.posonlyargs, *every.args, *every.kwonlyargs)]
    bound = 1 if names[:1] in (["self"], ["cls"]) else 0
    return len(names) - bound + (every.vararg is not None) + (every.kwarg is not None)


def python_functions(tree: Tree) -> Iterator[Fault]:
    """Length and argument count of Python functions."""
    for source in tree.below("", ".py"):
        for node in ast.walk(ast.parse(source.data)):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                yield from _function_faults(
                    source, node.name, node.lineno, _python_length(node), _python_arguments(node)
                )


def rust_functions(tree: Tree) -> Iterator[Fault]:
    """Length and argument count of Rust functions."""
    for source in tree.below("", ".rs"):
        for found in rust.functions(source.text or ""):
            yield from _function_faults(
                source, found.name, found.line, found.length, found.arguments
            )

# SPDX-License-Identifier: MIT
"""Compare the size of the product and of its tests with `tools/budget.toml`.

`python -m tools.budget` prints each number beside its bar, `--lower` writes the bars that can fall.
A number above its bar is a fault of `make tidy`. A bar that rises needs a text in `[reasons]`.
"""

from __future__ import annotations

import argparse
import ast
import subprocess
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

from tools.constants import count_constants
from tools.internal_names import list_internal_names
from tools.tidy_rules.base import PACKAGE, Fault, Source, Tree, read_tree

ROOT = Path(__file__).resolve().parents[1]
FILE = "tools/budget.toml"
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
PLAIN = (0, 1, 2)
"""Literals in function bodies that are no constants; -1 is the sign and 1."""
LANGUAGES = {"toml": (".toml",), "javascript": (".js",), "c": (".c", ".h"), "rust": (".rs",)}
VENDORED = "export/fmu/headers"  # of the FMI standard
Numbers = dict[str, int]
"""Numbers by dotted key, as `statements.logs`."""


def count_statements(module: ast.Module) -> int:
    """Count the statements of a module without the docstrings of modules, classes and functions."""
    nodes = [*ast.walk(module)]
    documented = sum(
        isinstance(node, DOCUMENTED) and ast.get_docstring(node, clean=False) is not None
        for node in nodes
    )
    return sum(isinstance(node, ast.stmt) for node in nodes) - documented


def count_literals(module: ast.Module) -> int:
    """Count the numeric literals in function bodies other than -1, 0, 1 and 2."""
    inside = {
        id(node): node.value
        for function in ast.walk(module)
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef)
        for statement in function.body
        for node in ast.walk(statement)
        if isinstance(node, ast.Constant) and type(node.value) in (int, float)
    }
    return sum(value not in PLAIN for value in inside.values())


def measure(tree: Tree) -> Numbers:
    """Count all numbers of the tree that have a bar, by dotted key."""
    numbers: Numbers = {}
    texts = {str(one.path): one.text or "" for one in tree.below(PACKAGE, ".py", ".toml")}
    modules = {path: ast.parse(text) for path, text in texts.items() if path.endswith(".py")}
    for path, module in modules.items():
        inner = path.removeprefix(f"{PACKAGE}/")
        key = f"statements.{inner.split('/')[0] if '/' in inner else 'root'}"
        numbers[key] = numbers.get(key, 0) + count_statements(module)
    nodes = [node for module in modules.values() for node in ast.walk(module)]
    literals = sum(map(count_literals, modules.values()))
    names = list_internal_names(tree)
    numbers = dict(sorted(numbers.items())) | {
        "whole.modules": len(modules),
        "whole.classes": sum(isinstance(node, ast.ClassDef) for node in nodes),
        "whole.numeric_constants": sum(count_constants(texts).values()) + literals,
        "whole.test_lines": sum(len(one.lines) for one in tree.below("tests", ".py")),
        "whole.internal_pairs_in_tests": len(names),
        "whole.internal_names_in_tests": len({name for _, name in names}),
        "beside.ast_nodes": len(nodes),
    }
    for language, suffixes in LANGUAGES.items():
        files = [*_list_product(tree, suffixes)]
        numbers[f"beside.{language}_bytes"] = sum(len(one.data) for one in files)
    return numbers


def _list_product(tree: Tree, suffixes: tuple[str, ...]) -> Iterator[Source]:
    """Yield the files of the product, without tests of the core and vendored headers."""
    for source in (*tree.below(PACKAGE, *suffixes), *tree.below("crates", *suffixes)):
        if VENDORED not in str(source.path) and "tests" not in source.path.parts:
            yield source


def read_budget(text: str) -> tuple[Numbers, Mapping[str, str]]:
    """Read bars by dotted key, and the reasons of those that rose, from the text of the file."""
    tables = tomllib.loads(text)
    reasons = tables.pop("reasons", {})
    return {f"{t}.{key}": bar for t, table in tables.items() for key, bar in table.items()}, reasons


def compare(
    numbers: Numbers, bars: Numbers, before: Numbers, reasons: Mapping[str, str]
) -> list[str]:
    """Return a line for each number above its bar, and for each bar that rose without a reason."""
    over = [
        f"{key}: {number}, the budget is {bars.get(key, 0)}"
        for key, number in numbers.items()
        if number > bars.get(key, 0)
    ]
    return over + [
        f"{key}: raised from {before.get(key, 0)} to {bar} without a text in [reasons]"
        for key, bar in bars.items()
        if before and bar > before.get(key, 0) and key not in reasons
    ]


def check_budget(tree: Tree) -> Iterator[Fault]:
    """Reject a number above its bar, and a bar that was raised without a reason."""
    source = next((one for one in tree.sources if str(one.path) == FILE), None)
    if source is None:
        return
    bars, reasons = read_budget(source.text or "")
    for text in compare(measure(tree), bars, _read_before(tree.root, source.text or ""), reasons):
        yield Fault("budget", source.path, 1, text)


def _read_before(root: Path, text: str) -> Numbers:
    """Read the bars of the last commit whose file has another text; none if there is no such."""
    git = ["git", "-C", str(root)]
    log = subprocess.run([*git, "log", "-2", "--format=%H", "--", FILE], capture_output=True)
    for commit in log.stdout.decode().split():
        shown = subprocess.run([*git, "show", f"{commit}:{FILE}"], capture_output=True)
        if shown.returncode == 0 and shown.stdout.decode() != text:
            return read_budget(shown.stdout.decode())[0]
    return {}


def main() -> None:
    """Print all numbers with their bars; with `--lower` write the bars that can fall."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--lower", action="store_true", help="lower each bar to its number")
    lower = parser.parse_args().lower
    numbers, text = measure(read_tree(ROOT)), (ROOT / FILE).read_text(encoding="utf-8")
    bars = read_budget(text)[0]
    for key, number in numbers.items():
        print(f"{key:36} {number:>8} of {bars.get(key, 0):>8}")
        if lower and number < bars.get(key, 0):
            name = key.split(".")[1]
            text = text.replace(f"\n{name} = {bars[key]}\n", f"\n{name} = {number}\n")
    (ROOT / FILE).write_text(text, encoding="utf-8")
    print(f"{'statements':36} {sum(n for key, n in numbers.items() if 'statements' in key):>8}")


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: MIT
"""Who may know whom: the core stays pure, the pipelines run one way, units stay at the edge."""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Iterator

from tools.tidy_rules.base import Fault, Source, Tree
from tools.tidy_rules.rust import mask

CORE = "crates/drivetwin-core"
PACKAGE = "python/drivetwin"

_IMPURE = re.compile(
    r"\bpyo3\b|\bstd\s*::\s*(?:fs|io|net|process|env)\b|\b(?:e?print(?:ln)?|dbg)\s*!"
)
_MAY_NOT_USE = {
    "model": ("network", "solver", "simulate"),
    "network": ("solver", "simulate"),
    "solver": ("model", "simulate"),
}
"""Folders of the core and what they must not know; the integrator knows no elements either."""

PYTHON_LAYERS = (
    frozenset(
        {
            "errors",
            "atomic",
            "progress",
            "shown",
            "display",
            "parameters",
            "border",
            "driveline",
            "converter",
            "batch",
            "linear",
            "network",
            "tomlfile",
            "_native",
        }
    ),
    frozenset({"logs", "vehicle", "gearbox"}),
    frozenset({"shifts", "dyno", "drive"}),
    frozenset({"identify"}),
    frozenset(
        {
            "twin",
            "results",
            "start_state",
            "validate",
            "held_out",
            "together",
            "stepping",
            "stepped",
        }
    ),
    frozenset({"observer"}),
    frozenset({"report", "export"}),
    frozenset({"fleet", "app", "schemas"}),
    frozenset({"cli", "__main__"}),
)
"""From the bottom up: a module may import from its own layer and those below."""

_WITH_UNITS = frozenset(
    {"display", "logs", "vehicle", "gearbox", "report", "export", "fleet", "app", "cli", "__main__"}
)
"""What reads files and cards, and what shows or exports; everything else is SI."""
_CONVERSIONS = (1e5, 1e-5, 273.15, 60 / math.tau, math.tau / 60, 9.549, 0.10472)


def core_is_pure(tree: Tree) -> Iterator[Fault]:
    """No Python, no files, no printing in the core."""
    for source in tree.below(f"{CORE}/src", ".rs"):
        code = mask(source.text or "")
        for match in _IMPURE.finditer(code):
            line = code.count("\n", 0, match.start()) + 1
            yield Fault("core-is-pure", source.path, line, f"{match.group()} in the core")
    for source in tree.below(CORE, ".toml"):
        for number, text in enumerate(source.lines, start=1):
            if re.match(r"\s*(?:pyo3|numpy)\b", text):
                yield Fault("core-is-pure", source.path, number, "the core depends on Python")


def core_layers(tree: Tree) -> Iterator[Fault]:
    """The pipeline of the core runs one way, and its integrator never sees what the rows are."""
    for folder, forbidden in _MAY_NOT_USE.items():
        use = re.compile(rf"\bcrate\s*::\s*(?:\{{[^}}]*\b)?({'|'.join(forbidden)})\b")
        for source in tree.below(f"{CORE}/src/{folder}", ".rs"):
            code = mask(source.text or "")
            for match in use.finditer(code):
                line = code.count("\n", 0, match.start()) + 1
                text = f"{folder}/ may not use {match.group(1)}/"
                yield Fault("core-layers", source.path, line, text)


def _layer_of(module: str) -> int | None:
    """The layer of a dotted module name below the package, None if it has none."""
    first = module.split(".")[0]
    return next((rank for rank, names in enumerate(PYTHON_LAYERS) if first in names), None)


def _imported(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Line and name below the package of every import from it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module == "drivetwin":
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("drivetwin."):
            yield node.lineno, (node.module or "").removeprefix("drivetwin.")
        elif isinstance(node, ast.Import):
            yield from (
                (node.lineno, alias.name.removeprefix("drivetwin."))
                for alias in node.names
                if alias.name.startswith("drivetwin.")
            )


def _package_module(source: Source) -> str:
    """First name below the package of a source file, e.g. `logs` or `errors`."""
    return source.path.relative_to(PACKAGE).with_suffix("").parts[0]


def python_layers(tree: Tree) -> Iterator[Fault]:
    """The Python pipeline runs one way."""
    for source in tree.below(PACKAGE, ".py"):
        here = _package_module(source)
        rank = _layer_of(here)
        if rank is None and here != "__init__":
            yield Fault("layers", source.path, 1, f"{here} stands in no layer: add it to the rule")
        if rank is None:
            continue
        for line, module in _imported(ast.parse(source.data)):
            other = _layer_of(module)
            if other is not None and other > rank:
                yield Fault("layers", source.path, line, f"{here} may not import {module}")


def _is_conversion(value: object) -> bool:
    return isinstance(value, int | float) and any(
        math.isclose(value, known, rel_tol=1e-4) for known in _CONVERSIONS
    )


def _is_rpm_product(node: ast.AST) -> bool:
    """Whether an expression divides or multiplies 60 or 30 and pi, as rpm to rad/s does."""
    if not isinstance(node, ast.BinOp) or not isinstance(node.op, ast.Mult | ast.Div):
        return False
    inside = list(ast.walk(node))
    names = {item.attr for item in inside if isinstance(item, ast.Attribute)}
    names |= {item.id for item in inside if isinstance(item, ast.Name)}
    numbers = {item.value for item in inside if isinstance(item, ast.Constant)}
    return bool(names & {"pi", "tau"}) and bool(numbers & {30, 60})


def units_at_the_edge(tree: Tree) -> Iterator[Fault]:
    """Nothing between reading and showing converts a unit."""
    for source in tree.below(PACKAGE, ".py"):
        if _package_module(source) in _WITH_UNITS:
            continue
        for node in ast.walk(ast.parse(source.data)):
            number = isinstance(node, ast.Constant) and _is_conversion(node.value)
            if number or _is_rpm_product(node):
                line = getattr(node, "lineno", 1)
                text = f"{ast.unparse(node)} converts a unit; everything inside is SI"
                yield Fault("units-at-the-edge", source.path, line, text)

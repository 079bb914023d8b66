# SPDX-License-Identifier: MIT
"""Rule on units: everything between reading and showing is SI."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator

from tools.tidy_rules.base import PACKAGE, Fault, Tree

_WITH_UNITS = frozenset(
    {
        "_util",
        "channels",
        "logs",
        "vehicle",
        "gearbox",
        "report",
        "export",
        "fleet",
        "workbench",
        "modeling",
    }
    | {"cli", "__main__"}
)
"""Packages that read files and cards, or that show or export values."""
_CONVERSIONS = (1e5, 1e-5, 273.15, 60 / math.tau, math.tau / 60, 9.549, 0.10472)


def _is_conversion(value: object) -> bool:
    return isinstance(value, int | float) and any(
        math.isclose(value, known, rel_tol=1e-4) for known in _CONVERSIONS
    )


def _is_rpm_product(node: ast.AST) -> bool:
    """Return whether an expression divides or multiplies 60 or 30 and pi, as rpm to rad/s does."""
    if not isinstance(node, ast.BinOp) or not isinstance(node.op, ast.Mult | ast.Div):
        return False
    inside = list(ast.walk(node))
    names = {item.attr for item in inside if isinstance(item, ast.Attribute)}
    names |= {item.id for item in inside if isinstance(item, ast.Name)}
    numbers = {item.value for item in inside if isinstance(item, ast.Constant)}
    return bool(names & {"pi", "tau"}) and bool(numbers & {30, 60})


def check_units(tree: Tree) -> Iterator[Fault]:
    """Reject conversions of units between reading and showing."""
    for source in tree.below(PACKAGE, ".py"):
        if source.path.relative_to(PACKAGE).with_suffix("").parts[0] in _WITH_UNITS:
            continue
        for node in ast.walk(ast.parse(source.data)):
            number = isinstance(node, ast.Constant) and _is_conversion(node.value)
            if number or _is_rpm_product(node):
                line = getattr(node, "lineno", 1)
                text = f"{ast.unparse(node)} converts a unit; everything inside is SI"
                yield Fault("units-at-the-edge", source.path, line, text)

# SPDX-License-Identifier: MIT
"""Write the page of the Python names, docs/reference/python.md, from the docstrings.

`python -m tools.api` writes it; call it after a change of a public name, of its arguments or of the
first line of its docstring.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import drivetwin

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "reference" / "python.md"
SOURCES = ROOT / "python" / "drivetwin"

_HEAD = """\
# Python

Names for scripts, by module. Everything is in SI: rad, s, N·m, kg·m², Pa; times, speeds and torques
are NumPy arrays. `help(name)` tells the rest: units, signs, shapes, errors. What is not listed here
may change from version to version. Written by `python -m tools.api`.
"""

_Definition = ast.ClassDef | ast.FunctionDef

MODULES: dict[str, tuple[str, ...]] = {
    "logs.shiftlog": ("ShiftLog", "Channel", "Quantity"),
    "shifts.shift": (),
    "identify.result": ("Identification", "Estimate", "Verdict", "FrictionCurve"),
    "validate": ("Validation", "SignalTrace"),
    "results.result_file": ("load_result", "ResultFile"),
    "driveline": (
        "ShiftElement",
        "Stribeck",
        "FrictionTable",
        "RoadLoad",
        "State",
        "Signal",
        "Accuracy",
        "Trajectory",
        "sensitivities",
        "Sensitivities",
        "EnergyAudit",
    ),
    "batch": (),
    "linear": (),
    "network": (),
    "together": (),
    "held_out": (),
    "identify.profile": ("profile", "Profile"),
    "identify.bootstrap": ("bootstrap", "Bootstrap"),
    "observer.observe": (),
    "observer.observed": (),
    "gearbox": (),
    "drive": (),
    "dyno.dyno": (),
    "dyno.scenarios": (),
    "logs.write": (),
    "export.subject": (),
    "export.c.write": ("write_c",),
    "export.fmu.build": ("build_fmu", "BuildOptions"),
    "export.modelica.dual_clutch": ("write_modelica",),
    "export.parameters.of_twin": ("parameters_of",),
    "export.parameters.files": ("write_parameters", "read_parameters", "ParameterFormat"),
    "schemas": (),
    "errors": (),
}
"""Modules below the package with the names meant; with none, those of `__all__`, or all public."""


@dataclass(frozen=True)
class Module:
    """A module as text: its docstring, what it defines, and whence it imports what it names."""

    path: Path
    tree: ast.Module

    @property
    def definitions(self) -> dict[str, _Definition]:
        """Public classes and functions defined here."""
        found = (node for node in self.tree.body if isinstance(node, _Definition))
        return {node.name: node for node in found if not node.name.startswith("_")}

    @property
    def homes(self) -> dict[str, str]:
        """By name the module of the package that it is imported from."""
        return {
            alias.asname or alias.name: (node.module or "").removeprefix("drivetwin.")
            for node in ast.walk(self.tree)
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }

    @property
    def public(self) -> tuple[str, ...]:
        """The names of `__all__`, or all that are defined here."""
        for node in self.tree.body:
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
                return tuple(ast.literal_eval(node.value))
        return tuple(self.definitions)


def module(name: str) -> Module:
    """Read a module by its name below the package; a package stands in its `__init__.py`."""
    path = SOURCES.joinpath(*name.split("."))
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return Module(path, ast.parse(path.read_text(encoding="utf-8")))


def summary(node: _Definition | ast.Module) -> str:
    """First sentence of a docstring as text of a table."""
    lines = (ast.get_docstring(node) or "").split("\n\n")[0]
    text = re.split(r"(?<=[.])(?<![.]\w[.])\s+(?=[A-Z])", " ".join(lines.split()))[0]
    parts = re.split(r"(`[^`]*`)", text.replace("|", r"\|"))
    return "".join(
        re.sub(r"([*<])", r"\\\1", part) if i % 2 == 0 else part for i, part in enumerate(parts)
    )


def call(name: str, node: ast.FunctionDef) -> str:
    """A function with the names of its arguments and their defaults, `self` left out."""
    arguments = node.args
    for argument in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs):
        argument.annotation = None
    for variadic in (arguments.vararg, arguments.kwarg):
        if variadic is not None:
            variadic.annotation = None
    arguments.args = [each for each in arguments.args if each.arg not in ("self", "cls")]
    return f"{name}({ast.unparse(arguments)})"


def rows(name: str, node: _Definition) -> Iterator[str]:
    """The rows of a function, or of a class with its public methods."""
    if isinstance(node, ast.FunctionDef):
        yield f"| `{call(name, node)}` | {summary(node)} |"
        return
    yield f"| `{name}` | {summary(node)} |"
    for each in node.body:
        if isinstance(each, ast.FunctionDef) and not each.name.startswith("_"):
            kinds = {ast.unparse(one) for one in each.decorator_list}
            label = f"{name}.{each.name}"
            shown = label if kinds & {"property", "cached_property"} else call(label, each)
            yield f"| `{shown}` | {summary(each)} |"


def section(name: str, wanted: tuple[str, ...]) -> str:
    """The part of the page on one module."""
    source = module(name)
    table = ["| name | is |", "|---|---|"]
    for each in wanted or source.public:
        home = source if each in source.definitions else module(source.homes.get(each, name))
        if each in home.definitions:
            table += rows(each, home.definitions[each])
    return "\n".join([f"## `drivetwin.{name}`", "", summary(source.tree), "", *table, ""])


def first_names() -> str:
    """The part on the names of the package; some are called otherwise where they are defined."""
    table = ["| name | is |", "|---|---|"]
    for name in drivetwin.__all__:
        value = getattr(drivetwin, name)
        home = module(value.__module__.removeprefix("drivetwin."))
        table += rows(name, home.definitions[value.__name__])
    return "\n".join(["## `drivetwin`", "", *table, ""])


def page() -> str:
    """The whole page."""
    parts = (section(name, wanted) for name, wanted in MODULES.items())
    return "\n".join([_HEAD, first_names(), *parts])


def main() -> int:
    """Write the page."""
    PAGE.write_text(page(), encoding="utf-8", newline="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

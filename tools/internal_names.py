# SPDX-License-Identifier: MIT
"""List the internal names that tests use: those that the public pages do not promise."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from tools.tidy_rules.base import PACKAGE, Tree

PAGE = "docs/reference/python.md"
DIRECTIVE = re.compile(r"\.\. automodule:: (\S+)\n\s+:members:([^\n]*)")
ROOT_NAME = "drivetwin"


def list_internal_names(tree: Tree) -> set[tuple[str, str]]:
    """List pairs of test file and internal name.

    An attribute of an imported module, the argument of `import_module`, the text of a monkeypatch
    and a name that a helper of the tests hands on count as imports.
    """
    modules = {_name_module(str(one.path)): one.text or "" for one in tree.below(PACKAGE, ".py")}
    public = _list_public(tree, modules)
    sources = {str(one.path): ast.parse(one.text or "") for one in tree.below("tests", ".py")}
    direct = {path: _list_names(module, set(modules)) for path, module in sources.items()}
    found = set()
    for path, module in sources.items():
        names = set(direct[path].values()) | set(_list_texts(module, set(modules)))
        for name, (home, original) in _list_handed(module).items():
            names |= {direct.get(home, {}).get(original, "")} - {""} if name else set()
        found |= {(path, name) for name in names if name not in public}
    return found


def _name_module(path: str) -> str:
    """Return the dotted name of a module of the product by its path."""
    inner = path.removeprefix("python/").removesuffix(".py").removesuffix("/__init__")
    return inner.replace("/", ".")


def _list_public(tree: Tree, modules: dict[str, str]) -> set[str]:
    """List dotted names that the package or its reference page promises, and the package."""
    page = next((one.text or "" for one in tree.sources if str(one.path) == PAGE), "")
    public = {ROOT_NAME}
    for module, members in DIRECTIVE.findall(page):
        if module == ROOT_NAME:
            table = re.findall(r'^    "(\w+)": \("([\w.]+)", "(\w+)"\)', modules[module], re.M)
            public |= {f"{ROOT_NAME}.{name}" for name, _, _ in table}
            public |= {f"{ROOT_NAME}.{home}.{name}" for _, home, name in table}
        else:
            names = [one.strip() for one in members.split(",") if one.strip()]
            public |= {f"{module}.{one}" for one in names or _list_defined(modules[module])}
    return public


def _list_defined(text: str) -> Iterator[str]:
    """Yield the names that a module defines or lists in `__all__`."""
    for node in ast.parse(text).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            yield from ast.literal_eval(node.value)
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        yield from (one.id for one in targets if isinstance(one, ast.Name))


def _list_names(module: ast.Module, modules: set[str]) -> dict[str, str]:
    """Return full names of the product by the name or attribute by which a file uses them."""
    found: dict[str, str] = {}
    aliases: dict[str, str] = {}
    for node in ast.walk(module):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == ROOT_NAME:
            for one in node.names:
                full = f"{node.module}.{one.name}"
                (aliases if full in modules else found)[one.asname or one.name] = full
        if isinstance(node, ast.Import):
            for one in node.names:
                if one.name.split(".")[0] == ROOT_NAME:
                    aliases[one.asname or one.name] = one.name
    for node in ast.walk(module):
        if isinstance(node, ast.Attribute) and (base := _write_path(node.value)) in aliases:
            full = f"{aliases[base]}.{node.attr}"
            found[f"{base}.{node.attr}"] = full if full not in modules else ROOT_NAME
    return found


def _write_path(node: ast.expr) -> str:
    """Write a name with attributes, as `drivetwin.logs`; empty for another expression."""
    if isinstance(node, ast.Attribute):
        return f"{_write_path(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


def _list_texts(module: ast.Module, modules: set[str]) -> Iterator[str]:
    """Yield dotted names in texts that begin with a module of the product."""
    for node in ast.walk(module):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = node.value
            if text in modules - {ROOT_NAME} or text.rpartition(".")[0] in modules - {ROOT_NAME}:
                yield text


def _list_handed(module: ast.Module) -> dict[str, tuple[str, str]]:
    """Return path of the helper and original name by the name imported from the tests."""
    return {
        one.asname or one.name: (f"{(node.module or '').replace('.', '/')}.py", one.name)
        for node in ast.walk(module)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("tests.")
        for one in node.names
    }

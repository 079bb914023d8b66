# SPDX-License-Identifier: MIT
"""What holds arrays is one of its kind: `==` neither fails nor asks for equal floats."""

from __future__ import annotations

import dataclasses
import pkgutil
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.resources import files
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from drivetwin.simulation.dual_clutch import Signal


def own_dataclasses() -> dict[type, dict[str, Any]]:
    """Every dataclass of the package, with the names that its module knows."""
    found: dict[type, dict[str, Any]] = {}
    for one in pkgutil.walk_packages([str(files("drivetwin"))], "drivetwin."):
        if one.name.endswith("__main__"):
            continue
        names = vars(import_module(one.name))
        for each in names.values():
            if isinstance(each, type) and dataclasses.is_dataclass(each):
                found |= {each: names} if each.__module__ == one.name else {}
    return found


def named(hint: object) -> Iterator[type]:
    """The classes that a field of this type may hold; a function holds none of its arguments."""
    kind = get_origin(hint) or hint
    if kind is Callable:
        return
    if isinstance(kind, type):
        yield kind
    for argument in get_args(hint):
        yield from named(argument)


def held(classes: dict[type, dict[str, Any]]) -> dict[type, set[type]]:
    """By dataclass the classes that its fields may hold."""
    by_name: dict[str, type] = {}
    for names in classes.values():
        by_name |= {key: one for key, one in names.items() if isinstance(one, type)}
    by_name |= {each.__name__: each for each in classes}
    found = {}
    for each, names in classes.items():
        # Names that a module imports for the type checker alone are not there when it runs.
        hints = get_type_hints(each, localns={k: v for k, v in by_name.items() if k not in names})
        fields = (hints[field.name] for field in dataclasses.fields(each))
        found[each] = {kind for hint in fields for kind in named(hint)}
    return found


def with_arrays(holds: dict[type, set[type]]) -> set[type]:
    """The dataclasses that hold an array, by themselves or in what they hold."""
    found: set[type] = {np.ndarray}
    while more := {each for each, kinds in holds.items() if kinds & found} - found:
        found |= more
    return found - {np.ndarray}


def test_what_holds_arrays_is_compared_by_identity() -> None:
    found = with_arrays(held(own_dataclasses()))
    assert Signal in found
    by_value = [each for each in found if "__eq__" in vars(each)]
    assert sorted(f"{each.__module__}.{each.__name__}" for each in by_value) == []

# SPDX-License-Identifier: MIT
"""Arguments of public functions: texts become members of enums, wrong types are refused by name.

The annotations of a function state what is checked: enums, closed sets of texts (`Literal`), and
the classes of `SOURCES`. Python's own TypeError is left for a wrong number or name of arguments.
"""

from __future__ import annotations

import inspect
import typing
from collections.abc import Callable, Mapping
from enum import Enum
from functools import cache, wraps
from typing import Any, ParamSpec, TypeVar

from drivetwin.errors import InputError, suggest_spelling

P = ParamSpec("P")
R = TypeVar("R")

SOURCES: Mapping[str, str] = {
    "ShiftLog": "read it with drivetwin.read_log(path, card) or drivetwin.read_arrays(data, card)",
    "VehicleCard": "read it with drivetwin.load_card(path)",
    "FoundShifts": "pass the result of drivetwin.detect_shifts(log, card)",
    "Shift": "pass one of drivetwin.detect_shifts(log, card).shifts",
    "Identification": "pass the result of drivetwin.identify(log, card, shifts)",
    "Twin": "pass the result of drivetwin.build_twin or drivetwin.load_twin",
    "DualClutch": "build one with drivetwin.DualClutch, or with Twin.build_dual_clutch",
    "State": "build one with drivetwin.simulation.dual_clutch.State",
    "Signal": "build one with drivetwin.simulation.dual_clutch.Signal(time, values)",
    "Start": "build one with drivetwin.simulation.network.Start",
}
"""Ways to get an object, by the name of its class."""


def check_arguments(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate a public function with the check of its arguments."""
    signature = inspect.signature(function)

    @wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        bound = signature.bind(*args, **kwargs)
        for name, value in bound.arguments.items():
            parameter = signature.parameters[name]
            if parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
                options = _list_options(parameter.annotation)
                bound.arguments[name] = _check(name, value, options, function.__globals__)
        return function(*bound.args, **bound.kwargs)

    return checked


@cache
def _list_options(annotation: str) -> tuple[str, ...]:
    """List the alternatives of an annotation, `Twin | None` for example."""
    return tuple(part.strip() for part in annotation.split("|"))


def _check(name: str, value: Any, options: tuple[str, ...], names: Mapping[str, Any]) -> Any:
    """Return a value as one of the options has it; unchanged where none of them is checked.

    Raises InputError for a value that is none of them.
    """
    own = {base.__name__ for base in type(value).__mro__}
    if own & set(options) or (value is None and "None" in options):
        return value
    for option in options:
        known = names.get(option)
        if isinstance(known, type) and issubclass(known, Enum):
            return _coerce(name, value, known)
        if typing.get_origin(known) is typing.Literal:
            return _require_member(name, value, typing.get_args(known))
    wanted = [option for option in options if option != "None"]
    # A module may have an alias of its own of such a name; a type-only import has no object.
    if not all(option in SOURCES and _is_class(names.get(option)) for option in wanted):
        return value
    raise InputError(
        f"{name} is a {type(value).__name__}, not a {' or '.join(wanted)}",
        f"{name}: {SOURCES[wanted[0]]}",
    )


def _is_class(known: Any) -> bool:
    return known is None or isinstance(known, type)


def _coerce(name: str, value: Any, known: type[Enum]) -> Enum:
    """Return the member of an enum that a text names."""
    members = {str(one.value): one for one in known}
    text = value.casefold() if isinstance(value, str) else None
    found = next((one for key, one in members.items() if key.casefold() == text), None)
    if found is None:
        raise _refuse(name, value, tuple(members))
    return found


def _require_member(name: str, value: Any, accepted: tuple[Any, ...]) -> Any:
    if value not in accepted:
        raise _refuse(name, value, accepted)
    return value


def _refuse(name: str, value: Any, accepted: tuple[Any, ...]) -> InputError:
    hint = suggest_spelling(value, [str(one) for one in accepted]) if isinstance(value, str) else ""
    listed = ", ".join(repr(one) for one in accepted)
    return InputError(f"{name} is {value!r}{hint}", f"{name} is one of {listed}")

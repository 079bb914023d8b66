# SPDX-License-Identifier: MIT
"""Formulas over names: sums, products, quotients, powers, exp, log and sqrt."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Collection, Mapping
from typing import NamedTuple, cast

from drivetwin.errors import InputError, suggest_spelling
from drivetwin.simulation.variable import exp, log


def _power(base: float, order: float) -> float:
    """Compute a power; raises ValueError where it is complex."""
    if base < 0.0 and order != int(order):
        raise ValueError(f"{base:g} to the power {order:g}")
    return cast("float", base**order)


_OPERATORS: Mapping[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: _power,
}
_FUNCTIONS: Mapping[str, Callable[[float], float]] = {
    "exp": exp,
    "log": log,
    "sqrt": lambda number: _power(number, 0.5),
}
_REMEDY = "write numbers, names, + - * / **, exp, log and sqrt; other names in quotes"

_Evaluate = Callable[[Mapping[str, float]], float]


class Formula(NamedTuple):
    """Function of the numbers with the names `of`, in their order."""

    of: tuple[str, ...]
    compute: Callable[..., float]


def parse_formula(name: str, text: str, known: Collection[str]) -> Formula:
    """Parse the formula of an expression.

    Parameters
    ----------
    name
        Name of the expression, for messages.
    text
        Formula, such as `Je / eta` or `mu_c + 'drop of K0'`.
    known
        Names that it may contain.

    Raises
    ------
    InputError
        With the column of what is no formula, or of a name that is not known.
    """
    used: dict[str, None] = {}
    try:
        evaluate = _compile(ast.parse(text.strip(), mode="eval").body, known, used)
    except _FormulaError as error:
        raise InputError(f"{name}: {text!r}, {error}", _REMEDY) from None
    except (SyntaxError, ValueError, OverflowError, RecursionError, MemoryError) as error:
        what = f"{name}: {text!r} is no formula: {getattr(error, 'msg', error)}"
        raise InputError(what, _REMEDY) from None
    of = tuple(used)
    return Formula(of, lambda *values: evaluate(dict(zip(of, values, strict=True))))


class _FormulaError(Exception):
    """Part of a formula that is not allowed, with its column."""


def _compile(node: ast.expr, known: Collection[str], used: dict[str, None]) -> _Evaluate:
    """Return the function of a node of a formula; the names in it are added to those `used`."""
    match node:
        case ast.BinOp(left=left, op=sign, right=right) if type(sign) in _OPERATORS:
            first, second = (_compile(one, known, used) for one in (left, right))
            combine = _OPERATORS[type(sign)]
            return lambda values: combine(first(values), second(values))
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            inner = _compile(operand, known, used)
            return lambda values: -inner(values)
        case ast.Call(func=ast.Name(id=called), args=[operand], keywords=[]) if (
            called in _FUNCTIONS
        ):
            inner, function = _compile(operand, known, used), _FUNCTIONS[called]
            return lambda values: function(inner(values))
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            number = float(value)
            return lambda _: number
    name = _spell(node)
    if name is None or name not in known:
        what = "is not allowed" if name is None else f"{name!r}: no unknown"
        hint = "" if name is None else suggest_spelling(name, known)
        raise _FormulaError(f"column {node.col_offset + 1} {what}{hint}")
    used[name] = None
    return lambda values: values[name]


def _spell(node: ast.expr) -> str | None:
    """Return the name that a node spells; None for another node."""
    match node:
        case ast.Name(id=name) | ast.Constant(value=str() as name):
            return name
        case ast.Attribute(value=inner, attr=last):
            head = _spell(inner)
            return head and f"{head}.{last}"
    return None

# SPDX-License-Identifier: MIT
"""Formulas over names: sums, products, quotients, powers, exp, log and sqrt."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
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

    def note(node: ast.expr) -> float:
        spelled = _spell(node)
        if spelled not in known:
            hint = f"{spelled!r}: no unknown{suggest_spelling(spelled, known)}" if spelled else ""
            raise SyntaxError(f"column {node.col_offset + 1} {hint or 'is not allowed'}")
        used[spelled] = None
        return math.nan  # no arithmetic on it fails

    try:
        tree = ast.parse(text.strip(), mode="eval").body
        _evaluate(tree, note)
    except (SyntaxError, ValueError, ArithmeticError, RecursionError, MemoryError) as error:
        what = f"{name}: {text!r} is no formula: {getattr(error, 'msg', error)}"
        raise InputError(what, _REMEDY) from None

    return Formula(tuple(used), partial(_compute, tree, tuple(used)))


def _compute(tree: ast.expr, of: Sequence[str], *values: float) -> float:
    """Compute a formula of numbers with the names `of`."""
    by_name = dict(zip(of, values, strict=True))
    return _evaluate(tree, lambda node: by_name[_spell(node)])


def _evaluate(node: ast.expr, read: Callable[[ast.expr], float]) -> float:
    """Compute a formula; `read` returns the number of a node that is no operation."""
    match node:
        case ast.BinOp(left=left, op=sign, right=right) if type(sign) in _OPERATORS:
            return _OPERATORS[type(sign)](_evaluate(left, read), _evaluate(right, read))
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_evaluate(operand, read)
        case ast.Call(func=ast.Name(id=name), args=[operand], keywords=[]) if name in _FUNCTIONS:
            return _FUNCTIONS[name](_evaluate(operand, read))
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return float(value)
    return read(node)


def _spell(node: ast.expr) -> str:
    """Return the name that a node spells; empty for another node."""
    match node:
        case ast.Name(id=name) | ast.Constant(value=str() as name):
            return name
        case ast.Attribute(value=inner, attr=last):
            return f"{_spell(inner)}.{last}"
    return ""

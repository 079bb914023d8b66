# SPDX-License-Identifier: MIT
"""Functions of unknowns: formulas, their derivatives, derived values and priors on them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import InputError
from drivetwin.fit.expression import Expression
from drivetwin.fit.fit import fit_network
from drivetwin.fit.fixed_numbers import Tolerance
from drivetwin.fit.formula import parse_formula
from drivetwin.fit.result import ModelFit
from drivetwin.fit.unknown import Unknown
from drivetwin.likelihood.point import ParameterVector
from tests.support.fits import make_small

NAMES = ("x", "K0.friction.mu_c", "level of y")
SPELLED = ("x", "K0.friction.mu_c", "'level of y'")


def combine(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    pairs = st.tuples(inner, st.sampled_from(["+", "-", "*", "/", "**"]), inner)
    calls = st.tuples(st.sampled_from(["exp", "log", "sqrt", "-"]), inner)
    return pairs.map(lambda p: f"({p[0]} {p[1]} {p[2]})") | calls.map(lambda c: f"{c[0]}({c[1]})")


leaves = st.sampled_from(SPELLED) | st.floats(0.1, 9.0).map(lambda one: f"{one:.2f}")
formulas = st.recursive(
    st.sampled_from(SPELLED) | st.floats(0.1, 9.0).map(lambda one: f"{one:.2f}"),
    combine,
    max_leaves=6,
)
values = st.lists(st.floats(0.3, 3.0), min_size=3, max_size=3)


def compute_plainly(text: str, by_name: Mapping[str, float]) -> float:
    """Compute a formula by Python."""
    for k, spelled in enumerate(SPELLED):
        text = text.replace(spelled, f"_[{k}]") if spelled != "x" else text.replace("exp", "EXP")
    text = text.replace("x", "_[0]").replace("EXP", "exp")
    known = {"exp": math.exp, "log": math.log, "sqrt": math.sqrt}
    return float(eval(text, {**known, "_": [by_name[name] for name in NAMES]}))


@given(formulas, values)
def test_a_formula_has_the_value_and_the_derivative_of_its_text(
    text: str, numbers: list[float]
) -> None:
    try:
        plain = compute_plainly(text, dict(zip(NAMES, numbers, strict=True)))
    except (ArithmeticError, ValueError, TypeError):
        return
    found = parse_formula("it", text, NAMES)
    point = ParameterVector(NAMES, np.array(numbers))

    def compute(at: ParameterVector) -> float:
        try:
            return found.compute(*(at[name] for name in found.of))
        except (ArithmeticError, ValueError):
            return math.nan

    value = compute(point)
    assert value == pytest.approx(plain, rel=1e-12)
    variable = compute(point.to_variables())
    assert float(variable) == pytest.approx(plain, rel=1e-12, nan_ok=True)
    slopes = getattr(variable, "slopes", np.zeros(3))
    for k in range(3):
        step = 1e-5 * np.eye(3)[k]
        ends = [
            compute(point.replace_values(point.values + side * step)) for side in (1, -1, 2, -2)
        ]
        first, second = ends[0] - ends[1], ends[2] - ends[3]
        slope = (8.0 * first - second) / 12e-5
        if abs(4.0 * first - 2.0 * second) < 1e-6 * abs(first) and abs(value) < 1e4:  # smooth there
            assert slopes[k] == pytest.approx(slope, rel=1e-4, abs=1e-5 * max(abs(value), 1.0))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x +", "is no formula"),
        ("", "is no formula"),
        ("y * 2", "column 1 'y': no unknown"),
        (
            "x + K0.friction.mu_d",
            "column 5 'K0.friction.mu_d': no unknown; did you mean 'K0.friction.mu_c'",
        ),
        ("__import__('os').system('true')", "column 1 is not allowed"),
        ("x if x else x", "column 1 is not allowed"),
        ("exp(x, x)", "column 1 is not allowed"),
        ("sin(x)", "column 1 is not allowed"),
        ("x // 2", "column 1 is not allowed"),
        ("[x]", "column 1 is not allowed"),
        ("True * x", "column 1 is not allowed"),
        ("x + 1" + "0" * 400, "is no formula"),
        ("-" * 100000 + "x", "is no formula"),
        ("x\0", "is no formula"),
    ],
)
def test_what_is_no_formula_is_refused_with_its_place(text: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_formula("J1", text, NAMES)
    assert said in str(caught.value)
    assert "J1" in str(caught.value)


@given(st.text(max_size=20))
def test_any_text_is_a_formula_or_refused(text: str) -> None:
    try:
        found = parse_formula("it", text, NAMES)
    except InputError:
        return
    assert set(found.of) <= set(NAMES)


SOUGHT = {
    "scale": Unknown(420.0, 100.0, (0.0, None), unit="N*m/rad"),
    "ratio": Unknown(1.9, 0.5, (0.0, None)),
}
ELEMENTS = ("motor", "left wheel", "right wheel", "left", "right")
EXACT = {name: Tolerance(exact=True) for name in ELEMENTS}


def fit(unknowns: Mapping[str, Unknown], expressions: Mapping[str, Expression]) -> ModelFit:
    """Fit shafts of 400 and 800 N m/rad."""
    model, recording = make_small(unknowns)
    given = replace(model, tolerances=EXACT, expressions=expressions)
    return fit_network(given, [recording])


@pytest.mark.parametrize("product", ["scale * ratio", lambda scale, ratio: scale * ratio])
def test_functions_set_numbers_and_are_reported(product: str | Callable[..., float]) -> None:
    """A fit with both stiffnesses as unknowns is the reference."""
    direct = fit(
        {"left.stiffness": Unknown(420.0, 100.0), "right.stiffness": Unknown(798.0)},
        {"excess": Expression("'right.stiffness' - left.stiffness", paths=[], unit="N*m/rad")},
    )
    found = fit(
        SOUGHT,
        {
            "left.stiffness": Expression("scale"),
            "right.stiffness": Expression(product, ("scale", "ratio")),
        },
    )
    for name in ("left.stiffness", "right.stiffness"):
        assert found.values[name] == pytest.approx(direct.values[name], rel=1e-4)
        assert found.std[name] == pytest.approx(direct.std[name], rel=1e-2)
        estimate = found.estimates[name]
        assert estimate.spec is not None
        assert estimate.spec.unit == "N*m/rad"
        assert found.intervals[name] == pytest.approx(direct.intervals[name], rel=1e-3)
    units = {name: one.unit for name, one in found.estimates.items()}
    assert (units["scale"], units["ratio"]) == ("N*m/rad", "1")
    assert direct.estimates["excess"].unit == "N*m/rad"
    excess = direct.values["excess"]
    difference = direct.values["right.stiffness"] - direct.values["left.stiffness"]
    assert excess == pytest.approx(difference)
    low, high = direct.intervals["excess"]
    assert low < 400.0 < high
    right = next(one for one in found.fitted.elements if one["name"] == "right")
    assert right["stiffness"] == pytest.approx(800.0, rel=0.05)


def test_a_prior_on_a_function_is_a_row() -> None:
    """A sharp prior on the sum holds it; it may be curved in the coordinates."""
    pair = {"left.stiffness": Unknown(420.0), "right.stiffness": Unknown(700.0)}
    total = "left.stiffness + right.stiffness"
    free = fit(pair, {"sum": Expression(total, paths=[])})
    mean = free.values["sum"] + 2.0 * free.std["sum"]
    found = fit(pair, {"sum": Expression(total, paths=[], value=mean, std=free.std["sum"])})
    assert found.values["sum"] == pytest.approx(mean - free.std["sum"], abs=0.05 * free.std["sum"])
    assert found.std["sum"] == pytest.approx(free.std["sum"] / math.sqrt(2.0), rel=0.03)
    assert found.cost - free.cost == pytest.approx(2.0, abs=0.1)
    assert found.chi2 - free.chi2 == pytest.approx(1.0 / found.problem.size, rel=0.2)


@pytest.mark.parametrize(
    ("expressions", "said"),
    [
        ({"left.stiffness": Expression("scael")}, "'scael': no unknown; did you mean 'scale'"),
        ({"left.stiffnes": Expression("scale")}, "did you mean 'left.stiffness'"),
        ({"scale": Expression("ratio")}, "scale: an unknown and an expression"),
        ({"a": Expression("scale", paths=["left.damping"]), "left.damping": Expression("ratio")},
         "left.damping: set by 'a' and 'left.damping'"),
        ({"left.stiffness": Expression("log(ratio - 2)")}, "nan at the first guesses"),
        ({"left.stiffness": Expression("-scale")}, "-420 at the first guesses, not within 0"),
        ({"left.stiffness": Expression("scale", std=1.0)}, "a prior has value and std"),
        ({"left.stiffness": Expression("scale", value=0.0, std=1.0)}, "the value 0 is outside 0"),
        ({"left.stiffness": Expression("scale", value=1.0, std=0.0)}, "deviation 0 is no spread"),
        ({"left.stiffness": Expression(math.exp, ("ratio",))}, "the derivative by 'ratio' is 0"),
        ({"left.stiffness": Expression(lambda x: x, ("rato",))}, "did you mean 'ratio'"),
        ({"both": Expression("ratio", paths=[])}, "scale: no number of the model"),
    ],
)  # fmt: skip
def test_impossible_functions_are_refused(expressions: Mapping[str, Expression], said: str) -> None:
    with pytest.raises(InputError) as caught:
        fit(SOUGHT, {"both": Expression("scale * ratio", paths=[])} | dict(expressions))
    assert said in str(caught.value)

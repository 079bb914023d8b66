# SPDX-License-Identifier: MIT
"""Update a twin with the values of a parameter file, e.g. from a calibration tool."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetwin.errors import InputError
from drivetwin.estimation.result.estimate import Estimate, FrictionCurve, Verdict
from drivetwin.export.parameters.content import (
    Curve,
    ParameterSet,
    Scalar,
    choose_unit,
    is_same_unit,
    to_dotted_name,
    to_flat_name,
)
from drivetwin.export.parameters.of_twin import DESIGN_FIELDS, LAW_FIELDS, collect_parameters
from drivetwin.parameters import FINAL_DRIVE, get_parameter_spec, is_ratio, make_ratio_id
from drivetwin.twin.twin import SIMULATED, Twin

METHOD = "parameter file"
_DIVISORS = ("k_o", "i_in", "i_f", "i_c", "i_out")
"""Divisors in the initialisation of a run, besides the gear ratios; the core checks them later."""
_KINDS = {Scalar: "number", Curve: "curve"}


@dataclass(frozen=True, eq=False)
class Update:
    """The twin with the values of a file.

    `changed` names the entries that differ and were updated. `idle` names those that differ but
    affect no simulation, and were not updated. `unknown` names those that the twin does not have.
    """

    twin: Twin
    changed: tuple[str, ...]
    idle: tuple[str, ...]
    unknown: tuple[str, ...]


def update_twin(twin: Twin, parameters: ParameterSet) -> Update:
    """Give a twin the values of a file that differ from its own, under drivetwin's own names.

    What changes counts as a design value without interval. An unidentified parameter
    may be given. Raises InputError where both a friction curve and the numbers of its law changed,
    where a name is given twice, in another unit than the twin's or as a curve instead of a number,
    and for a ratio or a stiffness of zero.
    """
    own = collect_parameters(twin)
    values = {one.name: one for one in own.entries}
    known, unknown = _match_entries(parameters, _collect_spellings(twin, own))
    changed: dict[str, Scalar | Curve] = {}
    idle = []
    for name, entry in known.items():
        given = _convert_to_si(name, values.get(name), entry)
        if given is None:
            continue
        if name in twin.parameters and get_parameter_spec(name).stem not in SIMULATED:
            idle.append(name)
        else:
            changed[name] = given
    made = twin
    for name, entry in changed.items():
        made = (
            _set_curve(made, name, entry, changed)
            if isinstance(entry, Curve)
            else _set_number(made, name, entry.value)
        )
    if any(name in twin.covariance_ids for name in changed):
        made = replace(made, covariance_ids=(), covariance=None)
    return Update(made, tuple(changed), tuple(idle), tuple(unknown))


def _collect_spellings(twin: Twin, own: ParameterSet) -> dict[str, str]:
    """Own name by every way a format spells it, also of parameters without a value."""
    names = [one.name for one in own.entries]
    names += [name for name in twin.parameters if name not in names]
    return {spell(name): name for spell in (to_flat_name, to_dotted_name, str) for name in names}


def _match_entries(
    parameters: ParameterSet, spelled: dict[str, str]
) -> tuple[dict[str, Scalar | Curve], list[str]]:
    """The entries of a file by own name, and the names of the others."""
    known: dict[str, Scalar | Curve] = {}
    unknown = []
    for entry in parameters.entries:
        name = spelled.get(entry.name)
        if name is None:
            unknown.append(entry.name)
        elif name in known:
            raise InputError(f"the file gives {name} twice", "leave one of them")
        else:
            known[name] = entry
    return known, unknown


def _convert_to_si(
    name: str, own: Scalar | Curve | None, given: Scalar | Curve
) -> Scalar | Curve | None:
    """Return an entry in SI; None if its numbers are the own ones in the unit of the file.

    Raises InputError for a value of another kind or quantity, or a divisor of zero.
    """
    kind = Curve if isinstance(own, Curve) else Scalar
    if not isinstance(given, kind):
        raise InputError(
            f"the file gives {name} as a {_KINDS[type(given)]}, not as a {_KINDS[kind]}",
            "give it as it was exported",
        )
    size = _get_size(name, given.unit, get_parameter_spec(name).unit if own is None else own.unit)
    divides = name.partition(".")[0] in _DIVISORS or name.startswith("ratio_")
    if divides and isinstance(given, Scalar) and given.value == 0.0:
        raise InputError(f"{name} = 0 is impossible", "give it a value other than zero")
    if isinstance(given, Scalar):
        if isinstance(own, Scalar) and own.value * size == given.value:
            return None
        return replace(given, value=given.value / size)
    assert isinstance(own, Curve)
    along = _get_size(name, given.axis.unit, own.axis.unit)
    shown = tuple(along * x for x in own.axis.points), tuple(size * y for y in own.values)
    if shown == (given.axis.points, given.values):
        return None
    axis = replace(given.axis, points=tuple(point / along for point in given.axis.points))
    return replace(given, axis=axis, values=tuple(value / size for value in given.values))


def _get_size(name: str, stated: str, si: str) -> float:
    """Return the factor from SI to a unit of a file: bar and rpm are known beside SI."""
    unit, factor = choose_unit(si)
    if stated == unit:
        return factor
    if is_same_unit(stated, si):
        return 1.0
    raise InputError(
        f"the file gives {name} in {stated}, not in {si}",
        f"convert its numbers to {si} and state that",
    )


def _set_number(twin: Twin, name: str, value: float) -> Twin:
    """The twin with one number changed."""
    field, _, element = name.partition(".")
    if name == "i_in":
        return _set_input_gear(twin, value)
    if is_ratio(name):
        twin = _set_ratio(twin, name, value)
        if name not in twin.parameters:
            return twin
    if field == "load" and twin.load_law is not None:
        changes: dict[str, Any] = {element: value}
        return replace(twin, load_law=replace(twin.load_law, **changes))
    if field in LAW_FIELDS:
        return _set_law_field(twin, element, field, value)
    if field in DESIGN_FIELDS and name not in twin.parameters:
        changes = {field: value}
        design = replace(twin.elements[element], **changes)
        return replace(twin, elements={**twin.elements, element: design})
    estimate = Estimate(
        name, value, None, Verdict.DESIGN, METHOD, reason="given by a parameter file"
    )
    return replace(twin, parameters={**twin.parameters, name: estimate})


def _set_input_gear(twin: Twin, value: float) -> Twin:
    """The twin with another input gear; the ratios behind it stay."""
    scale = value / twin.i_in
    gears = {name: replace(one, ratio=scale * one.ratio) for name, one in twin.gears.items()}
    return replace(twin, i_in=value, gears=gears)


def _set_ratio(twin: Twin, name: str, value: float) -> Twin:
    """The twin with another ratio of a gear, given without the input gear, or final drive."""
    if name == FINAL_DRIVE:
        return replace(twin, final_drive=value)
    gear = name.removeprefix(make_ratio_id(""))
    changed = replace(twin.gears[gear], ratio=twin.i_in * value)
    return replace(twin, gears={**twin.gears, gear: changed})


def _set_law_field(twin: Twin, element: str, field: str, value: float) -> Twin:
    curve = twin.friction[element]
    assert curve.stribeck is not None  # Only a Stribeck law has parameters of this name.
    changes: dict[str, Any] = {field: value}
    law = replace(curve.stribeck, **changes)
    changed = replace(curve, stribeck=law, method=METHOD, stribeck_covariance=None)
    return replace(twin, friction={**twin.friction, element: changed})


def _set_curve(twin: Twin, name: str, given: Curve, changed: dict[str, Scalar | Curve]) -> Twin:
    element = name.removeprefix("mu.")
    both = [field for field in LAW_FIELDS if f"{field}.{element}" in changed]
    if both:
        raise InputError(
            f"both the friction curve of {element} and {', '.join(both)} of its law changed",
            "change one of them and leave the other as it was exported",
        )
    slip, mu = np.array(given.axis.points), np.array(given.values)
    nothing = np.zeros(0)
    over_eta = twin.friction[element].over_eta
    curve = FrictionCurve(slip, mu, mu, mu, nothing, nothing, None, METHOD, over_eta=over_eta)
    return replace(twin, friction={**twin.friction, element: curve})

# SPDX-License-Identifier: MIT
"""Faults of a `twin.toml` that lie between its tables, as an edit by hand leaves them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING

from drivetwin.errors import InputError
from drivetwin.parameters import spec_of
from drivetwin.tomlfile import Fault, did_you_mean
from drivetwin.vehicle.check import RATIO_TOLERANCE

if TYPE_CHECKING:
    from drivetwin.results.twin_file import TwinFile

_ABOVE_ZERO = ("eta", "k_o")
"""Stems of what models and their starts divide by."""


def twin_faults(content: TwinFile) -> list[Fault]:
    """Return all faults of a file whose tables have the right form each."""
    return [*_gears(content), *_parameters(content), *_friction(content)]


def _gears(content: TwinFile) -> Iterator[Fault]:
    """Gears are held by elements of the file, by whose ratios theirs is made."""
    transmission = content.transmission
    elements = transmission.elements
    held = Counter(gear.element for gear in transmission.gears.values())
    for name, gear in transmission.gears.items():
        key = f"transmission.gears.{name}"
        element = elements.get(gear.element)
        if element is None:
            text = f"no element {gear.element!r}{did_you_mean(gear.element, elements)}"
            yield Fault(f"{key}.element", text)
            continue
        product = transmission.i_in * element.i_c * element.i_out
        # An element that holds several gears has the ratios of one of them.
        if held[gear.element] == 1 and abs(product - gear.ratio) > RATIO_TOLERANCE * gear.ratio:
            text = f"{gear.ratio:.6g}, but i_in·i_c·i_out of {gear.element} is {product:.6g}"
            yield Fault(f"{key}.ratio", text)


def _parameters(content: TwinFile) -> Iterator[Fault]:
    """Ids and units are those of the parameter table."""
    for name, one in content.parameters.items():
        key = f"parameters.{name}"
        try:
            spec = spec_of(name)
        except InputError as error:
            yield Fault(key, error.what)
            continue
        if one.unit != spec.unit:
            yield Fault(f"{key}.unit", f"{one.unit!r}, but the value is read in {spec.unit!r}")
        if spec.stem in _ABOVE_ZERO and one.value is not None and one.value <= 0.0:
            yield Fault(f"{key}.value", f"{one.value:g} is impossible; it must be above zero")


def _friction(content: TwinFile) -> Iterator[Fault]:
    """Curves belong to elements of the file and run over slips that increase."""
    elements = content.transmission.elements
    for name, curve in content.friction.items():
        key = f"friction.{name}"
        if name not in elements:
            yield Fault(key, f"no element {name!r}{did_you_mean(name, elements)}")
        if any(a >= b for a, b in zip(curve.slip, curve.slip[1:], strict=False)):
            yield Fault(f"{key}.slip", "the slips do not increase")
        if curve.stribeck is not None and curve.stribeck.v_s <= 0.0:
            text = f"{curve.stribeck.v_s:g} is impossible; it must be above zero"
            yield Fault(f"{key}.stribeck.v_s", text)

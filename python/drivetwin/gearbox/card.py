# SPDX-License-Identifier: MIT
"""Gearbox cards: from a TOML file or a built-in name to a Gearbox in SI, with all faults."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from drivetwin._util.spelling import suggest_spelling
from drivetwin._util.toml import Fault, raise_faults, read_toml, validate_schema
from drivetwin.errors import CardError
from drivetwin.gearbox.schema import GearboxFile
from drivetwin.gearbox.spec import CONVERTER, GROUND, Gearbox


def find_gearbox_faults(document: Mapping[str, Any]) -> list[Fault]:
    """Return all faults of a card file: those of the schema, or else those between tables."""
    faults = validate_schema(document, GearboxFile)
    if faults:
        return faults
    file = GearboxFile.model_validate(document)
    return [*_check_names(file), *_check_ends(file), *_check_members(file), *_check_gears(file)]


def _check_names(file: GearboxFile) -> Iterator[Fault]:
    """Sets, pairs and elements share one name space: torques are reported by these names."""
    seen: dict[str, str] = {}
    tables = (("sets", file.sets), ("pairs", file.pairs), ("elements", file.elements))
    for table, names in tables:
        for name in names:
            if name in seen:
                yield Fault(f"{table}.{name}", f"the name is already that of {seen[name]}.{name}")
            elif name == CONVERTER and file.converter is not None:
                yield Fault(f"{table}.{name}", "the name is that of the torque converter")
            seen[name] = table


def _check_ends(file: GearboxFile) -> Iterator[Fault]:
    """Input and output are two shafts; shafts that one set or pair joins are different ones."""
    if file.input == file.output:
        yield Fault("output", "input and output are the same member")
    for key, member in (("input", file.input), ("output", file.output)):
        if member == GROUND:
            yield Fault(key, "the ground does not turn; name a shaft")
    yield from _check_converter(file)
    for name, each in file.sets.items():
        if len({each.sun, each.ring, each.carrier}) < 3:
            yield Fault(f"sets.{name}", "sun, ring and carrier must be three members, or it locks")
    for name, pair in file.pairs.items():
        if pair.a == pair.b:
            yield Fault(f"pairs.{name}", "both wheels are on the same member")


def _check_converter(file: GearboxFile) -> Iterator[Fault]:
    """The turbine is the input, the pump a member of its own."""
    if file.converter is None:
        return
    if file.converter.turbine != file.input:
        text = (
            f"the turbine must be the input, {file.input!r}, from which ratios are counted; build "
            "a gearbox with a converter elsewhere as a network with drivetwin.Model"
        )
        yield Fault("converter.turbine", text)
    if file.converter.pump in (file.input, file.output, GROUND):
        yield Fault("converter.pump", "the pump must be a member of its own, that of the engine")


def _check_members(file: GearboxFile) -> Iterator[Fault]:
    """Every member of an end, an element or an inertia must belong to a set or a gear pair."""
    geared = {m for each in file.sets.values() for m in (each.sun, each.ring, each.carrier)}
    geared |= {m for pair in file.pairs.values() for m in (pair.a, pair.b)}
    joined = {m for element in file.elements.values() for m in element.members}
    ends = {file.input, file.output, GROUND}
    ends |= set() if file.converter is None else {file.converter.pump}
    known = geared | joined | (ends - {file.input, file.output, GROUND})
    for key, member in (("input", file.input), ("output", file.output)):
        if member not in known:
            yield Fault(key, f"no set, pair or element has a member {member!r}"
                        f"{suggest_spelling(member, known)}")  # fmt: skip
    for member in file.inertia_kgm2:
        if member == GROUND:
            yield Fault(f"inertia_kgm2.{member}", "the ground does not turn; name a shaft")
        elif member not in known:
            text = f"no set, pair or element has this member{suggest_spelling(member, known)}"
            yield Fault(f"inertia_kgm2.{member}", text)
    for name, element in file.elements.items():
        if element.members[0] == element.members[-1] and len(element.members) == 2:
            yield Fault(f"elements.{name}.members", "both sides are the same member")
        for member in element.members:
            if member not in geared | ends and (
                sum(member in other.members for other in file.elements.values()) < 2
            ):
                text = f"{member!r} belongs to nothing else{suggest_spelling(member, geared)}"
                yield Fault(f"elements.{name}.members", text)


def _check_gears(file: GearboxFile) -> Iterator[Fault]:
    """Gears have different names and engage elements of the card, each once."""
    seen: set[str] = set()
    for index, gear in enumerate(file.gears):
        if gear.name in seen:
            yield Fault(f"gears[{index}].name", f"gear {gear.name!r} is given twice")
        seen.add(gear.name)
        if len(set(gear.elements)) < len(gear.elements):
            yield Fault(f"gears[{index}].elements", "an element is given twice")
        for name in gear.elements:
            if name not in file.elements:
                text = f"no [elements.{name}]{suggest_spelling(name, file.elements)}"
                yield Fault(f"gears[{index}].elements", text)


_CARDS = Path(__file__).parent / "cards"


def list_builtin_gearboxes() -> tuple[str, ...]:
    """Names of the built-in cards, in alphabetical order."""
    return tuple(sorted(path.stem for path in _CARDS.glob("*.toml")))


def load_gearbox(card: Path | str) -> Gearbox:
    """Read a gearbox card: a path, or the name of a built-in one.

    Raises CardError that lists all faults by key path, or the built-in names where the card is
    neither.
    """
    path = _find(card)
    document = read_toml(path, CardError)
    raise_faults(
        find_gearbox_faults(document),
        CardError,
        str(card),
        "correct these keys of the gearbox card; docs/reference/gearbox-card.md describes them",
    )
    return build_gearbox(document)


def _find(card: Path | str) -> Path:
    builtin = _CARDS / f"{card}.toml"
    if str(card) in list_builtin_gearboxes():
        return builtin
    path = Path(card)
    if path.suffix or path.exists():
        return path
    raise CardError(
        f"no built-in gearbox {str(card)!r}{suggest_spelling(str(card), list_builtin_gearboxes())}",
        f"give a path to a card, or one of {', '.join(list_builtin_gearboxes())}",
    )


def build_gearbox(document: Mapping[str, Any]) -> Gearbox:
    """Return the gearbox of a document that has no faults (see `find_gearbox_faults`)."""
    file = GearboxFile.model_validate(document)
    return Gearbox(
        name=file.name,
        input=file.input,
        output=file.output,
        sets=tuple(table.to_spec(name) for name, table in file.sets.items()),
        pairs=tuple(table.to_spec(name) for name, table in file.pairs.items()),
        elements={name: e.to_spec(name, file.friction) for name, e in file.elements.items()},
        gears=tuple(gear.to_spec() for gear in file.gears),
        inertias=dict(file.inertia_kgm2),
        source=file.source,
        drive=None if file.drive is None else file.drive.to_spec(),
        converter=None if file.converter is None else file.converter.to_stage(),
    )

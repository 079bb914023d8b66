# SPDX-License-Identifier: MIT
"""Gearbox cards: from a TOML file or a built-in name to a Gearbox in SI."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drivetwin._util.spelling import suggest_spelling
from drivetwin._util.toml import raise_faults, read_toml
from drivetwin.errors import CardError
from drivetwin.gearbox.check import find_gearbox_faults
from drivetwin.gearbox.schema import GearboxFile
from drivetwin.gearbox.spec import Gearbox

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

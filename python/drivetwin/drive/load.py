# SPDX-License-Identifier: MIT
"""Powertrain files: a path, or the name of a built-in one, to a Powertrain in SI."""

from __future__ import annotations

import math
from pathlib import Path

from drivetwin._util.spelling import suggest_spelling
from drivetwin._util.toml import raise_faults, read_toml, validate_schema
from drivetwin.drive.powertrain import Powertrain
from drivetwin.drive.schema import PowertrainFile
from drivetwin.errors import CardError
from drivetwin.gearbox import Gearbox

_FILES = Path(__file__).parent / "powertrains"


def list_builtin_powertrains() -> tuple[str, ...]:
    """Names of the built-in powertrains, in alphabetical order."""
    return tuple(sorted(path.stem for path in _FILES.glob("*.toml")))


def select_powertrain(gearbox: Gearbox) -> str:
    """Return the built-in powertrain whose engine is nearest in torque to that of the card.

    Raises CardError where the gearbox card has no [drive].
    """
    torque = gearbox.require_drive().engine_torque

    def distance(name: str) -> float:
        return abs(math.log(max(load_powertrain(name).engine.full) / torque))

    return min(list_builtin_powertrains(), key=distance)


def load_powertrain(file: Path | str) -> Powertrain:
    """Read a powertrain file; raises CardError that lists all faults by key path."""
    known = list_builtin_powertrains()
    path = _FILES / f"{file}.toml" if str(file) in known else Path(file)
    if not path.suffix and not path.exists():
        raise CardError(
            f"no built-in powertrain {str(file)!r}{suggest_spelling(str(file), known)}",
            f"give a path to a file, or one of {', '.join(known)}",
        )
    document = read_toml(path, CardError)
    raise_faults(
        validate_schema(document, PowertrainFile),
        CardError,
        str(file),
        "correct these keys of the powertrain file; docs/howto/drive.md describes them",
    )
    return PowertrainFile.model_validate(document).to_spec()

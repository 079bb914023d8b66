# SPDX-License-Identifier: MIT
"""File of the scenarios of a test bench: conditions, faults of signals, assertions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from pydantic import Field

from drivetwin._util.toml import Fault, raise_faults, read_toml, validate_schema
from drivetwin.calibration.spread import Spread
from drivetwin.calibration.trial import Scenario, build_assertion_keys
from drivetwin.errors import InputError, suggest_spelling
from drivetwin.files.limits_file import OilRecord
from drivetwin.files.records import Record

STOCK = Path(__file__).with_name("stock_scenarios.toml")
"""Scenarios of the program."""
_REMEDY = "correct these entries; the how-to page on testing a controller lists the keys"


class TrialFile(Record):
    """File of scenarios; the first is the nominal one. `assert` holds for all of them."""

    scenarios: Annotated[tuple[Scenario, ...], Field(min_length=1)]
    bounds: Mapping[str, Annotated[float, Field(ge=0, allow_inf_nan=True)]] = Field(
        default_factory=dict, alias="assert"
    )
    spread: Spread = Spread()
    oil: OilRecord = OilRecord()

    def list_scenarios(self, shift: str, draws: int) -> list[Scenario]:
        """List the scenarios; shift, draws and bounds hold where a scenario has no own ones."""
        return [
            replace(
                one,
                shift=one.shift or shift,
                draws=one.draws or draws,
                bounds={**self.bounds, **one.bounds},
            )
            for one in self.scenarios
        ]


def load_trials(path: Path) -> TrialFile:
    """Read a file of scenarios. Raises InputError that names every faulty key."""
    document = read_toml(path, InputError)
    raise_faults(validate_schema(document, TrialFile), InputError, str(path), _REMEDY)
    content, keys = TrialFile.model_validate(document), build_assertion_keys()
    tables = {f"scenarios[{k}].assert": one.bounds for k, one in enumerate(content.scenarios)}
    faults = [
        Fault(f"{table}.{key}", f"unknown key{suggest_spelling(key, keys)}")
        for table, bounds in {"assert": content.bounds, **tables}.items()
        for key in bounds
        if key not in keys
    ]
    raise_faults(faults, InputError, str(path), _REMEDY)
    return content

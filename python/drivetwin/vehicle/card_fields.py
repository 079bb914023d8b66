# SPDX-License-Identifier: MIT
"""Fields of cards, each stated once in a TOML file; those of the vehicle in `card_fields.toml`."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path


@dataclass(frozen=True)
class CardField:
    """A field of a card, or a quantity that a field follows from.

    `key` is the place of its answer, without the name of an element. `entry` is its key on the
    card, empty for a quantity without one, and `default` the value without it. `comment` is the
    line above the entry on a new card, `reference` the meaning on the reference page. `prompt` and
    `meaning` are its question, in `unit`, under the heading `group`; braces in them are words that
    the question fills in. `option` replaces the question, `help` describes the option. `parser`
    names the parser of an answer, `low`, `high`, `zero` and `choices` are its limits. A value
    outside `usual` is a `finding` about `what`, because of `why`.
    """

    key: tuple[str, ...]
    entry: str = ""
    default: str = ""
    comment: str = ""
    reference: str = ""
    prompt: str = ""
    meaning: str = ""
    unit: str = ""
    group: str = ""
    option: str = ""
    help: str = ""
    parser: str = ""
    low: float = 0.0
    high: float = 1e12
    zero: bool = False
    choices: tuple[str, ...] = ()
    usual: tuple[float, float] = (-math.inf, math.inf)
    finding: str = ""
    what: str = ""
    why: str = ""

    @property
    def option_help(self) -> str:
        """Help of the option."""
        unit = f" [{self.unit}]" if self.unit else ""
        return self.help or f"{self.prompt}{unit}."


VEHICLE_CARD = Path(__file__).with_suffix(".toml")


@cache
def read_card_fields(file: Path = VEHICLE_CARD) -> Mapping[str, CardField]:
    """Read the fields by name, such as `elements.P0_bar`, in the order of the reference page."""
    tables = tomllib.loads(file.read_text(encoding="utf-8"))
    fields = {}
    group = ""
    for name, table in tables.items():
        group = table.setdefault("group", group)
        table.setdefault("reference", table.get("comment", ""))
        if "default" in table:
            table.setdefault("entry", name.rsplit(".", 1)[-1])
        lists = {key: tuple(one) for key, one in table.items() if isinstance(one, list)}
        fields[name] = CardField(tuple(name.split(".")), **{**table, **lists})
    return fields


def get_card_field(*key: str) -> CardField:
    """Return the field of a place: `("i_in",)`, `("elements", "B2", "P0_bar")`.

    All places of a section without a field of their own, such as `("sensors", "pressure")`, have
    the field of the section.
    """
    fields = read_card_fields()
    return fields.get(".".join((key[0], *key[1:][-1:]))) or fields[key[0]]


def list_single_options() -> dict[str, CardField]:
    """List the fields by the option that answers their question alone, such as `--final-drive`."""
    options = {field.option.split(" ")[0]: field for field in read_card_fields().values()}
    return {name: one for name, one in options.items() if name not in ("", "--element", "--sensor")}

# SPDX-License-Identifier: MIT
"""Which column of a file is which role: as stated by the user, else guessed from its name."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from drivetwin.errors import MappingError, MissingChannelError, Where
from drivetwin.logs.raw import TimeColumn
from drivetwin.logs.roles import PRESSURE, ROLES
from drivetwin.tomlfile import did_you_mean


@dataclass(frozen=True)
class ChannelSpec:
    """How a role is read: value = sign·(scale·column + offset) in `unit`, then in SI.

    `unit` asserts the unit against the file (None: as the file says). `time_shift` [s] is added to
    the time stamps.
    """

    source: str
    unit: str | None = None
    sign: int = 1
    scale: float = 1.0
    offset: float = 0.0
    time_shift: float = 0.0


@dataclass(frozen=True)
class Mapped:
    """Channel specs by role, the time column, and what was left out on purpose."""

    channels: Mapping[str, ChannelSpec]
    time: TimeColumn = field(default_factory=TimeColumn)
    warnings: tuple[str, ...] = field(default=())


_ENGINE = "mot|motor|eng|engine|verbrennungsmotor|vm"
_TORQUE = "m|md|mom|moment|t|tq|trq|torque|drehmoment"
_SPEED = "n|w|om|omega|spd|speed|drehzahl|drz|rpm"
_INPUT = "in|inp|input|ein|eing|eingang|eingangs|getrein|gearboxin|turb|turbine|trnsinp|transinput"
_OUTPUT = "out|outp|output|ab|abtr|abtrieb|abtriebs|aus|ausgang|ausgangs|outshaft|outputshaft"
_GEARBOX = "(getr|getriebe|gbx|gearbox|trans|transmission|at)?"
_WHEEL = "whl|wheel|wheels|rad|raeder|rd"
_STATE = "(ist|act|actual|mess|meas|val|c|avg|mw)*"


def _either_order(thing: str, measure: str) -> str:
    return f"{_GEARBOX}(({thing})({measure})|({measure}){_GEARBOX}({thing})){_STATE}"


_NAMES: dict[str, str] = {
    "engine_torque": f"{_either_order(_ENGINE, _TORQUE)}|te|me",
    "output_torque": f"{_either_order(_OUTPUT, _TORQUE)}|to",
    "input_speed": _either_order(_INPUT, _SPEED),
    "engine_speed": f"{_either_order(_ENGINE, _SPEED)}|we|ne",
    "output_speed": _either_order(_OUTPUT, _SPEED),
    "wheel_speed": f"{_either_order(_WHEEL, _SPEED)}|ww",
    "throttle": "(accel|acc|gas|fahr)?(pedal|ped|throttle|throttlepos|pedalpos|pwg)(pos|stellung)?"
    + _STATE,
    "gear": "(current|act|ist)?(gear|gang)" + _STATE,
}
"""Names of each role, in the form of `plain`: without case, separators, umlauts."""

_PRESSURE_WORD = "p|prs|pres|press|pressure|druck"
_KIND_WORD = {
    "brake": "b|br|brk|brake|bremse",
    "clutch": "c|k|cl|clu|clutch|kup|kuppl|kupplung",
}


def plain(name: str) -> str:
    """Reduce a column name to letters and digits for comparison: `n_Ab [1/min]` -> `nab`."""
    text = re.sub(r"\\.*$|\[[^\]]*\]", "", name.casefold())
    for umlaut, letters in (("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("ß", "ss"), ("ω", "w")):
        text = text.replace(umlaut, letters)
    return re.sub(r"[^a-z0-9]", "", text)


def guess(names: Sequence[str], elements: Mapping[str, str]) -> dict[str, list[str]]:
    """Return the candidate columns of each role; `elements` gives the kind of each by name."""
    found = {
        role: [name for name in names if re.fullmatch(pattern, plain(name))]
        for role, pattern in _NAMES.items()
    }
    for element, kind in elements.items():
        found[PRESSURE + element] = _pressure_candidates(names, element, kind)
    return {role: candidates for role, candidates in found.items() if candidates}


def _pressure_candidates(names: Sequence[str], element: str, kind: str) -> list[str]:
    """Columns for an element: its full name or kind and number first, its bare number last."""
    label = plain(element)
    digits = re.sub(r"\D", "", label)
    forms = [f"({_PRESSURE_WORD})({label}){_STATE}|({label})({_PRESSURE_WORD}){_STATE}"]
    if digits:
        numbered = f"({_KIND_WORD[kind]})0*{digits}"
        forms.append(
            f"({_PRESSURE_WORD})({numbered}){_STATE}|({numbered})({_PRESSURE_WORD}){_STATE}"
        )
        forms.append(f"({_PRESSURE_WORD})0*{digits}{_STATE}")
    for form in forms:
        if candidates := [name for name in names if re.fullmatch(form, plain(name))]:
            return candidates
    return []


def resolve(
    names: Sequence[str],
    stated: Mapping[str, ChannelSpec],
    elements: Mapping[str, str],
    needed: Iterable[str],
    file: str,
) -> Mapped:
    """Decide the column of every role from the `names` of a file.

    What is `stated` holds; the rest is guessed. Raises MappingError where a stated column does not
    exist or a needed role has several candidates, MissingChannelError where a needed role has none.
    """
    needed = tuple(needed)
    _refuse_unknown_elements(stated, elements, file)
    channels = {role: _existing(role, spec, names, file) for role, spec in stated.items()}
    taken = {spec.source for spec in stated.values()}
    guessed = guess([name for name in names if name not in taken], elements)
    warnings: list[str] = []
    for role, candidates in _unclaimed(guessed, channels).items():
        if len(candidates) == 1:
            channels[role] = ChannelSpec(candidates[0])
            continue
        what = f"{role!r} may be any of the columns {', '.join(candidates)}"
        if role in needed or role.startswith(PRESSURE):
            repeated = len(set(candidates)) < len(candidates)
            remedy = "rename the repeated column in the file" if repeated else _remedy(role)
            raise MappingError(what, remedy, Where(file=file))
        warnings.append(f"{what}; none is used, name one in a channel mapping")
    _refuse_shared(channels, stated, file)
    pressures = [PRESSURE + element for element in elements]
    absent = [role for role in needed if role not in channels]
    without = [role for role in pressures if role not in channels]
    if len(pressures) - len(without) < 2:  # off-going and on-coming element
        absent += without
    else:
        warnings += [f"no column for {role!r}: its shifts cannot be told" for role in without]
    if absent:
        raise MissingChannelError(
            f"no column for {' nor '.join(map(repr, absent))} among {', '.join(names)}",
            _remedy(absent[0]),
            Where(file=file),
        )
    return Mapped(
        {role: channels[role] for role in (*ROLES, *pressures) if role in channels},
        warnings=tuple(warnings),
    )


def _refuse_unknown_elements(
    stated: Mapping[str, ChannelSpec], elements: Mapping[str, str], file: str
) -> None:
    for role in stated:
        element = role.removeprefix(PRESSURE)
        if role.startswith(PRESSURE) and element not in elements:
            raise MappingError(
                f"the mapping has a pressure of {element!r}, which is no element of the vehicle "
                f"card{did_you_mean(element, elements)}",
                "use the element names of the card: [channels.pressure.<element>]",
                Where(file=file),
            )


def _unclaimed(
    guessed: Mapping[str, list[str]], channels: Mapping[str, ChannelSpec]
) -> dict[str, list[str]]:
    return {role: names for role, names in guessed.items() if role not in channels}


def _existing(role: str, spec: ChannelSpec, names: Sequence[str], file: str) -> ChannelSpec:
    count = names.count(spec.source)
    if count == 1:
        return spec
    what = (
        f"the mapping names column {spec.source!r} for {role!r}, which the file does not have"
        f"{did_you_mean(spec.source, names)}"
        if count == 0
        else f"the file has {count} columns {spec.source!r}"
    )
    raise MappingError(what, "correct `source`, or rename the column in the file", Where(file=file))


def _refuse_shared(
    channels: Mapping[str, ChannelSpec], stated: Mapping[str, ChannelSpec], file: str
) -> None:
    """A guessed column must not serve two roles, as with two elements of one number."""
    roles_of: dict[str, list[str]] = {}
    for role, spec in channels.items():
        if role not in stated:
            roles_of.setdefault(spec.source, []).append(role)
    for source, roles in roles_of.items():
        if len(roles) > 1:
            raise MappingError(
                f"column {source!r} may be {' or '.join(roles)}",
                _remedy(roles[0]),
                Where(file=file),
            )


def _remedy(role: str) -> str:
    return (
        f"name its column in a channel mapping (--channels): channels.{role} = "
        '{ source = "..." }; `drivetwin inspect` lists the columns'
    )

# SPDX-License-Identifier: MIT
"""Assignment of file columns to roles: stated by the user, else inferred from the names."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from drivetwin._util.spelling import suggest_spelling
from drivetwin.channels.channel_spec import ChannelSpec, RememberedChannel
from drivetwin.channels.pressure_roles import get_pressure_element, make_pressure_role
from drivetwin.channels.read_options import Column, ReadOptions
from drivetwin.channels.recall import recall_channels
from drivetwin.channels.roles import MEASURED, ROLES, STAND_INS
from drivetwin.errors import MappingError, MissingChannelError, Where
from drivetwin.findings import Code, Finding, report


@dataclass(frozen=True)
class Mapped:
    """Channel specs by role, how to read the file, and what was left out on purpose."""

    channels: Mapping[str, ChannelSpec]
    options: ReadOptions = field(default_factory=ReadOptions)
    findings: tuple[Finding, ...] = ()


_ENGINE = "mot|motor|eng|engine|verbrennungsmotor|vm"
_TORQUE = "m|md|mom|moment|t|tq|trq|torque|drehmoment"
_SPEED = "n|w|om|omega|spd|speed|drehzahl|drz|rpm"
_INPUT = (
    "inputshaft|inshaft|in|inp|input|ein|eing|eingang|eingangs|getrein|gearboxin|trb|turb|turbine|"
    "turbinen|trnsinp|transinput"
)
_OUTPUT = (
    "out|outp|output|ab|abtr|abtrieb|abtriebs|aus|ausgang|ausgangs|outshaft|outputshaft|"
    "abtriebswelle|kard|kardan|cardan|prop|propshaft|gelenkwelle|gelenkwellen|tailshaft"
)
_GEARBOX = "(getr|getriebe|gbx|gearbox|trans|transmission|at)?"
_WHEEL = (
    "whl|wheel|wheels|rad|raeder|rd|hinterrad|antriebsrad|drivenwheel|drivenwheels|rearwheel|"
    "rearwheels|rearaxle"
)
_BESIDE = "(can|bus|xcp|ecu|tcu|mess|meas)*"
_SIDE = "(h|v|f|r)(l|r)|left|right|links|rechts"
_AFTER = "(ist|act|actual|can|bus|xcp|mess|meas|value|val|mean|avg|mittel|ha|rear|nm|rpm|bar)*"
_STATE = "(ist|act|actual|mess|meas|val|c|avg|mw)*"


def _make_either_order(thing: str, measure: str) -> str:
    return f"{_GEARBOX}(({thing})({measure})|({measure}){_GEARBOX}({thing})){_STATE}"


_NAMES: dict[str, str] = {
    "engine_torque": f"{_make_either_order(_ENGINE, _TORQUE)}|te|me|engnettorque",
    "output_torque": f"{_make_either_order(_OUTPUT, _TORQUE)}|to",
    "input_speed": _make_either_order(_INPUT, _SPEED),
    "engine_speed": f"{_make_either_order(_ENGINE, _SPEED)}|we|ne|omegae",
    "output_speed": _make_either_order(_OUTPUT, _SPEED),
    "wheel_speed": f"({_make_either_order(_WHEEL, _SPEED)}|ww)({_SIDE})?",
    "throttle": "(accel|acc|gas|fahr)?(pedal|ped|throttle|pwg)((pos1?)|stellung|wert)?" + _STATE,
    "gear": "(trans)?(current|act|actual|ist|n)?(gear|gang)(engaged)?" + _STATE,
    "requested_gear": "(trans|getr|tcu)?(((selected|requested|request|req|desired|target|ziel|soll)"
    "(gear|gang))|((gear|gang)(selected|requested|request|req|desired|target|ziel|soll)))",
    "shift_in_process": "(trans|getr)?(shift|schaltung)(inprocess|active|flag|aktiv)" + _STATE,
    "lockup_engaged": "(trans)?(torqueconverter|tc|wandler)?(lockup|luc|wk)(engaged|closed|zu)?"
    + _STATE,
}
"""Names of each role, in the form of `plain`: without case, separators, umlauts. Where no column
has one, names with a source before them or more words after them count."""

_PRESSURE_WORD = "p|prs|pres|press|pressure|druck"
_KIND_WORD = {
    "brake": "b|br|brk|brake|bremse|brems",
    "clutch": "c|k|cl|clu|clt|clutch|kup|kuppl|kupplung|kupplungs",
}


def normalise_name(name: str) -> str:
    """Reduce a column name to letters and digits for comparison: `n_Ab [1/min]` -> `nab`."""
    text = re.sub(r"\\.*$|\[[^\]]*\]", "", name.casefold())
    for umlaut, letters in (("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("ß", "ss"), ("ω", "w")):
        text = text.replace(umlaut, letters)
    return re.sub(r"[^a-z0-9]", "", text)


def infer_candidates(
    columns: Sequence[Column], elements: Mapping[str, str]
) -> dict[str, list[Column]]:
    """Return the candidate columns of each role; `elements` gives the kind of each by name.

    A column without any number, or from a strange sender, is a candidate only where no other is, a
    silent one never.
    """
    columns = [column for column in columns if not column.silent]
    found = {
        role: _select_first_match(columns, (pattern, f"{_BESIDE}({pattern}){_AFTER}"))
        for role, pattern in _NAMES.items()
    }
    for element, kind in elements.items():
        found[make_pressure_role(element)] = _find_pressure_candidates(columns, element, kind)
    return {
        role: _drop_secondary(_drop_empty(candidates))
        for role, candidates in found.items()
        if candidates
    }


def _select_first_match(columns: Sequence[Column], forms: Iterable[str]) -> list[Column]:
    """Return the columns that match the first pattern of `forms` that matches any column.

    The last part of a name like `log.EngTrq` counts only where no whole name has any.
    """
    forms = tuple(forms)
    for part in (normalise_name, lambda name: normalise_name(re.split(r"[./]", name)[-1])):
        for form in forms:
            if found := [column for column in columns if re.fullmatch(form, part(column.name))]:
                return found
    return []


def _drop_secondary(candidates: list[Column]) -> list[Column]:
    return [column for column in candidates if not column.aside] or candidates


def _drop_empty(candidates: list[Column]) -> list[Column]:
    return [column for column in candidates if not column.empty] or candidates


def _drop_abbreviations(words: str) -> str:
    """Drop the abbreviations from a pattern of alternatives."""
    return "|".join(word for word in words.split("|") if len(word) > 2)


def _find_pressure_candidates(columns: Sequence[Column], element: str, kind: str) -> list[Column]:
    """Columns for an element: its full name or kind and number first, its bare number last."""
    label = normalise_name(element)
    digits = re.sub(r"\D", "", label)
    forms = [f"({_PRESSURE_WORD})({label}){_STATE}|({label})({_PRESSURE_WORD}){_STATE}"]
    if digits:
        numbered = f"({_KIND_WORD[kind]})0*{digits}"
        forms.append(
            f"({_PRESSURE_WORD})({numbered}){_STATE}|({numbered})({_PRESSURE_WORD}){_STATE}"
        )
        # Compounds name kind and pressure before number or label, in whole words: no `Kp2`.
        compound = (
            f"({_drop_abbreviations(_KIND_WORD[kind])})({_drop_abbreviations(_PRESSURE_WORD)})"
        )
        forms.append(f"{compound}({label}|0*{digits}){_STATE}")
        forms.append(f"({_PRESSURE_WORD})({_KIND_WORD[kind]})({label}){_STATE}")
        forms.append(f"({_PRESSURE_WORD})0*{digits}{_STATE}")
    return _select_first_match(columns, forms)


def resolve_roles(
    columns: Sequence[Column],
    stated: Mapping[str, ChannelSpec],
    elements: Mapping[str, str],
    needed: Iterable[str],
    file: str,
    sound: Iterable[str] | None = None,
    remembered: Mapping[str, RememberedChannel] | None = None,
) -> Mapped:
    """Decide the column of every role from the `columns` of a file.

    The `stated` specs take precedence, then those `remembered` of an earlier log, as far as the
    file has their columns; other roles are inferred. Raises MappingError
    where a stated column does not exist or a role has several candidates (only a finding where the
    role is neither `needed` nor `sound`, by default all measured ones), MissingChannelError where a
    needed role and its stand-in have none.
    """
    remembered = remembered or {}
    needed = frozenset(needed)
    measured = [*MEASURED, *map(make_pressure_role, elements)]
    strict = needed.union(measured if sound is None else sound)
    _refuse_unknown_elements(stated, elements, file)
    stated, findings = _drop_absent_optional(stated, columns, strict)
    channels = {role: _require_column(role, spec, columns, file) for role, spec in stated.items()}
    free = select_free(columns, stated.values())
    open_roles = {role: one for role, one in remembered.items() if role not in stated}
    recalled, remarks = recall_channels(open_roles, free, elements)
    channels |= recalled
    findings += remarks
    free = select_free(free, recalled.values())
    for role, candidates in infer_candidates(free, elements).items():
        if role in channels:
            continue
        if len(candidates) == 1:
            channels[role] = make_spec(candidates[0], columns)
            findings += _find_other_senders(candidates[0], columns)
            continue
        named = ", ".join(map(str, candidates))
        if role in strict:
            what = f"{role!r} may be any of the columns {named}"
            raise MappingError(what, _suggest_choice(role, candidates), Where(file=file))
        findings.append(report(Code.COLUMN_AMBIGUOUS, role=role, columns=named))
    _refuse_double_use(channels, {*stated, *recalled}, file)
    _refuse_absent(needed, channels, columns, file, remembered)
    order = [*ROLES, *(make_pressure_role(element) for element in elements)]
    without = [element for element in elements if make_pressure_role(element) not in channels]
    if without:
        findings.append(report(Code.NO_PRESSURE, elements=", ".join(without)))
    return Mapped(
        {role: channels[role] for role in order if role in channels}, findings=tuple(findings)
    )


def select_free(columns: Iterable[Column], specs: Iterable[ChannelSpec]) -> list[Column]:
    """Return the columns that none of the `specs` refers to."""
    specs = tuple(specs)
    return [one for one in columns if not any(spec.matches(one) for spec in specs)]


def _drop_absent_optional(
    stated: Mapping[str, ChannelSpec], columns: Sequence[Column], strict: Collection[str]
) -> tuple[dict[str, ChannelSpec], list[Finding]]:
    """Drop the stated roles outside `strict` whose column is absent, with a finding for each."""
    names = {column.name for column in columns}
    absent = {
        role: spec.source
        for role, spec in stated.items()
        if role not in strict and spec.source not in names
    }
    findings = [
        report(Code.MAPPED_COLUMN_ABSENT, role=role, column=source)
        for role, source in absent.items()
    ]
    return {role: spec for role, spec in stated.items() if role not in absent}, findings


def _suggest_choice(role: str, candidates: Sequence[Column]) -> str:
    """Suggest how to choose among the candidates of a role: by name, or by group."""
    if len(set(candidates)) < len(candidates):
        return "rename the repeated column in the file"
    if len({one.name for one in candidates}) > 1:
        return _suggest_remedy(role)
    first = candidates[0]
    return (
        f"choose one in a channel mapping (--channels): channels.{role} = "
        f'{{ source = "{first.name}", group = "{first.group}" }}'
    )


def _find_other_senders(chosen: Column, columns: Sequence[Column]) -> list[Finding]:
    """Return a finding on other senders of the same signal."""
    others = [one for one in columns if one.aside and not one.silent and one.name == chosen.name]
    if not others:
        return []
    unused = ", ".join(map(str, others))
    return [report(Code.OTHER_SENDERS, used=str(chosen), unused=unused)]


def make_spec(column: Column, columns: Sequence[Column]) -> ChannelSpec:
    """Return the spec that picks a column: with its group where the name alone would not."""
    alike = sum(other.name == column.name for other in columns)
    return ChannelSpec(column.name, group=column.group if alike > 1 else None)


def _refuse_absent(
    needed: Iterable[str],
    channels: Mapping[str, ChannelSpec],
    columns: Sequence[Column],
    file: str,
    remembered: Mapping[str, RememberedChannel],
) -> None:
    order = [*ROLES, *sorted(role for role in needed if role not in ROLES)]
    absent = [
        role
        for role in order
        if role in needed and role not in channels and STAND_INS.get(role) not in channels
    ]
    if absent:
        silent = ", ".join(dict.fromkeys(column.name for column in columns if column.silent))
        earlier = ", ".join(
            f"{remembered[role].spec.source!r} for {role!r}"
            for role in absent
            if role in remembered
        )
        raise MissingChannelError(
            f"no column for {' nor '.join(map(repr, absent))} among "
            f"{', '.join(dict.fromkeys(one.name for one in columns if not one.silent))}"
            + (f"; without a value throughout: {silent}" if silent else "")
            + (f"; the twin was identified with {earlier}" if earlier else ""),
            _suggest_remedy(absent[0]),
            Where(file=file),
        )


def _refuse_unknown_elements(
    stated: Mapping[str, ChannelSpec], elements: Mapping[str, str], file: str
) -> None:
    for role in stated:
        element = get_pressure_element(role)
        if element is not None and element not in elements:
            raise MappingError(
                f"the mapping has a pressure of {element!r}, which is no element of the vehicle "
                f"card{suggest_spelling(element, elements)}",
                "use the element names of the card: [channels.pressure.<element>]",
                Where(file=file),
            )


def _require_column(
    role: str, spec: ChannelSpec, columns: Sequence[Column], file: str
) -> ChannelSpec:
    found = _drop_empty([column for column in columns if spec.matches(column)])
    if len(found) == 1:
        return spec
    where = Where(file=file)
    if found:
        groups = list(dict.fromkeys(column.group for column in found))
        if len(groups) == len(found):
            what = f"the file has {spec.source!r} in {', '.join(map(repr, groups))}"
            remedy = f'choose one in the channel mapping: channels.{role}.group = "{groups[0]}"'
            raise MappingError(what, remedy, where)
        what = f"the file has {len(found)} columns {spec.source!r}"
        raise MappingError(what, "rename the repeated column in the file", where)
    groups = [column.group for column in columns if column.name == spec.source]
    if groups:
        what = (
            f"the mapping names {spec.source!r} in {spec.group!r} for {role!r}; the file has it in "
            f"{', '.join(map(repr, groups))}"
        )
        raise MappingError(what, "correct `group`", where)
    names = [column.name for column in columns]
    what = (
        f"the mapping names column {spec.source!r} for {role!r}, which the file does not have"
        f"{suggest_spelling(spec.source, names)}"
    )
    raise MappingError(what, "correct `source`, or rename the column in the file", where)


def _refuse_double_use(
    channels: Mapping[str, ChannelSpec], stated: Collection[str], file: str
) -> None:
    """A guessed column must not serve two roles, as with two elements of one number."""
    roles_of: dict[tuple[str, str | None], list[str]] = {}
    for role, spec in channels.items():
        if role not in stated:
            roles_of.setdefault((spec.source, spec.group), []).append(role)
    for (source, _), roles in roles_of.items():
        if len(roles) > 1:
            raise MappingError(
                f"column {source!r} may be {' or '.join(roles)}",
                _suggest_remedy(roles[0]),
                Where(file=file),
            )


def _suggest_remedy(role: str) -> str:
    return (
        f"name its column in a channel mapping (--channels): channels.{role} = "
        '{ source = "..." }; `drivetwin inspect` lists the columns'
    )

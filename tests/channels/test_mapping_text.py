# SPDX-License-Identifier: MIT
"""Written mappings: valid TOML whatever the names, comments that become entries."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.channels.mapping import resolve_roles
from drivetwin.channels.mapping_file import read_mapping
from drivetwin.channels.mapping_text import Candidate, Draft, Stub, UnitGap, format_mapping
from drivetwin.channels.read_options import ChannelSpec, Column
from drivetwin.channels.units import Proposal

NAMES = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=20)
"""Any names of columns; lone surrogates cannot be written in UTF-8."""

HOSTILE = 'a"b\\\n[channels.gear]\nsource = "x"\r\u2028\x00\x7f\u202e#'


def read(folder: Path, text: str) -> dict[str, ChannelSpec]:
    path = folder / "channels.toml"
    path.write_text(text, encoding="utf-8", newline="")
    return dict(read_mapping(path).channels)


def uncomment(text: str, *, keys: str) -> str:
    """Remove the leading `# ` of the lines whose entry matches `keys`."""
    return re.sub(rf"(?m)^# (?=(?:{keys}))", "", text)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(NAMES, min_size=2, max_size=2, unique=True), st.lists(NAMES, max_size=3), NAMES, NAMES
)
def test_any_names_select_the_same_channels(
    tmp_path: Path, sources: list[str], added: list[str], element: str, unit: str
) -> None:
    channels = {
        "gear": ChannelSpec(sources[0], unit, group=sources[1]),
        f"pressure.{element}": ChannelSpec(sources[1], unit),
    }
    elements = {element: "clutch"}
    text = format_mapping(channels)
    tomllib.loads(text)
    again = read(tmp_path, text)
    assert again == channels
    columns = [Column(sources[0], group=sources[1]), Column(sources[1]), *map(Column, added)]
    columns = [one for n, one in enumerate(columns) if n < 2 or one.name not in sources]
    assert resolve_roles(columns, again, elements, (), "log", ()).channels.items() >= again.items()


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(NAMES, NAMES, NAMES, NAMES)
def test_comments_with_any_names_stay_comments_and_become_entries(
    tmp_path: Path, source: str, other: str, element: str, why: str
) -> None:
    why = f"Reason: {why}"
    proposal = Proposal("bar", why)
    stub = Stub(
        f"pressure.{element}",
        why,
        (
            Candidate(ChannelSpec(source, group=other), why, (proposal,)),
            Candidate(ChannelSpec(other), why),
        ),
    )
    draft = Draft({"throttle": UnitGap(why)}, (stub,), UnitGap(why, (proposal,)), remarks=(why,))
    text = format_mapping({"throttle": ChannelSpec(source)}, draft=draft)
    assert read(tmp_path, text) == {"throttle": ChannelSpec(source)}
    entries = uncomment(text, keys=r"\[channels|source|group|unit = \"bar\"  # proposal$")
    found = read(tmp_path, entries)
    expected = ChannelSpec(source, "bar", group=other)
    assert found[f"pressure.{element}"] == expected


def test_a_hostile_name_is_escaped_in_entries_and_comments(tmp_path: Path) -> None:
    stub = Stub("throttle", HOSTILE, (Candidate(ChannelSpec(HOSTILE), HOSTILE),))
    text = format_mapping({"gear": ChannelSpec(HOSTILE)}, draft=Draft(stubs=(stub,)))
    assert all(line.isprintable() for line in text.split("\n"))
    assert read(tmp_path, text) == {"gear": ChannelSpec(HOSTILE)}


def test_a_proposal_is_a_comment_unless_it_is_accepted_and_the_only_one(tmp_path: Path) -> None:
    one, two = Proposal("rpm", "1143 to 1491"), Proposal("rad/s", "1143 to 1491")
    channels = {"input_speed": ChannelSpec("n"), "output_speed": ChannelSpec("m")}
    units = {"input_speed": UnitGap("no unit", (one,)), "output_speed": UnitGap("none", (one, two))}
    assert read(tmp_path, format_mapping(channels, draft=Draft(units))) == channels
    accepted = format_mapping(channels, draft=Draft(units, accept=True))
    assert read(tmp_path, accepted) == {**channels, "input_speed": ChannelSpec("n", "rpm")}
    by_hand = uncomment(format_mapping(channels, draft=Draft(units)), keys='unit = "rpm"')
    assert {one.unit for one in read(tmp_path, by_hand).values()} == {"rpm"}


def test_without_a_proposal_the_usual_units_are_listed() -> None:
    draft = Draft({"throttle": UnitGap("no unit")})
    text = format_mapping({"throttle": ChannelSpec("x")}, draft=draft)
    assert '# unit = "..."' in text
    assert "'%'" in text


def test_names_of_the_user_read_back(tmp_path: Path) -> None:
    names = {"engine_torque": ["Kanal 7", 'x"y1'], "pressure.K 1": ["p7"]}
    path = tmp_path / "channels.toml"
    path.write_text(format_mapping({}, names=names), encoding="utf-8")
    assert read_mapping(path).names == names

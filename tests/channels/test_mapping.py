# SPDX-License-Identifier: MIT
"""Roles of columns: guesses from names in use, ambiguity and absence."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from drivetwin.channels.mapping import (
    Fallback,
    recall_channels,
    resolve_roles,
)
from drivetwin.channels.roles import (
    ChannelSpec,
    Column,
    RememberedChannel,
)
from drivetwin.errors import MappingError, MissingChannelError
from drivetwin.findings import Code, render

ELEMENTS = {"B2": "brake", "B3": "brake"}
NEEDED = ("engine_torque", "output_torque", "input_speed", "output_speed")
ENGLISH = ["EngTrq", "PrsBrk2", "PrsBrk3", "TrqOut", "SpdIn", "SpdOut", "SpdWhl"]


def columns(names: Sequence[str]) -> list[Column]:
    return [Column(name) for name in names]


def test_resolve_orders_roles_and_prefers_what_is_stated() -> None:
    stated = {"output_torque": ChannelSpec("Sensor7", unit="Nm", sign=-1)}
    mapped = resolve_roles(columns([*ENGLISH, "Sensor7"]), stated, ELEMENTS, NEEDED, "log.csv")
    assert list(mapped.channels) == [
        "engine_torque", "output_torque", "input_speed", "output_speed", "wheel_speed",
        "pressure.B2", "pressure.B3",
    ]  # fmt: skip
    assert mapped.channels["output_torque"].source == "Sensor7"
    assert mapped.channels["pressure.B3"] == ChannelSpec("PrsBrk3")
    assert mapped.findings == ()


def test_a_stated_column_is_not_guessed_for_another_role() -> None:
    stated = {"wheel_speed": ChannelSpec("SpdIn")}
    with pytest.raises(MissingChannelError, match="'input_speed'"):
        resolve_roles(columns(ENGLISH), stated, ELEMENTS, NEEDED, "log.csv")


def test_an_ignored_column_gets_no_role_unless_one_is_stated() -> None:
    remembered = {"output_torque": RememberedChannel(ChannelSpec("TrqOut"))}
    fallback = Fallback(remembered, {"wheel_speed": ["TrqOut"]}, ("TrqOut", "SpdWhl", "Nowhere"))
    mapped = resolve_roles(columns(ENGLISH), {}, ELEMENTS, (), "log.csv", fallback=fallback)
    assert not {"output_torque", "wheel_speed"} & set(mapped.channels)
    assert [one.code for one in mapped.findings] == [Code.IGNORED_COLUMN_ABSENT]
    stated = {"wheel_speed": ChannelSpec("SpdWhl")}
    mapped = resolve_roles(columns(ENGLISH), stated, ELEMENTS, (), "log.csv", fallback=fallback)
    assert mapped.channels["wheel_speed"].source == "SpdWhl"


def test_an_ignored_candidate_leaves_the_other_one() -> None:
    two = columns([*ENGLISH, "EngineTorque"])
    mapped = resolve_roles(
        two, {}, ELEMENTS, NEEDED, "log.csv", fallback=Fallback(ignored=("EngTrq",))
    )
    assert mapped.channels["engine_torque"].source == "EngineTorque"


def test_the_engine_speed_stands_in_for_the_input_speed() -> None:
    stated = {"engine_speed": ChannelSpec("SpdIn")}
    mapped = resolve_roles(columns(ENGLISH), stated, ELEMENTS, NEEDED, "log.csv")
    assert "input_speed" not in mapped.channels
    assert mapped.channels["engine_speed"].source == "SpdIn"


def test_what_nobody_needs_may_be_missing() -> None:
    mapped = resolve_roles(columns(["SpdIn", "SpdOut"]), {}, ELEMENTS, ("input_speed",), "log.csv")
    assert list(mapped.channels) == ["input_speed", "output_speed"]
    assert render(mapped.findings) == (
        "No pressure of B2, B3: nothing that depends on it can be identified.",
    )


def test_a_pressure_can_be_needed() -> None:
    with pytest.raises(MissingChannelError, match=r"'pressure\.B2' among SpdIn"):
        resolve_roles(columns(["SpdIn"]), {}, ELEMENTS, ("pressure.B2",), "log.csv")


def test_columns_of_one_name_are_told_apart_by_group() -> None:
    both = [*columns(ENGLISH), Column("n", group="10ms"), Column("n", group="100ms")]
    stated = {"engine_speed": ChannelSpec("n", group="100ms")}
    mapped = resolve_roles(both, stated, ELEMENTS, NEEDED, "log.mf4")
    assert mapped.channels["engine_speed"].group == "100ms"
    with pytest.raises(MappingError, match="the file has 'n' in '10ms', '100ms'") as caught:
        resolve_roles(both, {"engine_speed": ChannelSpec("n")}, ELEMENTS, NEEDED, "log.mf4")
    assert 'channels.engine_speed.group = "10ms"' in caught.value.remedy
    with pytest.raises(MappingError, match="'n' in '1s' for 'gear'; the file has it in '10ms'"):
        resolve_roles(both, {"gear": ChannelSpec("n", group="1s")}, ELEMENTS, NEEDED, "log.mf4")


def test_two_groups_with_one_recognised_name_are_ambiguous_with_both_named() -> None:
    names = [name for name in ENGLISH if name != "SpdIn"]
    both = [*columns(names), Column("SpdIn", group="10ms"), Column("SpdIn", group="100ms")]
    with pytest.raises(MappingError, match=r"SpdIn \(10ms\), SpdIn \(100ms\)"):
        resolve_roles(both, {}, ELEMENTS, NEEDED, "log.mf4")


def test_a_column_without_numbers_is_no_rival() -> None:
    names = [name for name in ENGLISH if name != "SpdIn"]
    both = [*columns(names), Column("SpdIn", group="a", empty=True), Column("SpdIn", group="b")]
    mapped = resolve_roles(both, {}, ELEMENTS, NEEDED, "log.mf4")
    assert mapped.channels["input_speed"] == ChannelSpec("SpdIn", group="b")


def test_missing_roles_are_all_named_with_columns_and_remedy() -> None:
    names = [name for name in ENGLISH if name not in ("TrqOut", "SpdIn")]
    with pytest.raises(MissingChannelError) as caught:
        resolve_roles(columns(names), {}, ELEMENTS, NEEDED, "log.csv")
    assert caught.value.format_for_shell() == (
        "log.csv: no column for 'output_torque' nor 'input_speed' among EngTrq, PrsBrk2, PrsBrk3, "
        "SpdOut, SpdWhl\n"
        "  -> name its column in a channel mapping (--channels): channels.output_torque = "
        "{ source = \"...\" }; 'drivetwin inspect' lists the columns"
    )


def test_a_third_element_may_lack_its_pressure() -> None:
    elements = {**ELEMENTS, "K2": "clutch"}
    mapped = resolve_roles(columns(ENGLISH), {}, elements, NEEDED, "log.csv")
    assert "pressure.K2" not in mapped.channels
    assert [one.code for one in mapped.findings] == [Code.NO_PRESSURE]


def test_several_candidates_for_a_needed_role_are_an_error() -> None:
    with pytest.raises(MappingError) as caught:
        resolve_roles(columns([*ENGLISH, "Motormoment"]), {}, ELEMENTS, NEEDED, "log.csv")
    assert (
        caught.value.what
        == "'engine_torque' has several candidates: the columns EngTrq, Motormoment"
    )
    assert "channels.engine_torque = { source" in caught.value.remedy


def test_several_candidates_for_another_role_are_a_warning() -> None:
    mapped = resolve_roles(columns([*ENGLISH, "Gang", "gear"]), {}, ELEMENTS, NEEDED, "log.csv")
    assert "gear" not in mapped.channels
    assert render(mapped.findings) == (
        "Role 'gear' has several candidates: the columns Gang, gear; none is used. "
        "Name one in a channel mapping.",
    )


def test_a_repeated_column_name_is_ambiguous() -> None:
    with pytest.raises(MappingError, match="EngTrq, EngTrq") as caught:
        resolve_roles(columns([*ENGLISH, "EngTrq"]), {}, ELEMENTS, NEEDED, "log.csv")
    assert caught.value.remedy == "rename the repeated column in the file"
    stated = {"engine_torque": ChannelSpec("EngTrq")}
    with pytest.raises(MappingError, match="the file has 2 columns 'EngTrq'"):
        resolve_roles(columns([*ENGLISH, "EngTrq"]), stated, ELEMENTS, NEEDED, "log.csv")


def test_one_column_for_two_elements_is_ambiguous() -> None:
    names = [name for name in ENGLISH if not name.startswith("Prs")]
    with pytest.raises(MappingError, match=r"column 'p2' may be pressure\.B2 or pressure\.K2"):
        resolve_roles(
            columns([*names, "p2"]), {}, {"B2": "brake", "K2": "clutch"}, NEEDED, "log.csv"
        )


def test_a_stated_column_must_exist() -> None:
    with pytest.raises(MappingError, match=r"'Trq_Out' for 'output_torque'.* mean 'TrqOut'"):
        resolve_roles(
            columns(ENGLISH), {"output_torque": ChannelSpec("Trq_Out")}, ELEMENTS, NEEDED, "log.csv"
        )


def test_a_stated_element_must_be_on_the_card() -> None:
    with pytest.raises(MappingError, match="'B4', which is no element"):
        resolve_roles(
            columns(ENGLISH), {"pressure.B4": ChannelSpec("PrsBrk2")}, ELEMENTS, NEEDED, "log.csv"
        )


def test_a_strange_sender_counts_where_no_other_has_numbers() -> None:
    own, strange = Column("EngSpeed", group="EEC1 from 0x00"), "EEC1 from 0xF9"
    other = Column("EngSpeed", group=strange, aside=True)
    mapped = resolve_roles([own, other], {}, {}, (), "bus.log")
    assert mapped.channels["engine_speed"].group == own.group
    assert strange in mapped.findings[0].text


def test_absent_column_of_an_optional_role_is_a_finding() -> None:
    columns = [Column("EngTrq", "Nm"), Column("SpdIn", "rpm"), Column("SpdOut", "rpm")]
    stated = {"throttle": ChannelSpec("Pedal"), "gear": ChannelSpec("Gear")}
    mapped = resolve_roles(columns, stated, {}, (), "log.csv")
    assert [one.names["column"] for one in mapped.findings] == ["Pedal", "Gear"]
    assert not stated.keys() & mapped.channels.keys()
    with pytest.raises(MappingError, match="Pedal"):
        resolve_roles(columns, stated, {}, ("throttle",), "log.csv")


SPEEDS = ("input_speed", "output_speed")


def remember(source: str, file_unit: str | None = "rpm", **spec: object) -> RememberedChannel:
    return RememberedChannel(ChannelSpec(source, **spec), file_unit)  # type: ignore[arg-type]


def recall(channel: RememberedChannel, unit: str | None) -> tuple[ChannelSpec, list[Code]]:
    specs, findings = recall_channels(
        {"input_speed": channel}, [Column(channel.spec.source, unit)], ()
    )
    return specs["input_speed"], [one.code for one in findings]


def test_a_log_of_the_same_kind_is_read_in_the_same_way() -> None:
    asserted = remember("n1", None, unit="rpm", sign=-1, scale=0.5, offset=2.0, time_shift=-0.01)
    spec, _ = recall(asserted, None)
    assert spec == asserted.spec
    overridden = remember("n1", "1/s", unit="rpm", scale=60.0)
    assert recall(overridden, "1/s") == (overridden.spec, [])
    assert recall(remember("n1"), "1/min") == (ChannelSpec("n1"), [])


def test_a_unit_that_the_log_does_not_name_is_that_of_the_twin_and_told() -> None:
    spec, codes = recall(remember("n1", "rpm"), " ")
    assert (spec.unit, codes) == ("rpm", [Code.UNITS_REMEMBERED])
    spec, codes = recall(remember("n1", None), None)
    assert (spec.unit, codes) == (None, [])


@pytest.mark.parametrize("before", ["rpm", "1/s", None])
def test_the_unit_that_a_log_names_is_never_overridden_by_another_log(before: str | None) -> None:
    channel = remember("n1", before, unit="rpm", sign=-1, scale=2.0, time_shift=0.01)
    spec, codes = recall(channel, "rad/s")
    assert spec == ChannelSpec("n1", sign=-1, time_shift=0.01)
    assert codes == [Code.CONVERSION_NOT_USED]


def test_a_log_that_names_the_unit_that_was_asserted_is_read_as_it_is() -> None:
    assert recall(remember("n1", None, unit="1/min"), "rpm") == (ChannelSpec("n1"), [])
    _, codes = recall(remember("n1", None, unit="rpm", scale=0.125), "rpm")
    assert codes == [Code.CONVERSION_NOT_USED]


def test_what_a_mapping_states_comes_before_the_twin_and_the_twin_before_names() -> None:
    columns = [Column(name, "rpm") for name in ("a", "b", "n_ein", "n_ab")]
    twin = Fallback({"input_speed": remember("a"), "output_speed": remember("b")})
    stated = {"input_speed": ChannelSpec("n_ein")}
    mapped = resolve_roles(columns, stated, {}, SPEEDS, "log.csv", fallback=twin)
    assert mapped.channels["input_speed"].source == "n_ein"
    assert mapped.channels["output_speed"].source == "b"


def test_a_log_with_other_names_is_read_by_its_names() -> None:
    twin = Fallback({"input_speed": remember("a"), "output_speed": remember("b")})
    columns = [Column("n_ein", "rpm"), Column("b", "rpm")]
    mapped = resolve_roles(columns, {}, {}, SPEEDS, "log.csv", fallback=twin)
    assert mapped.channels["input_speed"] == ChannelSpec("n_ein")


@pytest.mark.parametrize("role", ["engine_torque", "wheel_speed", "gear"])
def test_an_absent_channel_of_an_optional_role_is_no_error(role: str) -> None:
    columns = [Column("a", "rpm"), Column("b", "rpm")]
    twin = Fallback({
        "input_speed": remember("a"), "output_speed": remember("b"), role: remember("gone"),
        "pressure.K9": remember("p9"),
    })  # fmt: skip
    mapped = resolve_roles(columns, {}, {"K1": "clutch"}, SPEEDS, "log.csv", fallback=twin)
    assert set(mapped.channels) == set(SPEEDS)


def test_an_absent_channel_of_a_needed_role_is_named_with_the_role() -> None:
    twin = Fallback({"input_speed": remember("Drehz 1"), "output_speed": remember("b")})
    with pytest.raises(MissingChannelError) as caught:
        resolve_roles([Column("b", "rpm")], {}, {}, SPEEDS, "log.csv", fallback=twin)
    assert "no column for 'input_speed'" in caught.value.what
    assert "the twin was identified with 'Drehz 1' for 'input_speed'" in caught.value.what


def test_a_repeated_column_is_not_chosen_for_the_user() -> None:
    specs, _ = recall_channels(
        {"input_speed": remember("n")}, [Column("n", group="a"), Column("n", group="b")], ()
    )
    assert specs == {}
    chosen = {"input_speed": remember("n", None, group="b")}
    specs, _ = recall_channels(chosen, [Column("n", group="a"), Column("n", group="b")], ())
    assert specs["input_speed"].group == "b"

# SPDX-License-Identifier: MIT
"""Mapping of a twin's log used for another log: precedence, absence, units."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.channels.mapping import Fallback, recall_channels, recall_options, resolve_roles
from drivetwin.channels.read_options import (
    BusOptions,
    ChannelSpec,
    Column,
    ReadOptions,
    RememberedChannel,
    TimeColumn,
)
from drivetwin.channels.roles import ROLES
from drivetwin.errors import MissingChannelError
from drivetwin.findings import Code

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


@pytest.mark.parametrize("role", [role for role in ROLES if role not in SPEEDS])
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


def test_options_complete_the_stated_ones(tmp_path: Path) -> None:
    (tmp_path / "bus.dbc").touch()
    bus = BusOptions((Path("bus.dbc"), Path("gone.dbc")), 1109.0)
    remembered = ReadOptions(TimeColumn("clk", "ms"), bus)
    found = recall_options(ReadOptions(), remembered, tmp_path)
    assert found.time == remembered.time
    assert found.bus == BusOptions((tmp_path / "bus.dbc",), 1109.0)
    stated = ReadOptions(TimeColumn("t"), BusOptions(reference_torque=5.0))
    assert recall_options(stated, remembered, tmp_path) == stated

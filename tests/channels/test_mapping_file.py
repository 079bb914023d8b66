# SPDX-License-Identifier: MIT
"""Mapping files: written ones read back, faults named by key."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.channels.mapping_file import format_mapping, read_mapping
from drivetwin.channels.roles import BusOptions, ChannelSpec, ReadOptions, TimeColumn
from drivetwin.errors import MappingError


def test_a_written_mapping_reads_back(tmp_path: Path) -> None:
    channels = {
        "engine_torque": ChannelSpec('M "Mot" ä', "Nm", -1, 0.5, 3.0, -0.01),
        "gear": ChannelSpec("Gang"),
        "pressure.B2": ChannelSpec("p2", "bar"),
        "pressure.K 1": ChannelSpec("p1", "kPa"),
    }
    path = tmp_path / "map.toml"
    path.write_text(format_mapping(channels), encoding="utf-8")
    assert read_mapping(path).channels == channels
    assert path.read_text(encoding="utf-8").startswith("# Channel mapping")


def test_options_for_the_whole_file_read_back(tmp_path: Path) -> None:
    bus = BusOptions((tmp_path / "bus.dbc",), 1109.0)
    options = ReadOptions(TimeColumn("clk", "ms", simultaneous=True), bus, ('M "ist"', "nRad"))
    path = tmp_path / "map.toml"
    text = format_mapping({"gear": ChannelSpec("Gang", group="10ms")}, options)
    path.write_text(text, encoding="utf-8")
    again = read_mapping(path)
    assert again.options == options
    assert again.channels == {"gear": ChannelSpec("Gang", group="10ms")}


def test_all_faults_are_told_with_their_keys(tmp_path: Path) -> None:
    path = tmp_path / "map.toml"
    path.write_text(
        "[channels.engine_torq]\nsource = 'a'\n"
        "[channels.output_torque]\nsource = 'b'\nsign = 2\nscal = 1.0\n"
        "[channels.pressure.B2]\nunit = 'bar'\n",
        encoding="utf-8",
    )
    with pytest.raises(MappingError) as caught:
        read_mapping(path)
    text = str(caught.value)
    assert "4 faults" in text
    assert "channels.engine_torq: unknown key; did you mean 'engine_torque'?" in text
    assert "channels.output_torque.sign: the value should be 1 or -1" in text
    assert "channels.output_torque.scal: unknown key; did you mean 'scale'?" in text
    assert "channels.pressure.B2.source: this key is required and missing" in text


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(MappingError, match="cannot read the file"):
        read_mapping(tmp_path / "none.toml")


NAMES = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=20)
"""Any names of columns; lone surrogates cannot be written in UTF-8."""


def read(folder: Path, text: str) -> dict[str, ChannelSpec]:
    path = folder / "channels.toml"
    path.write_text(text, encoding="utf-8", newline="")
    return dict(read_mapping(path).channels)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(NAMES, min_size=2, max_size=2, unique=True), NAMES, NAMES)
def test_any_names_select_the_same_channels(
    tmp_path: Path, sources: list[str], element: str, unit: str
) -> None:
    channels = {
        "gear": ChannelSpec(sources[0], unit, group=sources[1]),
        f"pressure.{element}": ChannelSpec(sources[1], unit),
    }
    text = format_mapping(channels)
    tomllib.loads(text)
    assert read(tmp_path, text) == channels


def test_names_of_the_user_read_back(tmp_path: Path) -> None:
    names = {"engine_torque": ["Kanal 7", 'x"y1'], "pressure.K 1": ["p7"]}
    path = tmp_path / "channels.toml"
    path.write_text(format_mapping({}, names=names), encoding="utf-8")
    assert read_mapping(path).names == names

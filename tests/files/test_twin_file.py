# SPDX-License-Identifier: MIT
"""Mistakes of an edit by hand in `twin.toml`, each reported by its key."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.actuator.model import ActuatorModel, IdentifiedActuator
from drivetwin.channels.roles import (
    BusOptions,
    ChannelSpec,
    ReadOptions,
    RememberedChannel,
    RememberedMapping,
)
from drivetwin.errors import ResultFileError
from drivetwin.files.twin_file import load_twin, save_twin
from drivetwin.twin.build import build_twin
from drivetwin.twin.twin import Twin
from tests.report.sample import card, identification


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("transmission.gears.2.element", "B9", "no element 'B9'"),
        ("transmission.gears.2.ratio", 2.9, "i_in·i_c·i_out of B2 is 1.91"),
        ("transmission.gears.2.ratio", 0.0, "greater than 0"),
        ("transmission.elements.B2.i_c", 0.0, "must not be 0"),
        ("parameters.k_o.value", 0.0, "it must be above zero"),
        ("parameters.k_o.unit", "kN*m/rad", "read in 'N*m/rad'"),
        ("friction.B3.stribeck.v_s", 0.0, "greater than 0"),
        ("friction.B3.stribeck.mu_c", -0.1, "greater than or equal to 0"),
        ("friction.B3.mu", [-0.1, 0.1], "the range is 0 and above"),
        ("friction.B3.mu", [np.inf, 0.1], "finite"),
        ("friction.B3.mu_hi", [np.inf, 0.2], "finite"),
        ("friction.B3", {"mu_lo": 0.5}, "outside its band, mu_lo = 0.5"),
        ("friction.B3", {"mu_hi": -0.2}, "mu_hi = -0.2"),
        ("friction.B3.gain_std_m3", np.inf, "finite"),
        ("parameters.k_o.std_total", np.inf, "finite"),
        ("parameters.k_o.std_noise", -1.0, "greater than or equal to 0"),
        ("friction.B3.slip", None, "the slips do not increase"),
    ],
)
def test_a_wrong_entry_is_told_by_its_key(tmp_path: Path, key: str, value: Any, says: str) -> None:
    path = tmp_path / "twin.toml"
    save_twin(path, build_twin(identification(), card()))
    document = tomlkit.parse(path.read_text(encoding="utf-8"))
    table: Any = document
    *parents, last = key.split(".")
    for part in parents:
        table = table[part]
    if isinstance(value, dict):
        ((name, number),) = value.items()
        table[last][name] = [number] * len(table[last][name])
    else:
        table[last] = list(reversed(table[last])) if value is None else value
    path.write_text(tomlkit.dumps(document), encoding="utf-8")
    with pytest.raises(ResultFileError) as refused:
        load_twin(path)
    assert key in str(refused.value)
    assert says in str(refused.value)


@pytest.mark.parametrize(
    ("table", "old", "new", "says"),
    [
        ("parameters", "k_o", "k_oo", "unknown parameter id 'k_oo'"),
        # Numbers of a twin that earlier versions corrected by logs.
        ("parameters", "k_o", "te_lag", "unknown parameter id 'te_lag'"),
        ("parameters", "k_o", "capacity_slope.B3", "unknown parameter id 'capacity_slope.B3'"),
        ("friction", "B3", "B7", "no element 'B7'"),
        ("actuators", "B3", "B7", "no element 'B7'"),
    ],
)
def test_a_misspelt_name_is_told(tmp_path: Path, table: str, old: str, new: str, says: str) -> None:
    path = tmp_path / "twin.toml"
    save_twin(path, replace(build_twin(identification(), card()), actuators={"B3": ACTUATOR}))
    document: Any = tomlkit.parse(path.read_text(encoding="utf-8"))
    document[table][new] = document[table].pop(old)
    path.write_text(tomlkit.dumps(document), encoding="utf-8")
    with pytest.raises(ResultFileError, match=says):
        load_twin(path)


COVARIANCE = np.diag([1e-6, 1e-6, 2e-6, 1e-4, np.inf, np.inf, 1e4])
COVARIANCE[0, 1] = COVARIANCE[1, 0] = 5e-7
ACTUATOR = IdentifiedActuator(
    ActuatorModel(0.02, 0.03, 0.04, 0.9, 8e4, 0.1, 1e4), COVARIANCE, 7e3, 1200
)


def test_an_actuator_reads_back_with_its_covariance(tmp_path: Path) -> None:
    path = tmp_path / "twin.toml"
    design = IdentifiedActuator.from_design(ActuatorModel(0.01, 0.02, 0.03))
    twin = replace(build_twin(identification(), card()), actuators={"B3": ACTUATOR, "B2": design})
    save_twin(path, twin)
    read = load_twin(path).actuators
    assert set(read) == {"B2", "B3"}
    for name, one in twin.actuators.items():
        assert read[name].model == one.model
        assert np.array_equal(read[name].covariance, one.covariance)
        assert (read[name].rms, read[name].samples) == (one.rms, one.samples)


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("parameters.dead_time.value", -0.1, "dead_time must be from 0 to 0.5"),
        ("parameters.dead_time.unit", "ms", "read in 's'"),
        ("parameters.lag", {"value": 1.0, "unit": "s"}, "parameters must be"),
        ("covariance.ids", ["x"] * 5, "no parameter x"),
        ("covariance.matrix", [[1.0]], "must be 5 by 5"),
    ],
)
def test_a_wrong_entry_of_an_actuator_is_told(
    tmp_path: Path, key: str, value: Any, says: str
) -> None:
    path = tmp_path / "twin.toml"
    save_twin(path, replace(build_twin(identification(), card()), actuators={"B3": ACTUATOR}))
    document: Any = tomlkit.parse(path.read_text(encoding="utf-8"))
    table = document["actuators"]["B3"]
    *parents, last = key.split(".")
    for part in parents:
        table = table[part]
    table[last] = value
    path.write_text(tomlkit.dumps(document), encoding="utf-8")
    with pytest.raises(ResultFileError, match=says):
        load_twin(path)


NAMES = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=20)


def make_twin(mapping: RememberedMapping) -> Twin:
    return replace(build_twin(identification(), card()), mapping=mapping)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(NAMES, NAMES, NAMES)
def test_channels_of_any_name_read_back(tmp_path: Path, one: str, two: str, three: str) -> None:
    mapping = RememberedMapping(
        {
            "gear": RememberedChannel(ChannelSpec(one, two, group=three), one),
            f"pressure.{two}": RememberedChannel(ChannelSpec(three)),
        }
    )
    save_twin(tmp_path / "twin.toml", make_twin(mapping))
    assert load_twin(tmp_path / "twin.toml").mapping == mapping


def test_of_a_dbc_file_the_name_alone_counts(tmp_path: Path) -> None:
    path = tmp_path / "twin.toml"
    options = ReadOptions(bus=BusOptions((Path("/somewhere/else/bus.dbc"),)))
    save_twin(path, make_twin(RememberedMapping(options=options)))
    assert "somewhere" not in path.read_text(encoding="utf-8")
    hostile = path.read_text(encoding="utf-8").replace("bus.dbc", "../../bus.dbc")
    path.write_text(hostile, encoding="utf-8")
    assert load_twin(path).mapping.options.bus.databases == (Path("bus.dbc"),)

# SPDX-License-Identifier: MIT
"""Fixed values, priors and bounds of `drivetwin.identify` reach the fit and are recorded."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import drivetwin
from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.errors import InputError, PlausibilityError
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.findings import Code
from drivetwin.plausibility.friction import check_torque_signs
from drivetwin.vehicle.spec import PriorValue


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Any, Any]:
    """Log, card and shifts of a synthetic shift."""
    path = tmp_path_factory.mktemp("pipeline") / "bench.csv"
    write_run(path, run(load_scenario("paper_steps"), seed=1))
    card = drivetwin.load_card(path.with_suffix(".card.toml"))
    log = drivetwin.read_log(path, card)
    return log, card, drivetwin.detect_shifts(log, card)


def _identify_quickly(data: tuple[Any, Any, Any], **stated: Any) -> Any:
    with drivetwin.quick():
        return drivetwin.identify(*data, **stated)


def test_stated_values_are_used_and_recorded(data: tuple[Any, Any, Any], tmp_path: Path) -> None:
    stated: dict[str, Any] = {
        "fixed": {"eta": 0.851},
        "priors": {"J_out": (0.9, 0.01)},
        "bounds": {"k_o": (1.7e5, 1.74e5)},
    }
    result = _identify_quickly(data, **stated)
    assert result.estimates["eta"].value == 0.851
    assert result.estimates["eta"].verdict is Verdict.DESIGN
    assert result.settings["stated"] == stated
    assert any("eta = 0.851" in text and "fixed" in text for text in result.assumptions)
    assert set(result.inputs) == {"bench.csv", "bench.card.toml"}
    outside = [one for one in result.findings if one.code is Code.OUTSIDE_BOUNDS]
    value = result.estimates["k_o"].value
    assert value is not None
    assert bool(outside) is not (1.7e5 <= value <= 1.74e5)
    free = _identify_quickly(data)
    loose, tight = (one.estimates["k_o"].std_noise or 0.0 for one in (free, result))
    assert tight < loose
    assert "stated" not in free.settings
    drivetwin.save_result(tmp_path / "result.json", result)
    document = json.loads((tmp_path / "result.json").read_text("utf-8"))
    assert document["settings"]["stated"]["fixed"] == {"eta": 0.851}
    assert document["settings"]["stated"]["bounds"] == {"k_o": [1.7e5, 1.74e5]}


def test_a_result_outside_its_bounds_is_reported(data: tuple[Any, Any, Any]) -> None:
    result = _identify_quickly(data, bounds={"J_vehicle": (9000.0, 9100.0)})
    (found,) = [one for one in result.findings if one.code is Code.OUTSIDE_BOUNDS]
    assert found.subject == "J_vehicle"


def test_wrong_names_are_listed(data: tuple[Any, Any, Any]) -> None:
    with pytest.raises(InputError, match=r"2 of 2(.|\n)*J_2:(.|\n)*etaa:.*'eta'"):
        drivetwin.identify(*data, fixed={"J_2": 0.1}, priors={"etaa": (0.97, 0.01)})


def test_the_papers_method_takes_none(data: tuple[Any, Any, Any]) -> None:
    with pytest.raises(InputError, match="paper's method takes no fixed values"):
        drivetwin.identify(*data, drivetwin.Method.PAPER, fixed={"eta": 0.97})


def test_torques_that_no_gearbox_explains_are_refused(
    data: tuple[Any, Any, Any], tmp_path: Path
) -> None:
    log, card, shifts = data
    mapping = tmp_path / "map.toml"
    mapping.write_text('channels.engine_torque = { source = "EngTrq", scale = 0.1 }\n', "utf-8")
    tenth = drivetwin.read_log(log.source, card, mapping)
    with pytest.raises(PlausibilityError, match="output torque is 8") as refusal:
        drivetwin.identify(tenth, card, shifts)
    assert "scale and unit of 'EngTrq'" in refusal.value.remedy


@pytest.mark.parametrize("without", ["wheel_speed", "output_torque"])
def test_torques_that_count_against_the_acceleration_are_refused(
    data: tuple[Any, Any, Any], tmp_path: Path, without: str
) -> None:
    log, card, shifts = data
    mapping = tmp_path / "map.toml"
    roles = {"EngTrq": "engine_torque", "TrqOut": "output_torque"}
    entries = (f'channels.{roles[one]} = {{ source = "{one}", sign = -1 }}' for one in roles)
    mapping.write_text("\n".join(entries), "utf-8")
    contrary = drivetwin.read_log(log.source, card, mapping)
    kept = {role: one for role, one in contrary.channels.items() if role != without}
    with pytest.raises(PlausibilityError, match="'EngTrq' falls where the vehicle") as refusal:
        drivetwin.identify(replace(contrary, channels=kept), card, shifts)
    assert 'source = "EngTrq", sign = -1' in refusal.value.remedy


@pytest.mark.parametrize("without", ["wheel_speed", "engine_torque"])
def test_a_shaft_that_rings_after_a_shift_is_no_reversed_torque(
    data: tuple[Any, Any, Any], without: str
) -> None:
    """While it rings, its torque brakes the gearbox and accelerates the wheel."""
    log, card, _ = data
    time = np.arange(0.0, 6.0, 2e-3)
    ring = np.exp(-time) * np.sin(2.0 * np.pi * 2.2 * time)
    output, wheel = (60.0 + 1.5 * time + amount * ring for amount in (-0.6, 0.03))
    values = {
        "input_speed": card.compute_ratio("3") * output,
        "output_speed": output,
        "wheel_speed": wheel / card.final_drive.value,
        "output_torque": 2000.0 + 30.0 * np.gradient(ring, time),
    }
    channels = {
        role: replace(log[role], time=time, values=one)
        for role, one in values.items()
        if role != without
    }
    assert not list(check_torque_signs(replace(log, channels=channels), card))


@pytest.mark.parametrize(
    ("wrong", "key"),
    [
        ({"J_vehicle_range": (2.5, 6.5)}, "inertia.J_vehicle_kgm2"),
        ({"J_out": PriorValue(900.0, 90.0)}, "inertia.J_out_kgm2"),
        ({"J_prime_range": (5e3, 4e4)}, "inertia.J_prime_kgm2"),
    ],
)
def test_inertias_that_no_driveline_has_are_refused_by_their_row(
    data: tuple[Any, Any, Any], wrong: dict[str, Any], key: str
) -> None:
    log, card, shifts = data
    with pytest.raises(PlausibilityError, match="is not a usual") as refusal:
        drivetwin.identify(log, replace(card, **wrong), shifts)
    assert refusal.value.where.key == key

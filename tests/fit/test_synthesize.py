# SPDX-License-Identifier: MIT
"""Logs of model files: truth, noise, columns in the units and signs of the file."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.fit.model_file import ModelChannels, RunTable, read_model
from drivetwin.fit.network_model import NetworkModel
from drivetwin.fit.read import read_recording
from drivetwin.fit.recording import Recording, Samples
from drivetwin.fit.synthesize import ModelName, find_model, read_builtin, synthesize_log
from drivetwin.simulation.network_sensitivity import get_number


def read(folder: Path, model: NetworkModel, channels: ModelChannels) -> Recording:
    made = synthesize_log(model, channels, 0)
    (folder / "log.csv").write_text(made.log, encoding="utf-8")
    (folder / "model.toml").write_text(made.model, encoding="utf-8")
    return read_recording(folder / "log.csv", *read_model(folder / "model.toml"))[0]


@pytest.mark.parametrize("name", ModelName)
def test_the_model_file_has_the_guesses_and_the_truth_file_the_elements(
    name: ModelName, tmp_path: Path
) -> None:
    model, channels = read_builtin(name)
    made = synthesize_log(model, channels, 0)
    truth = json.loads(made.truth)["truth"]
    (tmp_path / "model.toml").write_text(made.model, encoding="utf-8")
    guessed, read = read_model(tmp_path / "model.toml")
    assert read.run is None
    assert read.sigma == {}
    assert list(guessed.unknowns) == list(truth)
    for path, unknown in guessed.unknowns.items():
        assert get_number(model.elements, path) == truth[path]
        assert get_number(guessed.elements, path) == unknown.value
        assert unknown.value != truth[path]


def test_a_channel_of_means_is_written_and_read_as_such(tmp_path: Path) -> None:
    model, channels = read_builtin(ModelName.TIP_IN)
    assert channels.run is not None
    channels = replace(channels, sigma={}, run=channels.run.model_copy(update={"rate_Hz": 500.0}))
    samples = {**channels.samples, "motor speed": Samples.MEAN}
    instants, means = (
        read(tmp_path, model, one).outputs["motor speed"]
        for one in (channels, replace(channels, samples=samples))
    )
    assert means.samples is Samples.MEAN
    middle = 0.5 * (instants.values[1:] + instants.values[:-1])
    largest = float(np.max(np.abs(np.diff(instants.values))))
    assert np.max(np.abs(means.values[1:] - middle)) < 0.1 * largest


def test_equal_seeds_give_equal_logs_and_noise_has_the_stated_size() -> None:
    model, channels = read_builtin(ModelName.TIP_IN)
    first, again, other, exact = (
        synthesize_log(model, channels, seed, noise).log
        for seed, noise in ((1, 1.0), (1, 1.0), (2, 1.0), (1, 0.0))
    )
    assert first == again != other
    noisy, plain = (
        np.loadtxt(text.splitlines(), delimiter=",", skiprows=2) for text in (first, exact)
    )
    spread = np.std(noisy - plain, axis=0)
    rpm = 60.0 / (2.0 * np.pi)
    assert spread == pytest.approx([0.0, 1.0, 0.1 * rpm, 0.03 * rpm], rel=0.05)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_column_is_written_as_its_channel_reads_it(sign: Literal[1, -1], tmp_path: Path) -> None:
    model, channels = read_builtin(ModelName.TIP_IN)
    plain = read(tmp_path, model, channels)
    spec = channels.outputs["motor speed"]
    odd = replace(spec, sign=sign, scale=0.25, offset=-40.0, unit="rad/s")
    changed = replace(channels, outputs={**channels.outputs, "motor speed": odd})
    again = read(tmp_path, model, changed)
    for name in model.outputs:
        assert again.outputs[name].values == pytest.approx(plain.outputs[name].values, rel=1e-7)


def test_a_model_without_a_manoeuvre_or_an_input_is_refused() -> None:
    model, channels = read_builtin(ModelName.TIP_IN)
    with pytest.raises(InputError, match="states no manoeuvre"):
        synthesize_log(model, replace(channels, run=None), 0)
    with pytest.raises(InputError, match=r"\[run.inputs\] has no motor torque"):
        synthesize_log(model, replace(channels, run=RunTable(end_s=1.0)), 0)


def test_a_model_is_found_by_name_or_path(tmp_path: Path) -> None:
    made = synthesize_log(*read_builtin(ModelName.TIP_IN), 0)
    (tmp_path / "own.toml").write_text(made.model, encoding="utf-8")
    assert find_model("tip_in")[0].name == find_model(str(tmp_path / "own.toml"))[0].name
    with pytest.raises(InputError):
        find_model("tip_out")

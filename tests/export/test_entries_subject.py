# SPDX-License-Identifier: MIT
"""Which shift of a twin is exported, and where its runs start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.export.entries import InputDelays, build_note, build_subject, compute_steady_start
from drivetwin.export.targets import InputKind
from tests.export.cases import (
    paper_model,
    run_core,
    write_model,
    write_source,
)
from tests.export.parameters.sample import twin


def test_the_first_shift_with_a_friction_curve_is_taken() -> None:
    subject = build_subject(twin())
    assert subject.name.endswith("2-3")
    assert [element.name for element in subject.model.elements] == ["B2", "B3"]
    assert subject.start.locked == ("B2",)
    same = build_subject(twin(), ("2", "3"))
    assert vars(same) == vars(subject)


def test_unknown_or_impossible_shifts_are_refused() -> None:
    with pytest.raises(InputError, match="has no gear '9'"):
        build_subject(twin(), ("2", "9"))
    with pytest.raises(InputError, match="held by the same element"):
        build_subject(twin(), ("2", "2"))
    bare = replace(twin(), friction={})
    with pytest.raises(InputError, match="identified friction curve"):
        build_subject(bare)


def test_modelica_holds_the_parts_and_c_names_them_as_left_out() -> None:
    plain = twin()
    play = replace(plain.parameters["eta"], id="backlash", value=0.01)
    parted = replace(plain, parameters={**plain.parameters, "backlash": play})
    subject = build_subject(parted)
    assert "ElastoBacklash" in write_model(subject)
    assert "without backlash in the output shaft" in write_source(subject)
    reduced = vars(replace(subject.reduce(), note=""))
    assert reduced == vars(replace(build_subject(plain), note=""))


def test_a_steady_start_is_steady() -> None:
    """With the engine torque that carries the load nothing accelerates."""
    model = paper_model()
    start = compute_steady_start(model, "B2", 150.0)
    torque = model.load.constant / model.i_f / 1.91 / model.eta
    time = np.linspace(0.0, 0.5, 51)
    inputs = np.column_stack([np.full(51, torque), np.full(51, 14e5), np.zeros(51)])
    run = run_core(model, start, time, inputs, InputKind.LINEAR)
    assert np.abs(run.engine_speed - 150.0).max() < 1e-9
    assert np.abs(run.shaft_torque - 2300.0).max() < 1e-6


@pytest.mark.parametrize(
    ("delays", "torque", "pressure"),
    [
        (InputDelays(0.0216), "advance the logged signal by 0.0216 s", ""),
        (InputDelays(-0.003, 0.005), "delay the logged signal by 0.003 s", "by 0.005 s"),
        (InputDelays(), "", ""),
    ],
)
def test_every_form_names_the_delay_of_the_inputs_and_its_direction(
    delays: InputDelays, torque: str, pressure: str
) -> None:
    subject = replace(build_subject(twin()), delays=delays, note=build_note(twin(), delays))
    source, model = write_source(subject), write_model(subject)
    assert torque in source
    assert pressure in source
    assert torque in model
    assert ("inputs:" in source) is bool(torque)

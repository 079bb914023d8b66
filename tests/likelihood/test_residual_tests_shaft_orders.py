# SPDX-License-Identifier: MIT
"""Residuals that repeat with the turns of a shaft."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.findings import Code, Finding
from drivetwin.fit.fit import fit_network
from drivetwin.fit.result import ModelFit
from drivetwin.fit.synthesize import ModelName
from tests.support.fits import fit_log, make_log
from tests.support.repeats import mark_repeats

NAME = "wheel speed"


def list_orders(found: ModelFit) -> list[Finding]:
    return [one for one in found.findings if one.code is Code.RESIDUAL_ORDER]


@pytest.mark.parametrize("order", mark_repeats([1, 3], [3]))
def test_an_error_once_or_thrice_per_turn_is_named_with_its_shaft(order: int) -> None:
    made = make_log(ModelName.CONVERTER_LOCK_UP)
    speed = made.recording.outputs[NAME]
    angle = np.cumsum(speed.values) * float(np.median(np.diff(speed.time)))
    wrong = replace(speed, values=speed.values * (1.0 + 0.003 * np.cos(order * angle + 0.4)))
    outputs = {**made.recording.outputs, NAME: wrong}
    (one,) = list_orders(fit_network(made.model, [replace(made.recording, outputs=outputs)]))
    assert one.numbers["order"].value == order
    assert one.names["shaft"] == NAME
    assert one.names["channel"] == NAME


@pytest.mark.parametrize("name", ModelName)
def test_a_right_model_has_none(name: ModelName) -> None:
    assert list_orders(fit_log(name)) == []

# SPDX-License-Identifier: MIT
"""Effects are checked by name and size."""

from __future__ import annotations

import pytest

from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.dyno.truth import parse_effects
from drivetwin.errors import InputError
from drivetwin.vehicle.effects import EffectId


def test_texts_become_sizes_by_effect() -> None:
    effects = parse_effects(["tyre_slip=0.004", "input_drag=1e-2"])
    assert effects == {EffectId.TYRE_SLIP: 0.004, EffectId.INPUT_DRAG: 0.01}
    for text in ("tyre_slip", "tyre_slip=", "tyre_slip=much", "=0.1"):
        with pytest.raises(InputError):
            parse_effects([text])
    with pytest.raises(InputError, match="twice"):
        parse_effects(["input_drag=0.01", "input_drag=0.02"])


@pytest.mark.parametrize(
    ("sizes", "match"),
    [
        ({"slip": 0.1, "drag": 0.1, "input_drag": 0.1}, r"'slip', 'drag'(?s:.*)tyre_slip, backl"),
        ({"slow_load": -0.1, "brake_drag": float("nan")}, r"impossible.*slow_load.*, brake_drag"),
        ({"progressive_shaft": 2.0}, "progressive_shaft below 2"),
        ({"backlash": 0.01, "progressive_shaft": 0.01}, "one shaft"),
    ],
)
def test_impossible_effects_are_refused_together(sizes: dict[str, float], match: str) -> None:
    with pytest.raises(InputError, match=match):
        run(load_scenario("paper"), effects=sizes)


@pytest.mark.parametrize("scenario", ["gearbox", "open_converter"])
def test_other_plants_are_refused(scenario: str) -> None:
    with pytest.raises(InputError, match=r"tyre_slip in scenario"):
        run(load_scenario(scenario), effects={"tyre_slip": 0.004})

# SPDX-License-Identifier: MIT
"""All built-in scenarios by name."""

from __future__ import annotations

from collections.abc import Callable

from drivetwin.dyno.car_scenarios import dual_clutch, manual
from drivetwin.dyno.converter_scenario import open_converter
from drivetwin.dyno.dual_scenarios import paper, paper_steps, throttle_steps
from drivetwin.dyno.gearbox_scenarios import gearbox, gearbox_chain
from drivetwin.dyno.kind_scenarios import input_gear, power_off_down, power_off_up, power_on_down
from drivetwin.dyno.names import ScenarioName
from drivetwin.dyno.scenario import Scenario
from drivetwin.errors import InputError, Where

__all__ = [
    "SCENARIOS",
    "gearbox",
    "gearbox_chain",
    "paper",
    "paper_steps",
    "scenario_of",
    "throttle_steps",
]

_WITH_DRUMS = {ScenarioName.GEARBOX: gearbox, ScenarioName.GEARBOX_CHAIN: gearbox_chain}

SCENARIOS: dict[ScenarioName, Callable[[], Scenario]] = {
    ScenarioName.PAPER: paper,
    ScenarioName.PAPER_STEPS: paper_steps,
    ScenarioName.THROTTLE_STEPS: throttle_steps,
    **_WITH_DRUMS,
    ScenarioName.POWER_ON_DOWN: power_on_down,
    ScenarioName.POWER_OFF_UP: power_off_up,
    ScenarioName.POWER_OFF_DOWN: power_off_down,
    ScenarioName.INPUT_GEAR: input_gear,
    ScenarioName.DUAL_CLUTCH: dual_clutch,
    ScenarioName.MANUAL: manual,
    ScenarioName.OPEN_CONVERTER: open_converter,
}


def scenario_of(name: ScenarioName, drum: float | None = None) -> Scenario:
    """Return a built-in scenario; `drum` [kg m^2] is the inertia of each brake drum.

    Raises InputError where a drum is stated for a scenario without a gearbox, or is negative.
    """
    if drum is None:
        return SCENARIOS[name]()
    if name not in _WITH_DRUMS or not drum >= 0.0:
        raise InputError(
            f"a drum of {drum:g} kg·m² in scenario {name}",
            f"state a drum of 0 or more in one of {', '.join(_WITH_DRUMS)}",
            Where(key="drum"),
        )
    return _WITH_DRUMS[name](drum)

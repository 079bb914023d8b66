# SPDX-License-Identifier: MIT
"""The virtual dynamometer: logs with known truth from a driveline, its actuators and sensors."""

from __future__ import annotations

from enum import StrEnum


class ScenarioName(StrEnum):
    """Built-in runs of the virtual dynamometer, and the log of a gearbox control."""

    PAPER = "paper"
    PAPER_STEPS = "paper_steps"
    THROTTLE_STEPS = "throttle_steps"
    GEARBOX = "gearbox"
    GEARBOX_CHAIN = "gearbox_chain"
    POWER_ON_DOWN = "power_on_down"
    POWER_OFF_UP = "power_off_up"
    POWER_OFF_DOWN = "power_off_down"
    INPUT_GEAR = "input_gear"
    DUAL_CLUTCH = "dual_clutch"
    MANUAL = "manual"
    OPEN_CONVERTER = "open_converter"
    HYDRAULICS = "hydraulics"
    CONTROLLER_LOG = "controller_log"

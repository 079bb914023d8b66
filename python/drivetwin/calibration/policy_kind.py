# SPDX-License-Identifier: MIT
"""Kinds of policies."""

from __future__ import annotations

from enum import StrEnum, auto


class PolicyKind(StrEnum):
    """Kind of a policy.

    The controller's own parameters at the clutches; free knots of the profiles; commands of a
    controller with a closed slip loop, behind the actuators.
    """

    CONTROLLER = auto()
    KNOTS = auto()
    SLIP = auto()

# SPDX-License-Identifier: MIT
"""Kinds of policies."""

from __future__ import annotations

from enum import StrEnum, auto


class PolicyKind(StrEnum):
    """Kind of a policy: the controller's own parameters, or free knots of the profiles."""

    CONTROLLER = auto()
    KNOTS = auto()

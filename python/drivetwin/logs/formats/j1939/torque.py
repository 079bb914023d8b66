# SPDX-License-Identifier: MIT
"""Percent torque of SAE J1939 in N·m, by the engine's reference torque (SPN 544, message EC1)."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from drivetwin.channels.roles import Column, Quantity
from drivetwin.channels.shiftlog import Channel, FloatArray
from drivetwin.errors import DamagedChannelError, Where
from drivetwin.logs.raw import RawChannel, Recording, Window

REFERENCE = 544
"""Engine reference torque [N·m]: what 100 % means."""

ACTUAL, FRICTION, FRACTION = 513, 514, 4154
"""Actual indicated torque, nominal friction torque, and the fraction of a percent of the first."""

PERCENT_TORQUES = frozenset((512, ACTUAL, FRICTION, 518, 2432, 2978))
"""SPNs of torques in percent of the reference torque."""

NET_TORQUE = "EngNetTorque"
"""Name of the derived channel actual minus friction torque: what the crankshaft gives [N·m]."""

UNIT = "Nm"


def derive_torque_name(name: str) -> str:
    """Name of a percent torque's channel in N·m: `ActualEngPercentTorque` -> `ActualEngTorque`."""
    return name.replace("PercentTorque", "Torque") if "PercentTorque" in name else f"{name}_Nm"


def convert_to_torque(percent: RawChannel, reference: float, note: str) -> RawChannel:
    """Return a percent torque as torque; `note` names the source of the `reference` [N·m]."""
    return RawChannel(
        derive_torque_name(percent.name),
        UNIT,
        percent.time,
        percent.values * (reference / 100.0),
        percent.group,
        (*percent.notes, note),
    )


def add_fraction(actual: RawChannel, fraction: RawChannel) -> RawChannel:
    """Add the fraction of a percent from the same message, where the message contains it."""
    part = np.zeros(actual.time.size)
    index = np.clip(np.searchsorted(fraction.time, actual.time), 0, max(0, fraction.time.size - 1))
    if fraction.time.size:
        same = fraction.time[index] == actual.time
        part[same] = fraction.values[index[same]]
    return RawChannel(
        actual.name, actual.unit, actual.time, actual.values + part, actual.group, actual.notes
    )


def compute_net_torque(actual: RawChannel, friction: RawChannel) -> RawChannel:
    """Return actual minus friction torque [N·m] at the stamps of the actual torque.

    Friction is interpolated linearly; outside its span and in its gaps there is no net torque.
    """
    values: FloatArray = actual.values - _make_channel(friction).interpolate(actual.time)
    known = np.isfinite(values)
    lost = int(known.size - known.sum())
    missing = (f"{lost} samples without friction torque left out",) if lost else ()
    notes = tuple(dict.fromkeys((*actual.notes, *friction.notes, *missing)))
    return RawChannel(NET_TORQUE, UNIT, actual.time[known], values[known], actual.group, notes)


@dataclass(frozen=True)
class NetTorque:
    """Recording of one column: the net torque from the columns of another one.

    `actual`, `friction` and `reference` are places of the columns of `source`, in %, % and N·m.
    Source: SAE J1939-71, SPN 513, 514 and 544.
    """

    source: Recording
    actual: int
    friction: int
    reference: int

    @property
    def columns(self) -> tuple[Column, ...]:
        """The one column."""
        return (Column(NET_TORQUE, UNIT),)

    @property
    def warnings(self) -> tuple[str, ...]:
        """None of its own."""
        return ()

    def load(self, _: int, window: Window | None = None) -> RawChannel:
        """Return the net torque. Raises DamagedChannelError where the reference torque changes."""
        reference = self.source.load(self.reference)
        known = np.unique(reference.values[np.isfinite(reference.values)])
        if known.size != 1:
            raise DamagedChannelError(
                f"{reference.name} has {known.size} values, one reference torque is needed",
                "state the engine torque in a channel mapping",
                Where(channel=NET_TORQUE),
            )
        note = f"in percent of {known[0]:g} N·m ({reference.name}), less friction"
        actual, friction = (
            convert_to_torque(self.source.load(place, window), float(known[0]), note)
            for place in (self.actual, self.friction)
        )
        return compute_net_torque(actual, friction)


def find_net_torque(source: Recording) -> NetTorque | None:
    """Find the net torque in the columns of a decoded bus; None without one column of each name."""
    names = [re.sub(r"[^a-z]", "", one.name.casefold()) for one in source.columns]
    if NET_TORQUE.casefold() in names:
        return None
    places = [names.index(name) for name in _DECODED if names.count(name) == 1]
    return NetTorque(source, *places) if len(places) == len(_DECODED) else None


_DECODED = ("actualengpercenttorque", "nominalfrictionpercenttorque", "engreferencetorque")
"""Names of SPN 513, 514 and 544 in the data base of the standard, spelled in small letters."""


def _make_channel(raw: RawChannel) -> Channel:
    return Channel(raw.name, Quantity.TORQUE, raw.time, raw.values, raw.name, UNIT)

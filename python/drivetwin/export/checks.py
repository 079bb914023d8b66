# SPDX-License-Identifier: MIT
"""Reject models that the exported C code cannot represent, before files are written."""

from __future__ import annotations

from drivetwin.errors import InputError
from drivetwin.export.entries import Entry, list_entries
from drivetwin.simulation.dual_clutch import DualClutch, FrictionTable, State
from drivetwin.simulation.serialize import as_json

MAX_POINTS = 64
"""DT_POINTS of `dt_model.h`."""
_NOT_ZERO = ("eta", "J_out", "J_v", "v_s", "i_in", "i_f", "i_c", "i_out")
"""Fields that must not be zero in `dt_check`; their range alone would admit zero."""


def check_exportable(model: DualClutch, start: State) -> None:
    """Raise InputError for a model that the C code cannot represent.

    The model must have two shift elements with supported friction laws, and numbers that
    `dt_check` accepts.
    """
    as_json(model)  # names every number that is not finite
    if len(model.elements) != 2:
        raise InputError(
            f"the model has {len(model.elements)} shift elements",
            "export one shift: an off-going and an on-coming element",
        )
    if len(start.locked) > 1:
        raise InputError("more than one element starts locked", "name one or none")
    for element in model.elements:
        law = element.friction
        if isinstance(law, FrictionTable) and len(law.slip) > MAX_POINTS:
            raise InputError(
                f"the friction table of {element.name} has {len(law.slip)} points",
                f"thin it out to at most {MAX_POINTS}, or fit a Stribeck law",
            )
    for entry in list_entries(model):
        _check_range(entry)


def _check_range(entry: Entry) -> None:
    field = entry.name.rpartition(".")[2]
    inside = entry.least <= entry.value <= entry.most
    if not inside or (field in _NOT_ZERO and entry.value == 0.0):
        raise InputError(
            f"{entry.name} = {entry.value:g} {entry.unit} is impossible ({entry.meaning})",
            "correct the value in the twin",
        )

# SPDX-License-Identifier: MIT
"""drivetwin: from gear-shift logs to validated driveline models.

The public names below are sufficient for a script, in the order of use. Each is imported on first
access, so that `import drivetwin` is fast.

    card = drivetwin.load_card(path)                             design data
    log = drivetwin.read_log(path, card)                         channels, SI
    found = drivetwin.find_shifts(log, card)                     shifts and their phases
    result = drivetwin.identify_shifts(log, card, found)         estimates with verdicts
    twin = drivetwin.Twin.from_identification(result, card)      the model
    run = drivetwin.validate_shift(twin, log, found.shifts[0])   simulation against measurement
    result = drivetwin.validated(result, twin, log)              result with all shifts simulated
    result = drivetwin.examined(result)                          result with ranked experiments
    drivetwin.save_result(path, result)                          result.json
    drivetwin.save_report(path, result, log)                     report.html

`DualClutch` and `simulate` are the model without a log; all errors derive from `DrivetwinError`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from drivetwin.errors import DrivetwinError
    from drivetwin.estimation.analysis.experiment_design import examined
    from drivetwin.estimation.identify import identify as identify_shifts
    from drivetwin.estimation.result.method import Method
    from drivetwin.files.result_file import save_result
    from drivetwin.logs.read import read_log
    from drivetwin.report.html import save_report
    from drivetwin.shifts.detect import find_shifts
    from drivetwin.simulation.dual_clutch import DualClutch, simulate
    from drivetwin.twin.twin import Twin
    from drivetwin.validation.simulate_log import validate as validate_shift
    from drivetwin.validation.simulate_log import validated
    from drivetwin.vehicle.card import load_card

_HOME = {
    "DrivetwinError": ("errors", "DrivetwinError"),
    "DualClutch": ("driveline", "DualClutch"),
    "Method": ("identify.method", "Method"),
    "Twin": ("twin", "Twin"),
    "examined": ("identify.experiment.suggest", "examined"),
    "find_shifts": ("shifts.find", "find_shifts"),
    "identify_shifts": ("identify.pipeline", "identify"),
    "load_card": ("vehicle.card", "load_card"),
    "read_log": ("logs.read", "read_log"),
    "save_report": ("report.html", "save_report"),
    "save_result": ("results.result_file", "save_result"),
    "simulate": ("driveline", "simulate"),
    "validate_shift": ("validate", "validate"),
    "validated": ("validate", "validated"),
}
"""Module below the package, and the name there. `identify` and `validate` are modules, so the
functions of these names are called after what they take."""

__all__ = [
    "DrivetwinError",
    "DualClutch",
    "Method",
    "Twin",
    "examined",
    "find_shifts",
    "identify_shifts",
    "load_card",
    "read_log",
    "save_report",
    "save_result",
    "simulate",
    "validate_shift",
    "validated",
]


if not TYPE_CHECKING:

    def __getattr__(name):
        """Import a public name when it is first asked for (PEP 562); typed by the imports above."""
        if name not in _HOME:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        module, original = _HOME[name]
        return getattr(import_module(f"drivetwin.{module}"), original)

# SPDX-License-Identifier: MIT
"""drivetwin: from gear-shift logs to validated driveline models.

The names below are the whole of what a script needs, in the order of use; each is imported when
it is first asked for, so that `import drivetwin` costs nothing.

    card = drivetwin.load_card(path)                              vehicle card: design data
    log = drivetwin.read_log(path, card)                          channels, SI
    log = drivetwin.read_arrays(data, card, units)                the same from memory
    shifts = drivetwin.detect_shifts(log, card)                   shifts and their phases
    model = drivetwin.identify_validated(log, card)               both of the below, validated
    result = drivetwin.identify(log, card, shifts)                estimates with verdicts
    twin = drivetwin.build_twin(result, card)                     identified model
    run = drivetwin.simulate_shift(twin, log, shifts.shifts[0])   simulation with measured inputs
    result = drivetwin.attach_validation(result, twin, log)       simulation of all shifts
    result = drivetwin.rank_experiments(result)                   recommended recordings
    drivetwin.save_result(path, result)                           result.json
    drivetwin.save_report(path, result, log)                      report.html

`DualClutch` and `simulate` are the model without a log. `Model` builds any driveline; its
`fit` takes each `Recording` (of `Signal` and `Measured`) and the `Unknown` numbers. All errors
derive from `DrivetwinError`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from drivetwin._util.display_units import register_presenter

if TYPE_CHECKING:
    from drivetwin.errors import DrivetwinError
    from drivetwin.estimation.analysis.experiment_design import rank_experiments
    from drivetwin.estimation.likelihood.mechanism import quick
    from drivetwin.estimation.result.method import Method
    from drivetwin.files.result_file import save_result
    from drivetwin.files.twin_file import load_twin, save_twin
    from drivetwin.fit.recording import Measured, Recording
    from drivetwin.fit.unknown import Unknown
    from drivetwin.logs.arrays import read_arrays
    from drivetwin.logs.read import read_log
    from drivetwin.modeling.model import Model
    from drivetwin.modeling.model_components import Plates
    from drivetwin.pipeline import identify
    from drivetwin.report.html import save_report
    from drivetwin.shifts.detect import detect_shifts
    from drivetwin.simulation.driveline_run import simulate
    from drivetwin.simulation.dual_clutch import DualClutch, Signal
    from drivetwin.twin.build import build_twin
    from drivetwin.twin.twin import Twin
    from drivetwin.validation.simulate_log import attach_validation, simulate_shift
    from drivetwin.validation.validated_model import identify_validated
    from drivetwin.vehicle.card import load_card

register_presenter(lambda: import_module("drivetwin.report.notebook"))

_HOME = {
    "DrivetwinError": ("errors", "DrivetwinError"),
    "DualClutch": ("simulation.dual_clutch", "DualClutch"),
    "Measured": ("fit.recording", "Measured"),
    "Method": ("estimation.result.method", "Method"),
    "Model": ("modeling.model", "Model"),
    "Plates": ("modeling.model_components", "Plates"),
    "Recording": ("fit.recording", "Recording"),
    "Signal": ("simulation.dual_clutch", "Signal"),
    "Twin": ("twin.twin", "Twin"),
    "Unknown": ("fit.unknown", "Unknown"),
    "build_twin": ("twin.build", "build_twin"),
    "rank_experiments": ("estimation.analysis.experiment_design", "rank_experiments"),
    "detect_shifts": ("shifts.detect", "detect_shifts"),
    "identify": ("pipeline", "identify"),
    "identify_validated": ("validation.validated_model", "identify_validated"),
    "quick": ("estimation.likelihood.mechanism", "quick"),
    "load_card": ("vehicle.card", "load_card"),
    "load_twin": ("files.twin_file", "load_twin"),
    "read_arrays": ("logs.arrays", "read_arrays"),
    "read_log": ("logs.read", "read_log"),
    "save_report": ("report.html", "save_report"),
    "save_result": ("files.result_file", "save_result"),
    "save_twin": ("files.twin_file", "save_twin"),
    "simulate": ("simulation.driveline_run", "simulate"),
    "simulate_shift": ("validation.simulate_log", "simulate_shift"),
    "attach_validation": ("validation.simulate_log", "attach_validation"),
}
"""Module below the package and the name in it, by public name."""

__all__ = [
    "DrivetwinError",
    "DualClutch",
    "Measured",
    "Method",
    "Model",
    "Plates",
    "Recording",
    "Signal",
    "Twin",
    "Unknown",
    "attach_validation",
    "build_twin",
    "detect_shifts",
    "identify",
    "identify_validated",
    "load_card",
    "load_twin",
    "quick",
    "rank_experiments",
    "read_arrays",
    "read_log",
    "save_report",
    "save_result",
    "save_twin",
    "simulate",
    "simulate_shift",
]


def __dir__() -> list[str]:
    """Return the public names, for tab completion."""
    return [*__all__]


if not TYPE_CHECKING:

    def __getattr__(name):
        """Import a public name when it is first asked for (PEP 562); typed by the imports above."""
        if name not in _HOME:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        module, original = _HOME[name]
        return getattr(import_module(f"drivetwin.{module}"), original)

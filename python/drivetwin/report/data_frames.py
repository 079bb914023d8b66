# SPDX-License-Identifier: MIT
"""Results as pandas data frames."""

from __future__ import annotations

from collections.abc import Mapping
from functools import singledispatch
from importlib import import_module
from typing import Any

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import MissingExtraError
from drivetwin.estimation.result.estimate import Estimate, EstimatesMixin, FrictionCurve
from drivetwin.estimation.result.validation import Validation
from drivetwin.twin.twin import Twin


@singledispatch
def make_frame(thing: object) -> Any:
    """Make the data frame of a result; TypeError for what has none."""
    raise TypeError(f"no data frame of a {type(thing).__name__}")


@make_frame.register
def _(log: ShiftLog) -> Any:
    """One column per role in SI, over the stamps [s] of all channels; NaN between them."""
    pandas = import_pandas()
    columns = {
        role: pandas.Series(one.values, index=one.time) for role, one in log.channels.items()
    }
    return pandas.DataFrame(columns).rename_axis("time")


@make_frame.register
def _(found: EstimatesMixin) -> Any:
    return _tabulate_estimates(found.estimates)


@make_frame.register
def _(curve: FrictionCurve) -> Any:
    """μ and its 95 % band over the slip [rad/s]."""
    columns = {"mu": curve.mu, "low": curve.mu_lo, "high": curve.mu_hi}
    frame = import_pandas().DataFrame(columns, index=curve.slip)
    return frame.rename_axis("slip")


@make_frame.register
def _(twin: Twin) -> Any:
    return _tabulate_estimates(twin.parameters)


@make_frame.register
def _(validation: Validation) -> Any:
    """Measured beside simulated signals in SI over the time [s] of the simulation."""
    pandas = import_pandas()
    columns = {}
    for name, trace in validation.all_traces.items():
        columns[f"{name}_measured"] = pandas.Series(trace.measured, index=trace.time)
        columns[f"{name}_simulated"] = pandas.Series(trace.simulated, index=trace.time)
    return pandas.DataFrame(columns).rename_axis("time")


def _tabulate_estimates(estimates: Mapping[str, Estimate]) -> Any:
    """One row per parameter: value, deviations and 95 % interval in SI, verdict and reason."""
    rows = {}
    for name, one in estimates.items():
        low, high = one.ci95_total or (None, None)
        rows[name] = {
            "value": one.value,
            "std_noise": one.std_noise,
            "std_total": one.std_total,
            "low": low,
            "high": high,
            "unit": one.unit,
            "verdict": one.verdict.value,
            "reason": one.reason,
        }
    numbers = dict.fromkeys(("value", "std_noise", "std_total", "low", "high"), "float64")
    frame = import_pandas().DataFrame.from_dict(rows, orient="index")
    return frame.astype(numbers).rename_axis("parameter")


def import_pandas() -> Any:
    """Return the module pandas. Raises MissingExtraError with the install command."""
    try:
        return import_module("pandas")
    except ImportError as fault:
        raise MissingExtraError(
            "data frames need pandas, which is not installed", "pip install pandas"
        ) from fault

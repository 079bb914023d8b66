# SPDX-License-Identifier: MIT
"""Data frames and short texts of results."""

from __future__ import annotations

import sys

import numpy as np
import pytest

import drivetwin
from drivetwin.errors import MissingExtraError
from drivetwin.twin.build import build_twin
from tests.report.sample import card, identification, log, validation


def test_parameters_become_rows() -> None:
    pytest.importorskip("pandas")
    found = identification()
    frame = found.to_frame()
    assert list(frame.index) == list(found.estimates)
    for name, one in found.estimates.items():
        row = frame.loc[name]
        assert row["verdict"] == one.verdict.value
        assert np.isnan(row["value"]) if one.value is None else row["value"] == one.value
        if one.ci95_total is not None:
            assert (row["low"], row["high"]) == one.ci95_total
    assert list(build_twin(found, card()).to_frame().columns) == list(frame.columns)


def test_channels_become_columns_over_time() -> None:
    pytest.importorskip("pandas")
    recorded = log()
    frame = recorded.to_frame()
    assert frame.index.is_monotonic_increasing
    for role, channel in recorded.channels.items():
        assert frame[role].dropna().to_numpy() == pytest.approx(channel.values)


def test_measured_and_simulated_signals_stand_side_by_side() -> None:
    pytest.importorskip("pandas")
    compared = validation()
    frame = compared.to_frame()
    for name, trace in compared.all_traces.items():
        assert frame[f"{name}_measured"].dropna().to_numpy() == pytest.approx(trace.measured)
        assert frame[f"{name}_simulated"].dropna().to_numpy() == pytest.approx(trace.simulated)


def test_without_pandas_the_error_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingExtraError, match="pandas"):
        identification().to_frame()


def test_completion_shows_the_public_names() -> None:
    assert sorted(dir(drivetwin)) == sorted(drivetwin.__all__)
    assert all(getattr(drivetwin, name) is not None for name in dir(drivetwin))

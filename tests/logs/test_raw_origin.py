# SPDX-License-Identifier: MIT
"""Stamps that count from far back: one origin, even steps, nothing done to usual ones."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest

from drivetwin.logs.read import read_log, read_raw
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.card import load_card
from tests.cli.conftest import Files, bench_files

__all__ = ["bench_files"]


def write_shifted(path: Path, log: Path, start: str, unit: str, scale: int) -> Path:
    """Write a copy of a log whose stamps count from `start` [s], in a unit of 1/scale s."""
    names, units, *rows = log.read_text().splitlines()
    lines = [names, units.replace("s,", f"{unit},", 1)]
    for row in rows:
        stamp, rest = row.split(",", 1)
        lines.append(f"{(Decimal(start) + Decimal(stamp)) * scale},{rest}")
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(
    ("start", "unit", "scale"),
    [
        ("-1000000", "s", 1), ("100001", "ms", 1000), ("1763866345", "ns", 10**9),
    ],
)  # fmt: skip
def test_a_log_with_a_distant_start_gives_the_shifts_of_the_log_from_zero(
    bench_files: Files, tmp_path: Path, start: str, unit: str, scale: int
) -> None:
    card = load_card(bench_files.card)
    plain = read_log(bench_files.log, card)
    path = write_shifted(tmp_path / "far.csv", bench_files.log, start, unit, scale)
    far = read_log(path, card)
    for role, channel in plain.channels.items():
        assert far[role].time == pytest.approx(channel.time, abs=1e-9)
    texts = [finding.text for finding in far.findings]
    assert f"time counts from the first stamp, {float(start):.15g} s." in texts
    (one,), (other,) = (detect_shifts(log, card).shifts for log in (plain, far))
    assert other.torque_phase == pytest.approx(one.torque_phase, abs=1e-6)
    assert other.lockup_time == pytest.approx(one.lockup_time, abs=1e-6)


def test_channels_with_own_stamps_keep_their_relative_time(tmp_path: Path) -> None:
    """Two time columns, the later one by 0.25 s."""
    rows = (f"{1.7e9 + k / 100:.2f},{k},{1.7e9 + 0.25 + k / 50:.2f},{k % 7}" for k in range(100))
    log = tmp_path / "log.csv"
    log.write_text("\n".join(["t1 [s],n_in [rpm],t2 [s],n_out [rpm]", *rows]) + "\n")
    first, second = read_raw(log).channels
    assert first.time == pytest.approx(np.arange(100) / 100, abs=1e-12)
    assert second.time == pytest.approx(0.25 + np.arange(100) / 50, abs=1e-12)

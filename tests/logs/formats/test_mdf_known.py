# SPDX-License-Identifier: MIT
"""MDF 4 files with known samples: each one is read right or refused, by both readers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.channels.read_options import ReadOptions
from drivetwin.errors import DamagedChannelError
from drivetwin.logs.formats.mdf import open_mdf
from drivetwin.logs.formats.mdf_plain import open_plain
from drivetwin.logs.raw import Recording
from tests.support.mdf_files import CONVERSIONS, Known, write_random_mdf

DAILY, ALL = 12, 386


def check(recording: Recording, known: dict[str, Known]) -> set[str]:
    """Compare all samples of a file; return the kinds of the channels that were right."""
    found = {column.name: index for index, column in enumerate(recording.columns)}
    assert found.keys() == known.keys()
    right = set()
    for name, truth in known.items():
        if not truth.valid.any():
            if truth.time.size:
                with pytest.raises(DamagedChannelError, match=r"left out|invalid"):
                    recording.load(found[name])
            continue
        channel = recording.load(found[name])
        np.testing.assert_allclose(channel.time, truth.time[truth.valid], rtol=1e-15)
        # Sums of three terms cancel: their rounding counts against the largest value.
        scale = np.nanmax(np.abs(truth.values), initial=1e-300)
        np.testing.assert_allclose(
            channel.values, truth.values[truth.valid], rtol=1e-12, atol=1e-14 * scale,
            err_msg=f"{name}: {truth.kind}",
        )  # fmt: skip
        right.add(truth.kind.partition(" ")[0])
    return right


def read_files(folder: Path, seeds: range) -> tuple[set[str], int]:
    """Read a file of each seed by asammdf and, if it is plain, without; count the plain ones."""
    right: set[str] = set()
    plain = 0
    for seed in seeds:
        path = folder / f"{seed}.mf4"
        known = write_random_mdf(path, seed)
        with open_mdf(path, ReadOptions()) as recording:
            right |= check(recording, known)
        if (opened := open_plain(path, ReadOptions())) is not None:
            plain += 1
            with opened as recording:
                check(recording, known)
        path.unlink()
    return right, plain


def test_known_samples_are_read(tmp_path: Path) -> None:
    right, _ = read_files(tmp_path, range(DAILY))
    assert right == set(CONVERSIONS)


@pytest.mark.exhaustive
@pytest.mark.timeout(1800)
def test_many_files_of_known_samples_are_read(tmp_path: Path) -> None:
    right, plain = read_files(tmp_path, range(DAILY, ALL))
    assert right == set(CONVERSIONS)
    assert plain

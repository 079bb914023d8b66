# SPDX-License-Identifier: MIT
"""Reading in a child: what is opened, faults of the mapping kept, bombs that do not reach us."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.channels.read_options import ChannelSpec
from drivetwin.errors import InputError
from drivetwin.logs.formats.guarded import BASE_TIME
from drivetwin.workbench.jobs import call
from drivetwin.workbench.mapping import Corrections
from drivetwin.workbench.sandboxed_parse import (
    Opened,
    Request,
    open_log,
)
from tests.workbench.bad_files import hdf5_bomb, mat_bomb
from tests.workbench.conftest import CARD, LOG


def _open(place: Path, scratch: Path, **changes: object) -> Opened:
    request = Request(place / LOG, LOG, place / CARD, CARD, **changes)  # type: ignore[arg-type]
    found: Opened = call(open_log, request, scratch / "mapping.toml", limit=BASE_TIME)
    return found


def test_a_log_comes_with_columns_and_shifts(place: Path, tmp_path: Path) -> None:
    opened = _open(place, tmp_path)
    assert opened.log is not None
    assert opened.found is not None
    assert opened.log.source == LOG
    assert len(opened.found.shifts) == 1
    assert set(opened.survey.mapping) == set(opened.log.channels)


def test_a_wrong_mapping_is_a_fault_with_the_columns_at_hand(place: Path, tmp_path: Path) -> None:
    wrong = {"output_speed": ChannelSpec("absent")}
    opened = _open(place, tmp_path, corrections=Corrections(wrong))
    assert opened.log is None
    assert "absent" in opened.fault
    assert opened.survey.columns


def test_a_corrected_unit_is_what_the_log_is_read_in(place: Path, tmp_path: Path) -> None:
    plain, opened = (
        _open(place, tmp_path, corrections=Corrections(channels))
        for channels in ({}, {"output_torque": ChannelSpec(_column(place), unit="lbf*ft")})
    )
    assert plain.log is not None
    assert opened.log is not None
    ratio = opened.log["output_torque"].values / plain.log["output_torque"].values
    assert ratio == pytest.approx(0.3048 * 0.45359237 * 9.80665)


def test_a_corrected_unit_that_cannot_be_is_a_fault(place: Path, tmp_path: Path) -> None:
    wrong = {"output_torque": ChannelSpec(_column(place), unit="kNm")}
    opened = _open(place, tmp_path, corrections=Corrections(wrong))
    assert opened.log is None
    assert "largest torque" in opened.fault


def _column(place: Path) -> str:
    names = (place / LOG).read_text().splitlines()[0].split(",")
    return next(name for name in names if "out" in name.lower() and "t" in name.lower()[:2])


@pytest.mark.parametrize("bomb", [mat_bomb, hdf5_bomb])
def test_a_file_that_expands_beyond_memory_is_refused(
    place: Path, tmp_path: Path, bomb: object
) -> None:
    path = tmp_path / "bomb.mat"
    path.write_bytes(bomb())  # type: ignore[operator]
    request = Request(path, "bomb.mat", place / CARD, CARD)
    with pytest.raises(InputError) as caught:
        call(open_log, request, tmp_path / "mapping.toml", limit=BASE_TIME)
    assert str(caught.value)


def test_faults_of_an_upload_call_it_by_its_label(place: Path, tmp_path: Path) -> None:
    path = tmp_path / "a1b2c3"
    path.write_text("name = 3\n")
    for request, label in (
        (Request(place / LOG, LOG, path, "card.toml"), "card.toml"),
        (Request(path, "log.csv", place / CARD, CARD), "log.csv"),
    ):
        with pytest.raises(InputError) as caught:
            call(open_log, request, tmp_path / "mapping.toml", limit=BASE_TIME)
        assert label in str(caught.value)
        assert "a1b2c3" not in str(caught.value)

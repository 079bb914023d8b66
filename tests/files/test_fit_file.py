# SPDX-License-Identifier: MIT
"""`fit.json`: content, round trip, refusal of what is not of its schema."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from drivetwin.files.fit_file import build_fit_file
from drivetwin.findings import Code, report
from drivetwin.fit.fit import predict
from drivetwin.fit.synthesize import ModelName
from tests.support.fits import fit_log, make_log


def build() -> Any:
    found = fit_log(ModelName.ENGINE_START)
    held = predict(found, [make_log(ModelName.ENGINE_START, 1).recording])
    remarks = (report(Code.RECORDING, text="a remark"),)
    return build_fit_file(found, ["k0.csv"], {"other.csv": held[0]}, remarks)


def test_the_file_has_the_numbers_of_the_fit() -> None:
    found, file = fit_log(ModelName.ENGINE_START), build()
    assert file.model == "K0 engagement"
    assert file.status is found.status
    assert (file.chi2, file.cost) == (found.chi2, found.cost)
    assert list(file.unknowns) == list(found.values)
    for name, one in file.unknowns.items():
        assert one.minimum == found.values[name]
        assert one.interval == pytest.approx(found.intervals[name])
        assert file.correlation[name][name] == pytest.approx(1.0)
    assert list(file.fixed) == [one.number.name for one in found.moved]
    gain = file.fixed["K0.gain"]
    assert gain.stated == 0.01
    assert gain.tolerance == pytest.approx(5e-4)
    assert gain.source == "usual"
    assert gain.widens.startswith("K0.friction.mu")
    assert len(file.starts) == len(found.starts)
    assert file.findings[0].code == Code.RECORDING
    assert [one.log for one in file.held_out] == ["other.csv"]


def test_the_text_reads_back_equal_and_is_the_same_each_time() -> None:
    text = build().to_json()
    assert text == build().to_json()
    assert type(build()).model_validate_json(text) == build()
    assert "NaN" not in text


def test_an_interval_that_is_open_on_a_side_is_stored_as_none() -> None:
    found = fit_log(ModelName.ENGINE_START)
    wide = replace(found, intervals={**found.intervals, "shaft.damping": (0.1, np.inf)})
    file = build_fit_file(wide, ["k0.csv"], {})
    assert file.unknowns["shaft.damping"].interval is None
    assert type(file).model_validate_json(file.to_json()) == file


def test_a_wrong_key_or_type_is_refused() -> None:
    content = json.loads(build().to_json())
    with pytest.raises(ValidationError, match="nonsense"):
        type(build()).model_validate({**content, "nonsense": 1})
    with pytest.raises(ValidationError, match="chi2"):
        type(build()).model_validate({**content, "chi2": "small"})

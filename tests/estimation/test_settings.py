# SPDX-License-Identifier: MIT
"""Settings that a result records: plain numbers of every stage, each described with its unit."""

from __future__ import annotations

import json

from drivetwin._util.arrays import to_plain_values
from drivetwin.estimation.settings import collect_settings


def test_each_stage_is_recorded_in_plain_values() -> None:
    found = collect_settings()
    assert json.loads(json.dumps(to_plain_values(found), allow_nan=False)).keys() == found.keys()
    assert found["verdict"]["prior_share"] == 0.8
    assert {"momentum", "guess", "record"} <= found.keys()

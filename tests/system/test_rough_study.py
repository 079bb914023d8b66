# SPDX-License-Identifier: MIT
"""Made cards, mismatches and counts of the studies of rough cards and of validity."""

from __future__ import annotations

import json
import tomllib
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.estimation.rough import (
    judge_friction,
    list_tables,
    make_vehicle,
    plan_vehicle,
    run_study,
)
from benchmarks.estimation.rough_card import draw_ratio_text, write_card
from benchmarks.estimation.rough_log import RoughLog
from benchmarks.estimation.unlisted import UNLISTED, UnlistedId, add_unlisted
from benchmarks.estimation.validity import (
    StudyLog,
    make_log,
    make_sized_log,
    study_log,
)
from benchmarks.estimation.validity import list_tables as list_validity
from benchmarks.estimation.vehicles import draw_vehicle
from benchmarks.rows import append_row, read_rows
from drivetwin.estimation.result.estimate import FrictionCurve
from drivetwin.vehicle.effects import EffectId
from tools.result_blocks.accuracy import (
    FAR,
    format_share,
    write_causes,
    write_far,
    write_groups,
    write_statuses,
)

BARE = 4
"""Seed of a vehicle that obeys the model and whose card states no gain with an error."""


def _draw_errors(factor: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Errors of 4000 ratios in units of their last digit."""
    errors = []
    rng = np.random.default_rng(1)
    for value in rng.uniform(1.2, 5.8, 4000).tolist():
        text = draw_ratio_text(rng, value, factor)
        digits = len(text.partition(".")[2])
        assert 2 <= digits <= 5
        errors.append((float(text) - value) * 10.0**digits)
    return np.array(errors)


def test_errors_of_ratios_are_those_of_rounding_and_cutting() -> None:
    """Rounding has a mean square of 1/12 of a unit, cutting of 1/3; half are cut."""
    usual, twice = _draw_errors(1.0), _draw_errors(2.0)
    assert usual.min() > -1.001
    assert usual.max() < 0.501
    assert np.mean(usual**2) == pytest.approx((1.0 / 12.0 + 1.0 / 3.0) / 2.0, rel=0.06)
    # Uniform within two units to either side (4/3), and then rounded (1/12).
    assert np.mean(twice**2) == pytest.approx(4.0 / 3.0 + 1.0 / 12.0, rel=0.06)


def _read_number(entry: object) -> tuple[float, float]:
    """Value and standard deviation of an entry, 0 for a bare number."""
    if isinstance(entry, dict):
        return float(entry["value"]), float(entry["std"])
    assert isinstance(entry, float)
    return entry, 0.0


def test_cards_are_valid_toml_and_their_errors_have_the_stated_sizes() -> None:
    bare: list[float] = []
    stated: list[float] = []
    gains: list[float] = []
    for seed in range(300):
        scenario = draw_vehicle(seed).scenario
        text = write_card(seed, scenario, tolerances=seed % 2 == 0)
        assert text == write_card(seed, scenario, tolerances=seed % 2 == 0)
        card = tomllib.loads(text)
        assert ("sensors" in card) == (seed % 2 == 0)
        assert [one["name"] for one in card["gears"]] == ["2", "3"]
        for element in scenario.model.elements:
            entry = card["elements"][element.name]
            value, std = _read_number(entry["P0_bar"])
            (stated if std else bare).append((1e5 * value - element.P0) / (1e5 * std or 1e4))
            value, std = _read_number(entry["gain_m3"])
            if std:
                gains.append((value - element.gain) / std)
            else:
                assert value == pytest.approx(element.gain, rel=5e-4)
    for errors in (bare, stated, gains):
        assert len(errors) > 100
        # The standard error of a root mean square of 100 values is 7 %.
        assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(1.0, abs=0.25)


def test_card_is_read_with_the_digits_of_its_text() -> None:
    made, _ = make_vehicle(BARE, plan_vehicle(BARE))
    scenario = made.recorded.scenario
    text = tomllib.loads(write_card(BARE, scenario, tolerances=bool(made.card.sensors)))
    ratios = [one.ratio.value for one in made.card.gears]
    assert ratios == [one["ratio"] for one in text["gears"]]
    exact = [scenario.get_ratio(one.element) for one in scenario.gears]
    assert ratios != exact
    assert ratios == pytest.approx(exact, abs=0.01)


def test_a_short_oscillation_between_slow_samples_is_identified() -> None:
    """16.6 Hz in speeds of 50 Hz: the first frequency is 9.5 Hz, from which no search came back."""
    one = study_log(4001, None)
    assert len(one.identified) >= 10
    assert max(map(abs, one.identified.values())) < FAR


@pytest.mark.parametrize("which", UnlistedId)
def test_unlisted_mismatch_changes_its_own_channels_alone(which: UnlistedId) -> None:
    recorded = make_vehicle(BARE, plan_vehicle(BARE))[0].recorded
    wrong = add_unlisted(recorded, which, 3.0 * UNLISTED[which].std)
    pairs = zip(recorded.channels, wrong.channels, strict=True)
    changed = {a.role for a, b in pairs if not np.array_equal(a.values, b.values)}
    pressures = {"pressure.B2", "pressure.B3"}
    expected = {
        UnlistedId.PRESSURE_HYSTERESIS: pressures,
        UnlistedId.PRESSURE_CURVATURE: pressures,
        UnlistedId.PRESSURE_STEP: pressures,
        UnlistedId.FIRING_ORDER: {"input_speed"},
        UnlistedId.CLOCK_DRIFT: {"output_torque"},
    }
    assert changed == expected[which]
    assert wrong.truth is recorded.truth


@pytest.mark.parametrize("effect", [EffectId.BACKLASH, EffectId.INPUT_SHAFT_MODE])
def test_log_without_its_effect_has_the_same_inputs_and_noise(effect: EffectId) -> None:
    (made, _), plain = make_log(2, effect, 1.0), make_sized_log(2, effect, 0.0)
    role = "engine_torque"
    assert np.array_equal(made.log[role].values, plain.log[role].values)
    role = "output_torque"
    assert not np.array_equal(made.log[role].values, plain.log[role].values)


def test_friction_is_judged_for_a_bare_gain_of_the_card() -> None:
    """A bare gain has a standard deviation, so that the true curve is the vehicle's own."""
    made, _ = make_vehicle(BARE, plan_vehicle(BARE))
    assert made.card.elements["B3"].gain.std > 0.0
    slip = np.linspace(5.0, 80.0, 60)
    mu = made.recorded.truth.friction["B3"].evaluate(slip)
    none = np.empty(0)
    curve = FrictionCurve(slip, 1.02 * mu, 0.99 * mu, 1.05 * mu, none, none, None, "likelihood")
    errors = judge_friction(SimpleNamespace(friction={"B3": curve}), made)  # type: ignore[arg-type]
    assert list(errors) == ["B3 at 10 %", "B3 at 50 %", "B3 at 90 %"]
    # 2 % off, the lower half of the band is 3 % wide. Curves are interpolated between 60 slips.
    assert [*errors.values()] == pytest.approx([1.96 * 2.0 / 3.0] * 3, abs=2e-3)


def _make_log(seed: int, errors: dict[str, float], **other: Any) -> RoughLog:
    return RoughLog(seed, "obeying", "", 0.0, "valid", 13, errors, **other)


def test_standard_error_is_that_of_logs_and_not_of_values() -> None:
    """Of n logs with ten values each that are inside or outside together, the standard deviation
    of the share is √(p(1 - p)/n), and not that of 10 n values."""
    pairs = [(10 * (k % 4 != 0), 10) for k in range(100)]
    assert format_share(pairs) == "750 of 1000, 75.0 ± 4.3 %"
    assert format_share([(9, 10)] * 100) == "900 of 1000, 90.0 ± 0.0 %"
    assert format_share([(0, 0)]) == "–"


def _to_raw(tables: dict[str, list[dict[str, Any]]]) -> dict[str, Any]:
    return {
        name: {"columns": list(rows[0]), "rows": [list(one.values()) for one in rows]}
        for name, rows in tables.items()
    }


def test_log_without_result_keeps_nothing() -> None:
    logs = [
        _make_log(1, {f"p{k}": 4.5 * (k == 3) for k in range(11)}),
        RoughLog(2, "obeying", "", 0.0, "no result", 13, failure="2 faults\n  - gain_m3"),
    ]
    raw = _to_raw(list_tables(logs))
    row = "| obeying | 2 | 1 | 10 of 11, 90.9 ± 0.0 % | 1 | – | 11 of 26, 42.3 ± 29.9 % |"
    assert row in write_groups(raw)
    assert "| 1 | obeying |  | valid | p3 +4.5 |" in write_far(raw)
    assert "valid 1, no result 1.\nSeed 2: 2 faults" in write_statuses(raw)


def test_finished_seeds_are_read_and_not_run_again(tmp_path: Path) -> None:
    rows = tmp_path / "rough.jsonl"
    logs = [_make_log(seed, {"eta": 0.1 * seed}) for seed in (3, 4)]
    lines = [json.dumps(asdict(one)) for one in logs]
    rows.write_text("\n".join([*lines, lines[0][:30]]), encoding="utf-8")
    append_row(rows, {"seed": 5})
    assert [one["seed"] for one in read_rows(rows)] == [3, 4, 5]
    rows.write_text("\n".join(lines), encoding="utf-8")
    assert run_study([3, 4], rows, 1) == logs
    assert read_rows(tmp_path / "none.jsonl") == []


def test_validity_counts_causes_and_effects_by_kind() -> None:
    errors = {f"p{k}": 0.0 for k in range(8)}
    right, missed, quiet = ("tyre_slip",), ("backlash",), ()
    logs = [
        StudyLog(
            1, "tyre_slip", 1.0, errors, {}, right, 9.0, True, "", 10, 3.0, 20.0, 1.0, "valid"
        ),
        StudyLog(
            2, "tyre_slip", 1.0, errors, {}, missed, 9.0, True, "", 10, 3.0, 4.0, 1.3, "valid"
        ),
        StudyLog(
            3, "tyre_slip", 1.0, errors, {}, quiet, 0.0, False, "", 10, 1.9, 20.0, 1.5, "valid"
        ),
        StudyLog(4, "tyre_slip", 0.0, {}, {}, (), 0.0, False, "refused", 10),
        StudyLog(5, "", 0.0, errors, {}, (), 0.0, False, "", 10, None, None, 1.0, "valid"),
        StudyLog(6, "tyre_slip+backlash", 0.0, errors, {}, right, 9.0, False, "", 10),
    ]
    raw = _to_raw(list_validity(logs))
    lines = write_causes(raw).splitlines()[2:]
    assert [line.split("|")[2].strip() for line in lines] == [
        *("1 of 2", "1 of 2", "1 of 1", "0 of 1", "1 of 6"),
    ]
    kept = {
        line.split("|")[1].strip(): line.split("|")[7] for line in write_groups(raw).splitlines()
    }
    assert kept["tyre_slip"].startswith(" 24 of 40, 60.0 ")
    assert kept["none"].startswith(" 8 of 10")
    assert kept["two effects"].startswith(" 8 of 10")

# SPDX-License-Identifier: MIT
"""Corrections of a twin by logs: what they find, and logs that they refuse."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetwin.calibration.learn import Correction, correct_twin
from drivetwin.calibration.spread import OilFriction, Spread
from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel
from drivetwin.errors import IdentificationError
from drivetwin.estimation.identification import OIL_TEMPERATURE
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.logs.read import read_log
from drivetwin.simulation.dual_clutch import DualClutch
from drivetwin.twin.twin import Twin
from tests.calibration.bench import write_bench_log
from tests.calibration.twins import STD, build_model, make_twin

STRONG, TORQUE = 1.05, 1.02
"""Friction of the on-coming clutch and η of the vehicle, over those of the twin."""


def correct(twin: Twin, folder: Path, model: DualClutch, seeds: tuple[int, ...]) -> Correction:
    """Correct the twin by logs of a driveline on the bench."""
    logs = []
    for seed in seeds:
        path = folder / f"bench-{seed}.csv"
        write_bench_log(path, model, seed)
        logs.append(read_log(path, twin.build_card()))
    return correct_twin(twin, logs, ("2", "3"), Spread())


def make_strong(twin: Twin, gain: float, **changed: Any) -> DualClutch:
    """Change the driveline of the twin, with another gain of the on-coming clutch."""
    model = build_model(twin)
    old, new = model.elements
    return replace(model, elements=(old, replace(new, gain=gain * new.gain)), **changed)


@pytest.fixture(scope="module")
def twin() -> Twin:
    return make_twin()


@pytest.fixture(scope="module")
def found(twin: Twin, tmp_path_factory: pytest.TempPathFactory) -> Any:
    model = build_model(twin)
    other = {"eta": TORQUE * model.eta, "J1": model.J1 / TORQUE}
    return correct(
        twin, tmp_path_factory.mktemp("bench"), make_strong(twin, STRONG, **other), (1, 2)
    )


def test_a_correction_finds_the_friction_and_the_engine_torque_of_the_vehicle(
    found: Correction,
) -> None:
    by_id = {one.id: one for one in found.values}
    for name, ratio in (("mu.B3", STRONG), ("eta", TORQUE)):
        one = by_id[name]
        assert abs(one.after - ratio * one.before) < 4.0 * one.after_std
        assert one.after_std < 0.5 * one.before_std
        assert one.after == pytest.approx(ratio * one.before, rel=2e-3)
    before, after = found.rms["output_torque"]
    assert after < 0.25 * before
    assert after < 1.3 * 15.0  # the noise of the sensor
    assert len(found.fits) == 2


def test_the_corrected_twin_has_narrower_intervals_and_only_simulated_values(
    twin: Twin, found: Correction
) -> None:
    eta = found.twin.parameters["eta"]
    assert eta.std_total is not None
    assert eta.std_total < 0.5 * STD * twin.get_value("eta", 0.0)
    assert found.twin.covariance is not None
    assert np.linalg.eigvalsh(found.twin.covariance)[0] >= -1e-9
    engine = [
        found.twin.get_value(f"J_prime_{gear}", 0.0)
        - found.twin.get_value("J_out", 0.0) / found.twin.get_gear(gear).ratio ** 2
        for gear in "23"
    ]
    assert engine[0] == pytest.approx(engine[1], rel=1e-3)


def test_a_final_drive_that_the_card_has_exactly_contradicts_no_log(
    twin: Twin, tmp_path: Path
) -> None:
    """Its standard deviation is that of rounding, and so is the change by a log."""
    assert twin.covariance is not None
    ratio = twin.final_drive
    exact = Estimate("i_f", ratio * (1.0 + 1e-14), 1e-16 * ratio, Verdict.DESIGN, "card")
    row = np.zeros((1, len(twin.covariance_ids)))
    covariance = np.block([[twin.covariance, row.T], [row, np.array([[(1e-16 * ratio) ** 2]])]])
    stated = replace(
        twin,
        parameters={**twin.parameters, "i_f": exact},
        covariance_ids=(*twin.covariance_ids, "i_f"),
        covariance=covariance,
    )
    found = correct(stated, tmp_path, build_model(twin), (1,))
    assert "eta" in {one.id for one in found.values}


def test_a_log_of_another_vehicle_is_refused_with_the_value_that_contradicts(
    twin: Twin, tmp_path: Path
) -> None:
    other = make_strong(twin, 1.4, k_o=0.7 * build_model(twin).k_o)
    with pytest.raises(IdentificationError, match="contradicts the twin: k_o") as caught:
        correct(twin, tmp_path, other, (1,))
    assert caught.value.where is not None
    assert str(caught.value.where.file).endswith("bench-1.csv")
    assert "identify it again" in caught.value.remedy


def test_pressures_that_act_late_are_found_and_move_no_other_value(
    twin: Twin, tmp_path: Path
) -> None:
    """Stamps that are early by 4 ms are pressures that act as late."""
    path, late = tmp_path / "bench.csv", 4e-3
    write_bench_log(path, build_model(twin))
    log = read_log(path, twin.build_card())
    early = {
        role: replace(one, time=one.time - late) if role.startswith("pressure.") else one
        for role, one in log.channels.items()
    }
    found = correct_twin(twin, [replace(log, channels=early)], ("2", "3"), Spread())
    delay = found.twin.parameters["p_delay"]
    assert delay.value is not None
    assert delay.std_total is not None
    assert abs(delay.value - late) < 3.0 * delay.std_total < late
    by_id = {one.id: one for one in found.values}
    for name in ("eta", "J_vehicle", "k_o", "mu.B3"):
        assert abs(by_id[name].after - by_id[name].before) < 3.0 * by_id[name].after_std


def test_logs_at_several_oil_temperatures_find_the_slope_of_the_friction(
    twin: Twin, tmp_path: Path
) -> None:
    """The twin is of 80 °C; the unit is 3 % stronger, and its μ falls by 0.1 % per kelvin."""
    truth, at = -1e-3, 353.0
    cold = replace(twin, validity={**twin.validity, OIL_TEMPERATURE: (at, at)})
    logs = []
    for change in (-40.0, 0.0, 30.0):
        path, friction = tmp_path / f"{change:g}.csv", 1.0 + truth * change
        write_bench_log(path, make_strong(twin, 1.03 * friction))
        log = read_log(path, twin.build_card())
        oil = Channel(
            "temperature.oil",
            Quantity.TEMPERATURE,
            np.array([0.0, 4.0]),
            np.full(2, at + change),
            "Oil",
            "K",
        )
        logs.append(replace(log, channels={**log.channels, "temperature.oil": oil}))
    found = correct_twin(cold, logs, ("2", "3"), Spread())
    slope = next(one for one in found.values if one.id == "mu_over_oil")
    assert slope.after_std < 0.25 * slope.before_std
    assert abs(slope.after - truth) < 3.0 * slope.after_std
    strong = next(one for one in found.values if one.id == "mu.B3")
    assert strong.after == pytest.approx(1.03 * strong.before, rel=3e-3)
    assert found.oil.log_temperature == at + 30.0
    before, after = found.rms["output_torque"]
    assert after < 0.05 * before
    constant = correct_twin(cold, logs[1:2], ("2", "3"), Spread())
    assert constant.oil.std == pytest.approx(OilFriction().std)

# SPDX-License-Identifier: MIT
"""From known parameters to a log and back: what goes in comes out."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import drivetwin
from drivetwin.dyno import ScenarioName, dyno
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import FrictionCurve, Verdict
from drivetwin.estimation.result.method import Method
from drivetwin.simulation.dual_clutch import FrictionTable, Stribeck
from tests.support.repeats import mark_repeats
from tests.support.synth import synthesize

MODULATED = (ScenarioName.PAPER_STEPS, ScenarioName.THROTTLE_STEPS)
WITHIN_HALF_A_PERCENT = (
    "eta", "J_prime_2", "J_prime_3", "J_vehicle", "Tv_over_if", "k_o", "c_o", "f_d_3", "zeta_3",
)  # fmt: skip


def _identified(
    folder: Path, scenario: ScenarioName, method: Method, noise: float
) -> tuple[Identification, Any]:
    """Identify a run by the card of its scenario; the card of the paper's method has exact P0."""
    log, card, _ = synthesize(folder / "run.csv", scenario, 11, noise)
    if method is Method.PAPER:
        exact = re.sub(
            r"P0_bar = ([\d.]+)", r"P0_bar = { value = \1, std = 0.0 }", card.read_text()
        )
        card.write_text(exact)
    truth = dyno.run(load_scenario(scenario), noise=0.0).truth
    return _identify(log, card, method), truth


def _identify(path: Path, card_path: Path, method: Method) -> Identification:
    card = drivetwin.load_card(card_path)
    log = drivetwin.read_log(path, card)
    with drivetwin.quick():
        return drivetwin.identify(log, card, drivetwin.detect_shifts(log, card), method)


def _friction_error(curve: FrictionCurve, law: Stribeck | FrictionTable) -> float:
    """Largest relative error of μ over the slip range seen."""
    return float(np.abs(curve.mu / law.evaluate(curve.slip) - 1.0).max())


@pytest.fixture(scope="module", params=mark_repeats(MODULATED, MODULATED[:1]))
def noise_free(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Identification, Any]:
    return _identified(tmp_path_factory.mktemp("run"), request.param, Method.LIKELIHOOD, 0.0)


def test_noise_free_every_parameter_returns_within_half_a_percent(
    noise_free: tuple[Identification, Any],
) -> None:
    """Friction within one percent, the delay of the engine torque within half a millisecond."""
    found, truth = noise_free
    for name in WITHIN_HALF_A_PERCENT:
        assert found.estimates[name].value == pytest.approx(truth.parameters[name], rel=5e-3), name
    curve, delay = found.friction["B3"], truth.parameters["te_delay"]
    assert curve.slip[-1] - curve.slip[0] > 30.0
    assert _friction_error(curve, truth.friction["B3"]) < 0.01
    assert found.estimates["te_delay"].value == pytest.approx(delay, abs=5e-4)


@pytest.mark.exhaustive
def test_paper_method_returns_the_grid_points_of_the_truth(tmp_path: Path) -> None:
    found, truth = _identified(tmp_path, ScenarioName.THROTTLE_STEPS, Method.PAPER, 0.0)
    estimates = found.estimates
    assert estimates["eta"].value == pytest.approx(0.85, abs=1e-12)
    assert estimates["Tv_over_if"].value == pytest.approx(2300.0, abs=1e-9)
    assert estimates["J_prime_2"].value == pytest.approx(truth.parameters["J_prime_2"], rel=0.01)


@pytest.mark.parametrize("scenario", MODULATED)
def test_with_noise_the_intervals_hold_the_truth(scenario: ScenarioName, tmp_path: Path) -> None:
    """Within three standard deviations each: chance alone fails this in one run of fifty."""
    found, truth = _identified(tmp_path, scenario, Method.LIKELIHOOD, 1.0)
    for key in ("eta", "J_prime_2", "J_vehicle", "Tv_over_if", "k_o", "f_d_3"):
        estimate = found.estimates[key]
        assert estimate.value is not None
        assert estimate.std_total is not None
        assert abs(estimate.value - truth.parameters[key]) < 3.0 * estimate.std_total, key


def test_constant_engine_torque_cannot_tell_efficiency_and_inertia_in_gear(tmp_path: Path) -> None:
    """The paper's own regression is refused; the default says that the shift alone carries it."""
    paper, _ = _identified(tmp_path, ScenarioName.PAPER, Method.PAPER, 1.0)
    default, truth = _identified(tmp_path, ScenarioName.PAPER, Method.LIKELIHOOD, 1.0)
    for key in ("eta", "J_prime_2"):
        assert paper.estimates[key].verdict is not Verdict.IDENTIFIED
        estimate = default.estimates[key]
        assert "not separately identifiable" in estimate.reason
        assert estimate.value is not None
        assert estimate.std_total is not None
        assert abs(estimate.value - truth.parameters[key]) < 3.0 * estimate.std_total


REFERENCE = Path(__file__).resolve().parents[3] / "shared" / "reference"


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Identification:
    """The identification of a log cut from another program's solution of the paper's upshift."""
    source = REFERENCE / "dual_clutch_upshift.csv"
    if not source.is_file():
        pytest.skip("the shared reference solutions are not at hand")
    folder = tmp_path_factory.mktemp("reference")
    columns = {
        "time_s": ("time", "s"),
        "T_e_Nm": ("EngTrq", "Nm"),
        "P_2_Pa": ("PrsBrk2", "Pa"),
        "P_3_Pa": ("PrsBrk3", "Pa"),
        "T_o_Nm": ("TrqOut", "Nm"),
        "omega_e_rad_s": ("SpdIn", "rad/s"),
        "omega_out_rad_s": ("SpdOut", "rad/s"),
        "omega_w_rad_s": ("SpdWhl", "rad/s"),
    }
    table = np.genfromtxt(source, delimiter=",", names=True)
    rows = np.column_stack([table[name] for name in columns])
    head = [",".join(name for name, _ in columns.values())]
    head += [",".join(unit for _, unit in columns.values())]
    np.savetxt(
        folder / "log.csv", rows, fmt="%.12g", delimiter=",", header="\n".join(head), comments=""
    )
    _, card, _ = synthesize(folder / "made.csv", ScenarioName.PAPER)
    vehicle = drivetwin.load_card(card)
    log = drivetwin.read_log(folder / "log.csv", vehicle)
    return drivetwin.identify(log, vehicle, drivetwin.detect_shifts(log, vehicle))


def test_log_cut_from_a_reference_solution_returns_its_parameters(
    reference: Identification,
) -> None:
    truth = dyno.run(load_scenario(ScenarioName.PAPER), noise=0.0).truth
    for name in WITHIN_HALF_A_PERCENT:
        value = reference.estimates[name].value
        assert value == pytest.approx(truth.parameters[name], rel=5e-3), name
    assert _friction_error(reference.friction["B3"], truth.friction["B3"]) < 0.01

# SPDX-License-Identifier: MIT
"""identify() from log and card: contract, verdicts, refusals, truth of the shared log."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import IdentificationError, NoShiftError
from drivetwin.estimation.analysis.profile_likelihood import get_likelihood_fit
from drivetwin.estimation.data.prepare import build_driveline
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.identify import ACCELERATION_ERROR, ALL_BEFORE_LOSS, COMMON_GAIN
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.estimates import build_estimates
from drivetwin.estimation.likelihood.mechanism import quick
from drivetwin.estimation.likelihood.uncertainty.torque_scale import WITH_ETA
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.estimation.result.method import Method, ModelStatus
from drivetwin.findings import Code
from drivetwin.logs.read import read_log
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import FoundShifts, detect_shifts
from drivetwin.twin.build import build_twin
from drivetwin.validation.simulate_log import attach_validation
from drivetwin.vehicle.card import VehicleCard, load_card
from drivetwin.vehicle.effects import EffectId, EffectPrior
from drivetwin.vehicle.spec import PriorValue, SensorTolerance

ROOT = Path(__file__).parents[2]
LOGS = ROOT.parent / "shared" / "logs"
LIKELIHOOD = "drivetwin.estimation.likelihood.pipeline"


@cache
def recording(name: str) -> tuple[ShiftLog, VehicleCard, FoundShifts]:
    path = LOGS / f"{name}.csv"
    if not path.exists():
        pytest.skip(f"{path.name} is not beside the repository")
    card = load_card(ROOT / "examples" / "vehicles" / f"{name}.toml")
    exact = dict.fromkeys(("engine_torque", "output_torque"), SensorTolerance())
    card = replace(card, sensors=exact)
    log = read_log(path, card)
    return log, card, detect_shifts(log, card)


@cache
def identified(name: str, method: Method) -> Identification:
    return identify(*recording(name), method)


@cache
def identified_quickly(name: str) -> Identification:
    with quick():
        return identify(*recording(name))


def test_the_paper_like_log_returns_its_truth_within_the_intervals() -> None:
    truth = {
        "eta": 0.85,
        "J_prime_2": 17.50,
        "J_prime_3": 17.69,
        "J_vehicle": 6056.0,
        "Tv_over_if": 2300.0,
        "k_o": 1.76e5,
        "c_o": 280.0,
        "f_d_3": 12.0,
    }
    found = identified_quickly("paper_like")
    for name, value in truth.items():
        estimate = found.estimates[name]
        assert estimate.value is not None
        assert estimate.std_noise is not None
        assert abs(estimate.value - value) < 3.0 * estimate.std_noise, name
        assert abs(estimate.value / value - 1.0) < 0.01, name
    curve = found.friction["B3"]
    mu = 0.110 + 0.025 * np.exp(-curve.slip / 15.0) + 1e-4 * curve.slip
    assert np.mean((mu >= curve.mu_lo) & (mu <= curve.mu_hi)) > 0.8
    assert np.max(np.abs(curve.mu / mu - 1.0)) < 0.015


def test_a_failed_likelihood_gives_its_reason_and_the_papers_values(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def gives_up(*_: object, **__: object) -> None:
        raise IdentificationError("the search crawls", "drive on")

    monkeypatch.setattr(f"{LIKELIHOOD}.estimate_likelihood", gives_up)
    log, card, shifts = recording("truck_a")
    found = identify(log, card, shifts, Method.LIKELIHOOD)
    assert found.method is Method.PAPER
    assert found.evidence.gave_up == "the search crawls"
    (failed,) = [one for one in found.findings if one.code is Code.LIKELIHOOD_FAILED]
    assert failed.text.startswith("Likelihood fit failed (the search crawls)")
    assert Verdict.IDENTIFIED not in [one.verdict for one in found.estimates.values()]
    assert "the search crawls" in found.estimates["k_o"].reason
    paper = identified("truck_a", Method.PAPER)
    assert found.estimates["J_vehicle"].value == paper.estimates["J_vehicle"].value
    assert paper.evidence.gave_up == ""
    judged = attach_validation(found, build_twin(found, card), log)
    assert judged.status is ModelStatus.NOT_VALID
    with pytest.raises(IdentificationError, match=r"fit of this log failed.*the search crawls"):
        get_likelihood_fit(found)


def _held_briefly(before: float, after: float) -> tuple[ShiftLog, VehicleCard, FoundShifts]:
    """The paper-like log without a wheel speed, its gears held for so long [s]."""
    log, card, shifts = recording("paper_like")
    channels = {role: c for role, c in log.channels.items() if role != "wheel_speed"}
    (shift,) = shifts.shifts
    end, lockup = shift.before[1], shift.lockup_time
    brief = replace(shift, before=(end - before, end), after=(lockup, lockup + after))
    return replace(log, channels=channels), card, FoundShifts((brief,), ())


def test_gears_held_briefly_are_fitted() -> None:
    log, card, shifts = _held_briefly(0.2, 0.2)
    found = identify(log, card, shifts)
    assert found.method is Method.LIKELIHOOD
    truth = {"eta": 0.85, "J_prime_2": 17.50, "J_vehicle": 6056.0, "k_o": 1.76e5, "c_o": 280.0}
    for name, value in truth.items():
        estimate = found.estimates[name]
        assert estimate.value is not None
        assert estimate.std_total is not None
        assert abs(estimate.value - value) < 3.0 * estimate.std_total, name
        assert estimate.std_total < 0.02 * value, name


def test_constant_engine_torque_is_said_in_words_not_hidden() -> None:
    found = identified_quickly("paper_like")
    assert "η and J′ are not separately" in found.estimates["eta"].reason
    assert "η and J′ are not separately" in found.estimates["J_prime_2"].reason
    assert found.estimates["te_delay"].verdict is Verdict.NOT_IDENTIFIABLE
    assert found.estimates["te_delay"].value is None
    assert Code.GEAR_POORLY_EXCITED in [one.code for one in found.findings]


def test_a_log_with_throttle_steps_tells_everything() -> None:
    found = identified("truck_a", Method.LIKELIHOOD)
    assert list(found.inputs) == ["truck_a.csv", "truck_a.toml"]
    reported = {name for name, e in found.estimates.items() if e.verdict is Verdict.IDENTIFIED}
    assert {"eta", "J_prime_2", "J_prime_3", "J_vehicle", "Tv_over_if", "te_delay"} <= reported
    assert {"k_o", "c_o", "f_d_3", "zeta_3", "P0.B3"} <= reported
    assert found.correlation is not None
    assert found.correlation.shape == (len(found.correlation_ids),) * 2
    assert get_likelihood_fit(found)[0].chi2 == pytest.approx(1.0, abs=0.05)


def test_the_papers_method_claims_no_interval_and_doubts_the_constant_torque() -> None:
    found = identified("paper_like", Method.PAPER)
    assert found.estimates["eta"].value == 0.85
    assert found.estimates["eta"].std_noise is None
    assert found.estimates["eta"].verdict is Verdict.WEAK
    assert not any(one.verdict is Verdict.IDENTIFIED for one in found.estimates.values())
    assert found.estimates["J_vehicle"].value is None, "the least error lies at a negative inertia"


def test_design_values_do_not_pass_for_measured_ones() -> None:
    found = identified("paper_like", Method.PAPER)
    for name, value, std in (("P0.B2", 0.8e5, 0.1e5), ("J_out", 0.9, 0.09)):
        estimate = found.estimates[name]
        assert (estimate.verdict, estimate.method) == (Verdict.DESIGN, "card")
        assert estimate.value == pytest.approx(value, rel=0.05)
        assert estimate.std_total == pytest.approx(std, rel=0.2)
        assert "card" in estimate.reason


def test_inertias_outside_the_cards_ranges_are_told() -> None:
    log, card, shifts = recording("truck_a")
    assert not [
        one
        for one in identified_quickly("truck_a").findings
        if one.code is Code.OUTSIDE_DESIGN_RANGE
    ]
    strict = replace(card, J_prime_range=(3.0, 9.0), J_vehicle_range=(1000.0, 2000.0))
    with quick():
        found = identify(log, strict, shifts).findings
    outside = [one for one in found if one.code is Code.OUTSIDE_DESIGN_RANGE]
    assert [one.subject for one in outside] == ["J_prime_2", "J_prime_3", "J_vehicle"]


def test_tolerances_enter_the_likelihood_as_shifts_of_its_minimum() -> None:
    log, card, shifts = recording("truck_a")
    stated = replace(card, sensors={**card.sensors, "output_torque": SensorTolerance(gain=0.01)})
    found = identify(log, stated, shifts, Method.LIKELIHOOD)
    for name in ("eta", "k_o", "Tv_over_if", "J_vehicle"):
        estimate = found.estimates[name]
        assert estimate.value is not None
        assert estimate.std_systematic == pytest.approx(0.01 * estimate.value, rel=0.1), name


def test_the_law_that_could_tell_the_gearbox_side_apart_says_that_it_is_not() -> None:
    log, card, shifts = recording("truck_a")
    with quick():
        other = identify(log, replace(card, loss_law="dissipative"), shifts)
    assert ALL_BEFORE_LOSS in other.assumptions
    assert {ACCELERATION_ERROR, COMMON_GAIN} <= set(other.assumptions)
    assert ALL_BEFORE_LOSS not in identified_quickly("truck_a").assumptions


def test_refusals() -> None:
    log, card, shifts = recording("truck_a")
    with pytest.raises(NoShiftError, match="no gear shift: one gear throughout"):
        identify(log, card, FoundShifts((), ()))
    channels = {role: c for role, c in log.channels.items() if role != "output_torque"}
    with pytest.raises(IdentificationError, match="no output torque"):
        identify(replace(log, channels=channels), card, shifts, Method.PAPER)


def test_without_an_output_torque_ratios_are_told_and_absolute_values_refused() -> None:
    log, card, shifts = recording("truck_a")
    whole = identified("truck_a", Method.LIKELIHOOD)
    channels = {role: c for role, c in log.channels.items() if role != "output_torque"}
    found = identify(replace(log, channels=channels), card, shifts, Method.LIKELIHOOD)
    eta = whole.estimates["eta"].value
    assert eta is not None
    for name in ("J_prime_2", "J_vehicle", "Tv_over_if", "k_o", "c_o"):
        assert found.estimates[name].value is None
        assert "output-torque sensor" in found.estimates[name].reason
        ratio, absolute = found.estimates[f"{name}_over_eta"], whole.estimates[name].value
        assert ratio.value is not None
        assert ratio.std_noise is not None
        assert absolute is not None
        assert abs(ratio.value - absolute / eta) < 4.0 * ratio.std_noise, name
    assert found.estimates["eta"].verdict is Verdict.NOT_IDENTIFIABLE
    assert found.friction["B3"].method_text == "likelihood, μ over η"
    _check_efficiency_from_design(found, card)
    _check_scale_from_mass(found, card)


def _check_scale_from_mass(found: Identification, card: VehicleCard) -> None:
    """A stated J_vehicle sets the scale: it keeps its deviation, and all others get it."""
    over_eta = found.estimates["J_vehicle_over_eta"].value
    assert over_eta is not None
    mass = PriorValue(0.9 * over_eta, 0.018 * over_eta)
    known = replace(card, known={"J_vehicle": mass})
    fit, signals = get_likelihood_fit(found)
    none = EffectPriors({effect: EffectPrior(0.0) for effect in EffectId})
    drivelines = [build_driveline(known, found.shifts[0])]
    result = build_estimates(fit, signals, drivelines, none)
    values = result.estimates
    ratio, stiffness = (values[f"{one}_over_eta"].value for one in ("J_vehicle", "k_o"))
    assert ratio is not None
    assert stiffness is not None
    eta = values["eta"]
    assert eta.value == pytest.approx(mass.value / ratio)
    assert eta.verdict is Verdict.IDENTIFIED
    own = (values["J_vehicle_over_eta"].std_total or 0.0) / ratio
    assert eta.std_total == pytest.approx(mass.value / ratio * np.hypot(0.02, own))
    assert values["J_vehicle"].value == pytest.approx(mass.value)
    assert values["J_vehicle"].std_total == pytest.approx(mass.std)
    assert values["J_vehicle"].verdict is Verdict.DESIGN
    assert values["k_o"].value == pytest.approx(mass.value / ratio * stiffness)
    assert result.joint is not None
    place = [result.joint.ids.index(one) for one in ("eta", "k_o", "J_vehicle")]
    std = np.sqrt(np.diag(result.joint.covariance))[place]
    assert std == pytest.approx([values[result.joint.ids[k]].std_total for k in place])
    correlation = result.joint.covariance[np.ix_(place, place)] / np.outer(std, std)
    assert correlation.min() > 0.9
    wrong = replace(card, known={"J_vehicle": PriorValue(2.0 * over_eta, 0.02 * over_eta)})
    again = build_estimates(fit, signals, [build_driveline(wrong, found.shifts[0])], none)
    assert again.estimates["eta"].value is None
    assert Code.CARD_CONTRADICTED in [one.code for one in again.findings]


def _check_efficiency_from_design(found: Identification, card: VehicleCard) -> None:
    """With η on the card absolute values are given; the spread of η is their systematic part."""
    known = replace(card, known={"eta": PriorValue(0.9, 0.02)})
    driveline = build_driveline(known, found.shifts[0])
    fit, signals = get_likelihood_fit(found)
    none = EffectPriors({effect: EffectPrior(0.0) for effect in EffectId})
    values = build_estimates(fit, signals, [driveline], none).estimates
    ratio = values["J_vehicle_over_eta"]
    assert ratio.value is not None
    assert values["J_vehicle"].value == pytest.approx(0.9 * ratio.value)
    assert ratio.std_total is not None
    both = np.hypot(0.02 * ratio.value, 0.9 * ratio.std_total)
    assert values["J_vehicle"].std_total == pytest.approx(both, rel=1e-6)
    assert values["J_vehicle"].method == WITH_ETA
    assert values["eta"].verdict is Verdict.DESIGN

# SPDX-License-Identifier: MIT
"""The twin: built from an identification, saved, loaded, turned into a model."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.errors import InputError, MissingParameterError, ResultFileError
from drivetwin.estimation.result.estimate import Estimate, LoadLaw, Verdict
from drivetwin.files.twin_file import load_twin, save_twin
from drivetwin.simulation.dual_clutch import FrictionTable, Stribeck
from drivetwin.simulation.shift_control import SpeedSensor
from drivetwin.twin.build import build_twin
from drivetwin.twin.twin import Twin
from tests.report.sample import SHIFT, STRIBECK, card, identification

MODE = {"mode_frequency": 40.0, "mode_share": 0.5, "mode_damping": 0.05}


@pytest.fixture
def twin() -> Twin:
    return build_twin(identification(), card())


def test_identifiable_engine_side_inertia_is_kept(twin: Twin) -> None:
    model = twin.build_dual_clutch(SHIFT)
    J_prime = twin.parameters["J_prime_2"].value
    assert J_prime is not None
    i_g = card().compute_ratio("2")
    assert model.J1 * model.eta + model.J2e + model.J_out / i_g**2 == pytest.approx(J_prime)
    assert model.load.constant == pytest.approx(2300.0 * 5.38)


def test_a_load_that_grows_with_speed_holds_the_told_value_at_the_mean_speed(
    twin: Twin, tmp_path: Path
) -> None:
    law = LoadLaw(aero=4.8, std=0.1, mean_speed=14.3)
    save_twin(tmp_path / "twin.toml", replace(twin, load_law=law))
    load = load_twin(tmp_path / "twin.toml").build_dual_clutch(SHIFT).load
    assert load.evaluate(14.3) == pytest.approx(2300.0 * 5.38)
    assert load.evaluate(20.0) - load.evaluate(10.0) == pytest.approx(4.8 * (20.0**2 - 10.0**2))


def without_scale(twin: Twin, eta: float) -> Twin:
    """What a log without an output torque tells of the twin."""
    reported = dict(twin.parameters)
    for name in ("J_prime_2", "J_prime_3", "J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o"):
        one = reported[name]
        assert one.value is not None
        reported[name] = replace(one, value=None)
        reported[name + "_over_eta"] = replace(one, id=name + "_over_eta", value=one.value / eta)
    reported["eta"] = replace(reported["eta"], value=None)
    reported["drum.B3_over_eta"] = replace(
        reported["k_o_over_eta"], id="drum.B3_over_eta", value=0.05 / eta
    )
    curve = twin.friction["B3"]
    law = curve.stribeck
    assert law is not None
    ratio = Stribeck(law.mu_c / eta, law.mu_s / eta, law.v_s, law.mu_v / eta)
    curve = replace(curve, stribeck=ratio, over_eta=True)
    return replace(twin, parameters=reported, friction={"B3": curve})


def test_without_a_torque_scale_the_model_is_over_eta_and_its_motion_the_same(twin: Twin) -> None:
    eta = twin.parameters["eta"].value
    assert eta is not None
    partial = without_scale(twin, eta)
    assert partial.over_eta
    whole, ratio = twin.build_dual_clutch(SHIFT), partial.build_dual_clutch(SHIFT)
    for name in ("J_out", "J_v", "k_o", "c_o"):
        assert getattr(ratio, name) == pytest.approx(getattr(whole, name) / eta)
    drums = [one.elements[1].drum_inertia for one in (whole, ratio)]
    assert drums[1] == pytest.approx(drums[0] / eta)
    assert pytest.approx(whole.J1) == ratio.J1
    scaled = partial.build_dual_clutch(SHIFT, overrides={"eta": eta})
    assert scaled.k_o == pytest.approx(whole.k_o)
    assert pytest.approx(whole.J1) == scaled.J1
    law_found, law_true = scaled.elements[1].friction, whole.elements[1].friction
    assert law_found.evaluate(np.array([30.0])) == pytest.approx(
        law_true.evaluate(np.array([30.0]))
    )


def test_with_the_efficiency_from_design_all_of_the_model_has_one_scale(twin: Twin) -> None:
    eta = twin.parameters["eta"].value
    assert eta is not None
    law = LoadLaw(aero=4.8, std=0.1, mean_speed=14.3)
    part = without_scale(twin, eta)
    ratios = {name: one for name, one in part.parameters.items() if name.endswith("_over_eta")}
    over = replace(law, aero=law.aero / eta, over_eta=True)
    card_eta = replace(part, parameters={**twin.parameters, **ratios}, load_law=over)
    told_eta = replace(part, parameters={**part.parameters, "eta": twin.parameters["eta"]})
    model = replace(twin, load_law=law).build_dual_clutch(SHIFT)
    for one in (card_eta, replace(told_eta, load_law=over)):
        found = one.build_dual_clutch(SHIFT)
        assert (found.J1, found.k_o, found.eta) == pytest.approx((model.J1, model.k_o, model.eta))
        assert found.load.constant == pytest.approx(model.load.constant)
        assert found.load.aero == pytest.approx(model.load.aero)
        assert found.elements[1].drum_inertia == pytest.approx(model.elements[1].drum_inertia)
        mu, true = (each.elements[1].friction.evaluate(np.array([30.0])) for each in (found, model))
        assert mu == pytest.approx(true)
        other = one.build_dual_clutch(SHIFT, overrides={"eta": 0.5 * eta})
        assert other.eta == 0.5 * eta
        assert (other.k_o, other.elements) == (found.k_o, found.elements)


def test_a_twin_is_made_with_the_efficiency_from_design_in_friction_and_load() -> None:
    found, eta, std = identification(), 0.85, 0.02
    design = Estimate("eta", eta, std, Verdict.DESIGN, "card")
    curve = replace(found.friction["B3"], stribeck_covariance=np.diag([1e-6, 1e-6, 0.5, 1e-10]))
    curve = replace(curve, over_eta=True)
    law = LoadLaw(aero=4.8, std=0.1, mean_speed=14.3, over_eta=True)
    reported = replace(found, estimates={**found.estimates, "eta": design}, friction={"B3": curve})
    made = build_twin(replace(reported, load=law), card())
    one, load = made.friction["B3"], made.load_law
    assert not one.over_eta
    assert one.mu == pytest.approx(eta * curve.mu)
    assert one.points_mu == pytest.approx(eta * curve.points_mu)
    half = np.hypot(eta * (curve.mu_hi - curve.mu), 1.96 * std * curve.mu)
    assert one.mu_hi - one.mu == pytest.approx(half, rel=1e-4)
    assert one.mu - one.mu_lo == pytest.approx(half, rel=1e-4)
    assert one.stribeck is not None
    assert asdict(one.stribeck) == pytest.approx(
        {key: v if key == "v_s" else eta * v for key, v in asdict(STRIBECK).items()}
    )
    assert one.stribeck_covariance is not None
    assert one.stribeck_covariance[0, 0] == pytest.approx(eta**2 * 1e-6 + (std * 0.11) ** 2)
    assert one.stribeck_covariance[0, 1] == pytest.approx(std**2 * 0.11 * 0.135)
    assert one.stribeck_covariance[2, 2] == 0.5
    assert load is not None
    assert (load.aero, load.std) == pytest.approx((eta * 4.8, np.hypot(eta * 0.1, std * 4.8)))
    assert not load.over_eta
    assert made.build_dual_clutch(SHIFT).elements[1].friction == one.stribeck


def test_element_without_a_curve_runs_on_its_partners_and_says_so(twin: Twin) -> None:
    offgoing, oncoming = twin.build_dual_clutch(SHIFT).elements
    assert offgoing.friction == oncoming.friction == STRIBECK
    assert (
        "friction of B2 is taken to be that of B3, ± 7 % beside the errors of both gains"
        in twin.assumptions
    )


def test_curve_without_a_law_becomes_a_table_from_zero_slip(twin: Twin) -> None:
    curve = replace(twin.friction["B3"], stribeck=None)
    model = replace(twin, friction={"B3": curve}).build_dual_clutch(SHIFT)
    table = model.elements[1].friction
    assert isinstance(table, FrictionTable)
    assert table.slip[0] == 0.0
    assert table.mu[0] == curve.mu[0]
    assert table.slip[1:] == tuple(curve.slip)


def test_identified_drum_goes_before_the_cards(twin: Twin, tmp_path: Path) -> None:
    assert [one.drum_inertia for one in twin.build_dual_clutch(SHIFT).elements] == [0.0, 0.05]
    drum = Estimate("drum.B3", 0.07, 0.01, Verdict.IDENTIFIED, "likelihood")
    reported = replace(twin, parameters={**twin.parameters, "drum.B3": drum})
    save_twin(tmp_path / "twin.toml", reported)
    for one in (reported, load_twin(tmp_path / "twin.toml")):
        assert one.build_dual_clutch(SHIFT).elements[1].drum_inertia == 0.07
        assert one.elements["B3"].drum == 0.05
        other = one.build_dual_clutch(SHIFT, overrides={"drum.B3": 5.0})
        assert other.elements[1].drum_inertia == 5.0


@pytest.mark.parametrize(
    "name", ["Jout", "te_delay", "f_d_3", "J_prime_4", "P0.C4", "k_o_over_eta"]
)
def test_an_override_without_effect_is_refused_with_those_that_act(twin: Twin, name: str) -> None:
    with pytest.raises(InputError, match=f"does not depend on {name}") as caught:
        twin.build_dual_clutch(SHIFT, overrides={"J_out": 3.0, name: 3.0})
    assert "J_prime_2, J_prime_3, P0.B2, P0.B3, drum.B2, drum.B3" in caught.value.remedy


def test_an_output_inertia_that_leaves_none_for_the_engine_is_named(twin: Twin) -> None:
    with pytest.raises(InputError, match="no inertia remains for the engine") as refusal:
        twin.build_dual_clutch(SHIFT, overrides={"J_out": 900.0})
    assert "J_out_kgm2" in refusal.value.remedy


def test_missing_parameter_is_named_with_its_reason(twin: Twin) -> None:
    reported = dict(twin.parameters)
    reported["k_o"] = replace(reported["te_delay"], id="k_o", reason="no oscillation after lock-up")
    del reported["eta"]
    partial = replace(twin, parameters=reported)
    with pytest.raises(MissingParameterError) as caught:
        partial.build_dual_clutch(SHIFT)
    assert "k_o (no oscillation after lock-up)" in str(caught.value)
    assert "eta (not part of the identification)" in str(caught.value)
    model = partial.build_dual_clutch(SHIFT, overrides={"k_o": 1.8e5, "eta": 0.9})
    assert (model.k_o, model.eta) == (1.8e5, 0.9)


def test_the_card_it_carries_reads_a_log_as_the_vehicles_own(twin: Twin, tmp_path: Path) -> None:
    save_twin(tmp_path / "twin.toml", twin)
    carried, given = load_twin(tmp_path / "twin.toml").build_card(), card()
    for gear in given.gears:
        assert carried.compute_ratio(gear.name) == pytest.approx(given.compute_ratio(gear.name))
        assert carried.get_gear_element(gear.name) == given.get_gear_element(gear.name)
    for name in given.elements:
        assert carried.get_clutch_ratios(name) == pytest.approx(given.get_clutch_ratios(name))
        assert carried.elements[name].kind == given.elements[name].kind
    assert carried.J_vehicle_range == given.J_vehicle_range


def test_round_trip(twin: Twin, tmp_path: Path) -> None:
    twin = replace(twin, sensors={"engine_speed": SpeedSensor(0.05, 0.1, 0.01, 0.02)})
    save_twin(tmp_path / "twin.toml", twin)
    back = load_twin(tmp_path / "twin.toml")
    assert back.sensors == twin.sensors
    assert back.build_dual_clutch(SHIFT) == twin.build_dual_clutch(SHIFT)
    assert back.parameters["te_delay"] == twin.parameters["te_delay"]
    assert back.covariance == pytest.approx(twin.covariance)
    assert back.gears == twin.gears
    assert back.validity == twin.validity
    assert back.inputs == twin.inputs
    save_twin(tmp_path / "again.toml", back)
    assert load_twin(tmp_path / "again.toml").build_dual_clutch(SHIFT) == twin.build_dual_clutch(
        SHIFT
    )


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("schema = 'drivetwin/twin-3'", "newer"),
        ("schema = 'other'", "expected 'drivetwin/twin-2'"),
        ("schema = 'drivetwin/twin-1'", "transmission: this key is required and missing"),
        ("schema = 'drivetwin/twin-2'\nparameters = 1", "parameters: the value should be"),
        ("schema = 'drivetwin/twin-2'\nparameters.eta = 1", "parameters.eta: the value should be"),
        ("not toml", "cannot be read: "),
    ],
)
def test_damaged_or_newer_files_are_refused(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "twin.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ResultFileError, match=says):
        load_twin(path)


def test_faults_of_a_file_are_told_by_key_and_path(twin: Twin, tmp_path: Path) -> None:
    path = tmp_path / "twin.toml"
    save_twin(path, twin)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("i_in = ", "i_in = 'x' # ", 1), encoding="utf-8")
    with pytest.raises(ResultFileError, match=r"twin\.toml, key 'transmission.i_in': ") as found:
        load_twin(path)
    assert "pydantic" not in str(found.value)
    with pytest.raises(ResultFileError, match="cannot read the file: No such file") as absent:
        load_twin(tmp_path / "absent.toml")
    assert "check the path" in absent.value.remedy
    assert absent.value.where.file == str(tmp_path / "absent.toml")


@pytest.mark.parametrize(
    ("values", "kept"),
    [
        (MODE, MODE),
        ({"backlash": 0.01}, {"backlash": 0.01}),
        ({"mode_frequency": 40.0}, {}),
        ({}, {}),
    ],
)
def test_the_part_of_the_plant_is_kept(
    twin: Twin, tmp_path: Path, values: dict[str, float], kept: dict[str, float]
) -> None:
    own = {k: Estimate(k, v, 0.0, Verdict.IDENTIFIED, "given") for k, v in values.items()}
    save_twin(tmp_path / "twin.toml", replace(twin, parameters={**twin.parameters, **own}))
    found = load_twin(tmp_path / "twin.toml")
    assert found.added_element_values == kept
    assert found.drop_added_elements().added_element_values == {}

# SPDX-License-Identifier: MIT
"""What a log gives to a card: ratios, elements, final drive, P0, inertias, products."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest

from drivetwin.authoring.log_survey import label_pressure
from drivetwin.vehicle.card import load_card
from tests.authoring.sessions import format_session, load_session, make_draft, survey
from tests.plausibility.fixtures import Synthetic, make_log
from tests.support.repeats import mark_repeats

SCENARIOS = ("paper_steps", "gearbox_chain", "dual_clutch", "manual", "power_off_down")
DAILY = ("paper_steps", "gearbox_chain", "manual")
LOGS = Path(__file__).resolve().parents[3] / "shared" / "logs"


@pytest.fixture(scope="module", params=mark_repeats(SCENARIOS, DAILY))
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Synthetic:
    return make_log(request.param, tmp_path_factory.mktemp("survey"))


def get_value(session: Any, *key: str) -> Any:
    """Return the value of an answer; None where the question is open."""
    answer = session.answers.get(key)
    return None if answer is None else answer.value


def test_a_draft_agrees_with_the_card_of_the_scenario(made: Synthetic) -> None:
    card = load_card(made.card)
    session = make_draft(made.log)
    estimates = session.estimates
    ratios = get_value(session, "gears", "ratios")
    assert ratios == pytest.approx([gear.ratio.value for gear in card.gears], rel=2e-3)
    assert session.answers["gears", "ratios"].origin.name == "GUESS"
    assert get_value(session, "final_drive") == pytest.approx(card.final_drive.value, rel=5e-3)
    elements = get_value(session, "gears", "elements")
    for element, gear in zip(elements, card.gears, strict=True):
        label = get_value(session, "elements", element, "label")
        if made.log.stem != "manual":
            assert label == gear.elements[0]
        P0 = estimates.P0.get(element)
        if P0 is not None:
            true = card.get_element(gear.elements[0]).P0.value / 1e5
            assert P0.std is not None
            assert abs(P0 - true) < 2.0 * P0.std
    document = tomllib.loads(format_session(session, draft=True))
    assert all(not {"gain_m3", "area_m2"} & table.keys() for table in document["elements"].values())


def test_ranges_of_a_draft_contain_the_truth(made: Synthetic) -> None:
    truth = json.loads(made.log.with_suffix(".truth.json").read_text("utf-8"))["parameters"]
    session = make_draft(made.log)
    for part in ("J_vehicle", "J_prime"):
        found = get_value(session, "inertia", part)
        true = [one["value"] for name, one in truth.items() if name.startswith(part)]
        assert true
        assert found is None or all(found[0] < one < found[1] for one in true)


def test_products_follow_from_the_ratios_of_the_elements(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    made = make_log("paper_steps", tmp_path_factory.mktemp("products"))
    card = load_card(made.card)
    known = make_draft(made.log, {}, ["kind=brake,P0_bar=0.8"]).estimates.products
    (name,) = known
    product = known[name].middle / card.get_element(name).gain.value
    assert 0.08 < product < 0.16
    unknown = make_draft(made.log, {"--elements": "X,Y"}).estimates
    assert not unknown.products
    assert "with μ 0.12 the gain would be" in format_session(make_draft(made.log))
    single = {"--engine-inertia": "1..30", "--mass": "9000", "--wheel-radius": "0.5"}
    assumed = make_draft(made.log, single, ["kind=brake,P0_bar=0.8,gain_m3=unknown"])
    gain = load_session(assumed, made.log.parent).get_element(name).gain
    assert gain.assumed
    assert 0.7 < gain.value / card.get_element(name).gain.value < 1.4


def test_a_complete_card_of_a_log_and_options_is_read(made: Synthetic, tmp_path: Path) -> None:
    stated = ["kind=clutch,i_c=1,P0_bar=0.8,gain_m3=0.01"]
    single = {"--engine-inertia": "1..30", "--mass": "9000", "--wheel-radius": "0.5"}
    session = make_draft(made.log, single, stated)
    assert not session.list_open()
    card = load_session(session, tmp_path)
    assert card.final_drive.value == pytest.approx(get_value(session, "final_drive"))


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("PrsBrk2", "B2"), ("p_K1_ist", "K1"), ("Druck Bremse 3", "B3"), ("p2", "E2"),
        ("PrsC4", "C4"), ("PrsClutch", "K"), ("PrsMain", None), ("n2", None), ("C03 p", "C3"),
        ("ClutchPressureC4", "C4"), ("Kupplungsdruck 1", "K1"), ("BrakePressure2", "B2"),
        ("Prs_Clutch_K2", "K2"), ("Druck_Kupplung_1", "K1"), ("C4Pressure", "C4"),
        ("Clutch4", None),
    ],
)  # fmt: skip
def test_pressures_are_labelled_after_their_elements(name: str, label: str | None) -> None:
    assert label_pressure(name) == label


@pytest.mark.parametrize(("name", "ratios"), [("truck_a.csv", (1.86, 1.41)),
                                              ("truck_b.mf4", (1.91, 1.43, 1.0))])  # fmt: skip
def test_given_logs(name: str, ratios: tuple[float, ...]) -> None:
    if not (LOGS / name).is_file():
        pytest.skip(f"no {name} beside the project")
    session = make_draft(LOGS / name)
    assert get_value(session, "gears", "ratios") == pytest.approx(ratios, abs=2e-3)
    assert get_value(session, "gears", "names") == ("2", "3", "4")[: len(ratios)]


def test_a_log_without_units_needs_a_mapping(tmp_path: Path) -> None:
    log = LOGS / "truck_c.mat"
    if not log.is_file():
        pytest.skip("no truck_c.mat beside the project")
    assert "names no unit" in survey(log, None).remark
    mapping = tmp_path / "channels.toml"
    mapping.write_text(
        "".join(
            f'[channels.{role}]\nsource = "{source}"\nunit = "{unit}"\n'
            for role, source, unit in (
                ("engine_torque", "te", "Nm"), ("input_speed", "w_in", "rpm"),
                ("output_speed", "w_out", "rpm"), ("wheel_speed", "w_wheel", "rpm"),
                ("pressure.B2", "p2", "bar"), ("pressure.B3", "p3", "bar"),
            )
        ),
        encoding="utf-8",
    )  # fmt: skip
    session = make_draft(log, mapping=mapping)
    assert get_value(session, "gears", "ratios") == pytest.approx((1.81, 1.406), abs=2e-3)
    assert get_value(session, "gears", "elements") == ("B2", "B3")


def test_the_range_of_inertia_needs_the_input_gear(tmp_path: Path) -> None:
    made = make_log("input_gear", tmp_path)
    truth = json.loads(made.log.with_suffix(".truth.json").read_text("utf-8"))["parameters"]
    assumed = make_draft(made.log).answers
    assert assumed["i_in",].origin.name == "GUESS"
    assert "i_in 1" in assumed["inertia", "J_prime"].note
    stated = make_draft(made.log, {"--input-gear": "1.2"})
    low, high = get_value(stated, "inertia", "J_prime")
    assert low < truth["J_prime_2"]["value"] < high


def test_hostile_columns_come_back_from_the_card(tmp_path: Path) -> None:
    made = make_log("manual", tmp_path)
    hostile = "Prs \"Clutch#'\u202e=\\x"
    text = made.log.read_text(encoding="utf-8")
    quoted = hostile.replace('"', '""')
    made.log.write_text(text.replace("PrsClutch", f'"{quoted}"', 1), encoding="utf-8")
    single = {"--engine-inertia": "0.1..0.6", "--vehicle-inertia": "90..250"}
    session = make_draft(made.log, single, ["i_c=1,P0_bar=0.5,gain_m3=0.0065,kind=clutch"])
    path = tmp_path / "card.toml"
    path.write_text(format_session(session, made.log, draft=True), encoding="utf-8")
    card = load_card(path)
    assert {spec.source for spec in card.channels.values()} == {hostile}
    assert len(card.channels) == 2

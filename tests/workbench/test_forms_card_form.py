# SPDX-License-Identifier: MIT
"""Card form: questions that follow from answers, faults beside fields, and the written card."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.errors import CardError, DrivetwinError, InputError, RefusedError
from drivetwin.vehicle.card import load_card
from drivetwin.workbench.session import CARD_TEXT
from tests.workbench.conftest import CARD, LOG

ANSWERS: dict[tuple[str, ...], str] = {
    ("name",): "Truck 7",
    ("elements", "B2", "P0_bar"): "0.8+-0.1",
    ("elements", "B2", "form"): "gain",
    ("elements", "B2", "gain_m3"): "0.0378",
    ("elements", "B3", "P0_bar"): "0.8+-0.1",
    ("elements", "B3", "form"): "gain",
    ("elements", "B3", "gain_m3"): "0.027",
}
"""Data of the vehicle that its log does not show."""


@pytest.fixture
def begun(session: Any, tmp_path: Path, serve: Callable[..., Any]) -> Any:
    """A session in a folder of its own that has begun a card."""
    log = tmp_path / LOG
    log.write_bytes(session.get_folder_source(LOG).path.read_bytes())
    _, sessions = serve(tmp_path)
    begun = sessions.get(sessions.create())
    begun.open(begun.get_folder_source(LOG))
    begun.begin_card()
    return begun


def _list_keys(form: Any) -> list[Any]:
    return [one.question.key for one in form.entries]


def test_a_refused_answer_has_its_reason_beside_the_field(begun: Any) -> None:
    form = begun.form
    form.fill_in({("final_drive",): "4,88", ("gears", "names"): "2"})
    faults = {one.question.key: one.fault for one in form.entries}
    assert "write a point" in faults[("final_drive",)]
    assert "1 names for 2 gears" in faults[("gears", "names")]
    form.fill_in({("final_drive",): "4.88", ("gears", "names"): ""})
    assert not any(one.fault for one in form.entries if one.question.key[0] != "elements")


def test_a_complete_form_is_written_and_opened(begun: Any) -> None:
    source = begun.write_card("truck", ANSWERS, can_replace=False)
    assert source.name == "truck.toml"
    card = load_card(source.path)
    assert card.name == "Truck 7"
    assert card.elements["B2"].gain.value == pytest.approx(0.0378)
    assert "guess:" in source.path.read_text()
    begun.open_card(source)
    assert len(begun.work.shifts) == 1


def test_an_existing_card_is_replaced_only_on_request(begun: Any) -> None:
    path = begun.write_card("truck.toml", ANSWERS, can_replace=False).path
    before = path.read_text()
    other = {**ANSWERS, ("name",): "Other"}
    with pytest.raises(RefusedError):
        begun.write_card("../truck", ANSWERS, can_replace=False)
    with pytest.raises(RefusedError, match="this file exists"):
        begun.write_card("truck.toml", other, can_replace=False)
    assert path.read_text() == before
    begun.write_card("truck.toml", other, can_replace=True)
    assert load_card(path).name == "Other"


def test_open_answers_are_listed_and_nothing_is_written(begun: Any) -> None:
    with pytest.raises(InputError, match="Is the gain of B2 known"):
        begun.write_card("truck.toml", {}, can_replace=False)
    assert not list(begun.folder.root.glob("*.toml"))


TEXTS = st.text(max_size=12) | st.sampled_from(
    [
        "none",
        "zf-8hp70",
        "2,3",
        "1.86,1.41",
        "B2,B3",
        "clutch",
        "gain",
        "area",
        "1e999",
        "-1",
        "0.8",
    ]
)


@settings(
    max_examples=3, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_any_text_is_an_answer_or_a_fault(begun: Any, data: st.DataObject) -> None:
    form = type(begun.form)(begun.form.survey)
    form.fill_in({})
    for _ in range(2):
        key = data.draw(st.sampled_from(_list_keys(form)))
        form.fill_in({key: data.draw(TEXTS)})
    with suppress(InputError, CardError):
        assert "[[gears]]" in form.format_card("card.toml")


def test_the_text_of_the_open_card_is_edited(begun: Any, place: Path) -> None:
    """A card with faults is refused with their keys; nothing is written then."""
    session = begun
    shutil.copy(place / CARD, begun.folder.root)
    session.open(session.get_folder_source(LOG), session.get_folder_source(CARD))
    before = session.read_card_text()
    for bad in ("", before.replace("final_drive", "final_drift"), "[", "final_drive = 4"):
        with pytest.raises(DrivetwinError):
            session.write_edited_card("e.toml", {CARD_TEXT: bad}, can_replace=False)
    assert not (begun.folder.root / "e.toml").exists()
    edited = re.sub(r"final_drive = .*", "final_drive = 5.1", before)
    source = session.write_edited_card("edited.toml", {CARD_TEXT: edited}, can_replace=False)
    session.open_card(source)
    assert session.work.require_card().final_drive.value == 5.1
    assert session.read_card_text() == edited
    with pytest.raises(RefusedError):
        session.write_edited_card("edited.toml", {CARD_TEXT: edited}, can_replace=False)

# SPDX-License-Identifier: MIT
"""Sessions of `card new` with options, a log and answers, and the cards that they write."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from drivetwin.authoring.card_text import format_card
from drivetwin.authoring.log_survey import survey_log
from drivetwin.authoring.questions import Sources
from drivetwin.authoring.session import Session, parse_options
from drivetwin.channels.mapping import Mapped
from drivetwin.channels.mapping_file import read_mapping
from drivetwin.vehicle.card import VehicleCard, load_card

VALID = {
    "name": "truck", "gearbox": "none", "ratios": "1.86, 1.41", "names": "2,3",
    "elements": "B2 B3", "kind": "clutch", "i_c": "1", "i_out": "", "P0_bar": "0.8", "form": "gain",
    "gain_m3": "0.03", "surfaces": "10", "derating": "0.9", "area_m2": "0.02", "radius_m": "0.15",
    "outer_mm": "340", "inner_mm": "0", "piston_outer_mm": "300", "piston_inner_mm": "0",
    "i_in": "1", "final_drive": "4.88", "J_prime": "4..20", "mass": "12000", "wheel_radius": "0.5",
    "J_out": "", "converter": "none",
}  # fmt: skip
"""An answer to each question that is taken in nearly all situations, by the end of its key."""


def answer_valid(question: Any) -> str:
    """Answer a question as `VALID` does."""
    return "none" if question.key[0] == "sensors" else VALID[question.key[-1]]


@cache
def survey(log: Path, mapping: Path | None) -> Any:
    """Survey a log once for all tests."""
    return survey_log(log, Mapped({}) if mapping is None else read_mapping(mapping))


def make_session(
    single: Mapping[str, str] | None = None,
    elements: Iterable[str] = (),
    sensors: Iterable[str] = (),
    log: Path | None = None,
    mapping: Path | None = None,
) -> Session:
    """Return a session with its options answered."""
    sources = Sources("truck") if log is None else Sources("truck", survey(log, mapping))
    answers = parse_options(sources, dict(single or {}), list(elements), list(sensors))
    return Session(answers, sources)


def make_draft(
    log: Path | None = None,
    single: Mapping[str, str] | None = None,
    elements: Iterable[str] = (),
    sensors: Iterable[str] = (),
    mapping: Path | None = None,
) -> Session:
    """Return a session in which the rest is guessed or left open."""
    session = make_session(single, elements, sensors, log, mapping)
    session.fill_draft()
    return session


def format_session(session: Session, log: Path | None = None, *, draft: bool = False) -> str:
    """Return the text of the card."""
    seen = None if log is None else survey(log, None)
    return format_card(session.answers, seen, session.estimates, draft=draft)


def load_session(session: Session, folder: Path, *, draft: bool = False) -> VehicleCard:
    """Write the card and read it."""
    path = folder / "card.toml"
    path.write_bytes(format_session(session, draft=draft).encode("utf-8"))
    return load_card(path)

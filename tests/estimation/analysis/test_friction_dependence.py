# SPDX-License-Identifier: MIT
"""Drag that the dynamometer adds is found, and where there is none none is seen."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import drivetwin
from drivetwin.cli.synth import write_run
from drivetwin.dyno.actuators import Actuator, Program
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.analysis import friction_dependence as module
from drivetwin.estimation.analysis.friction_dependence import Dependence, Kind, estimate_dependences
from drivetwin.estimation.analysis.profile_likelihood import get_likelihood_fit
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.estimation.identification import Identification
from drivetwin.simulation.dual_clutch import FrictionTable, ShiftElement
from tests.estimation.asked import DURATION, RATE, stepped

DRAG = {"B2": 0.6, "B3": 0.3}
"""Viscous drag while open [N m s/rad]: some 30 N m each."""


def _dragging() -> Identification:
    """A log whose clutches drag: one element more beside each, at a constant pressure of 1 Pa."""
    base = replace(load_scenario("paper_steps"), duration=DURATION)
    base = replace(base, sensors=tuple(replace(s, rate=min(s.rate, RATE)) for s in base.sensors))
    beside = tuple(
        ShiftElement(
            f"{e.name} drag", e.i_c, e.i_out, 1.0, 0.0,
            FrictionTable((0.0, 200.0), (0.0, 200.0 * DRAG[e.name])),
        )
        for e in base.model.elements
    )  # fmt: skip
    constant = {e.name: Actuator(Program(((0.0, 1.0),)), 0.01, 0.02) for e in beside}
    model = replace(base.model, elements=(*base.model.elements, *beside))
    made = run(replace(base, model=model, actuators={**base.actuators, **constant}), seed=4)
    with tempfile.TemporaryDirectory() as folder:
        log_file, card_file, _ = write_run(Path(folder) / "log.csv", replace(made, scenario=base))
        card = drivetwin.load_card(card_file)
        log = drivetwin.read_log(log_file, card)
        return drivetwin.identify(log, card, drivetwin.detect_shifts(log, card))


def _by(found: tuple[Dependence, ...], kind: Kind) -> dict[str, Dependence]:
    return {one.element: one for one in found if one.kind is kind}


def test_finds_the_drag_of_open_clutches() -> None:
    told = _by(estimate_dependences(_dragging()), Kind.DRAG)
    for name, true in DRAG.items():
        assert told[name].text == "seen"
        assert told[name].value == pytest.approx(true, abs=3.5 * told[name].std)


def test_sees_none_where_there_is_none() -> None:
    found = estimate_dependences(stepped())
    assert found
    for one in found:
        assert one.text != "seen", one
        assert abs(one.value) < 3.0 * one.std


def test_slow_errors_of_a_sensor_make_a_departure_less_sure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Noise of the output torque that stays for 50 samples; nothing found is put back."""
    monkeypatch.setattr(module, "_subtract_effects", lambda *_: None)
    found = stepped()
    fit, _ = get_likelihood_fit(found)
    (residual,), (term,) = fit.normal.residuals, fit.problem.terms
    count = term.record.outputs[0].values.size
    held = np.repeat(np.random.default_rng(1).standard_normal(count // 50 + 1), 50)[:count]
    slow = residual.copy()
    slow[:count] += term.record.sigma[:count] * held
    wrong = replace(fit, normal=replace(fit.normal, residuals=(slow,)))
    evidence = replace(found.evidence, likelihood=wrong)
    sure, unsure = (
        estimate_dependences(found),
        estimate_dependences(replace(found, evidence=evidence)),
    )
    for before, after in zip(sure, unsure, strict=True):
        assert after.std >= 0.99 * before.std
    assert max(a.std / b.std for a, b in zip(unsure, sure, strict=True)) > 1.2


def test_a_steady_temperature_tells_nothing_and_a_moving_one_is_looked_at() -> None:
    time = np.array([0.0, DURATION])
    still = estimate_dependences(stepped(), MeasuredSignal(time, np.full(2, 353.0)))
    assert not _by(still, Kind.TEMPERATURE)
    moving = _by(
        estimate_dependences(stepped(), MeasuredSignal(time, np.array([340.0, 360.0]))),
        Kind.TEMPERATURE,
    )
    assert moving["B3"].std > 0.0
    assert moving["B3"].text != "seen"
    # Oil that drops out for a second, in which the shift lies, has not changed meanwhile.
    dense = np.linspace(0.0, DURATION, 34)
    kept = dense[(dense < 2.0) | (dense > 3.0)]
    gappy = MeasuredSignal(kept, np.interp(kept, time, [340.0, 360.0]))
    assert gappy.gaps
    again = _by(estimate_dependences(stepped(), gappy), Kind.TEMPERATURE)
    assert again["B3"].std == pytest.approx(moving["B3"].std, rel=1e-3)

# SPDX-License-Identifier: MIT
"""One noise realisation of a virtual-dyno scenario, as the estimators see it."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import drivetwin
from drivetwin._util.arrays import estimate_rounding_step
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.dyno.scenario import Scenario
from drivetwin.dyno.truth import Effects
from drivetwin.estimation.data.shift_data import (
    KnownDriveline,
    ShiftElementKinematics,
    ShiftSignals,
)
from drivetwin.estimation.identification import Identification
from drivetwin.likelihood.measured_signal import prepare_signal
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.effects import EffectId, EffectPrior
from drivetwin.vehicle.spec import PriorValue, ShiftKind

NO_EFFECT = {effect: EffectPrior(0.0) for effect in EffectId}
"""Statement of a card that the model leaves nothing out, as is true of the dynamometer."""

SHIFT_SIGMA = {"torque_start": 0.01, "inertia_start": 0.001, "lockup": 0.0005}
"""What shift detection states of its instants on such logs [s]."""


@dataclass(frozen=True)
class Knowledge:
    """Standard deviations of the card's design values, 0 for known: Jo′ relative, P0 [Pa], drums
    [kg m^2]."""

    J_out: float = 0.0
    P0: float = 0.0
    drum: float = 0.0


@dataclass(frozen=True)
class Bench:
    """Signals and structure of one realisation, with its truth by id."""

    signals: ShiftSignals
    driveline: KnownDriveline
    truth: dict[str, float]
    run: DynoRun


def record_bench(
    scenario: Scenario,
    seed: int,
    know: Knowledge,
    noise: float = 1.0,
    effects: Effects | None = None,
) -> Bench:
    """Record the scenario with the noise of `seed`, and with `effects` that no card knows.

    Where the card knows a value only roughly, the card's value is drawn about the truth.
    """
    made = run(scenario, seed, noise=noise, effects=effects)
    rng = np.random.default_rng([seed, 1])
    model = scenario.model
    J_out = model.J_out * (1.0 + know.J_out * rng.standard_normal())
    couplings = {}
    for one in model.elements:
        P0 = PriorValue(one.P0 + know.P0 * float(rng.standard_normal()), know.P0)
        about = max(0.0, one.drum_inertia + know.drum * float(rng.standard_normal()))
        drum = PriorValue(about, know.drum)
        couplings[one.name] = ShiftElementKinematics(
            one.name, 1.0 / one.i_c, one.i_out, one.gain, P0, one.name.removeprefix("B"), drum
        )
    driveline = KnownDriveline(
        model.i_f,
        couplings[scenario.offgoing],
        couplings[scenario.oncoming],
        couplings,
        PriorValue(J_out, know.J_out * model.J_out),
        model.loss_law,
    )
    return Bench(_sample_signals(made), driveline, dict(made.truth.parameters), made)


def _sample_signals(made: DynoRun) -> ShiftSignals:
    scenario, truth = made.scenario, made.truth
    assert truth.torque_start is not None
    assert truth.inertia_start is not None
    assert truth.lockup is not None
    channels = {channel.role: prepare_signal(channel) for channel in made.channels}
    end = made.scenario.duration
    start = truth.torque_start - 0.02
    shift = Shift(
        scenario.start_gear,
        scenario.end_gear,
        scenario.offgoing,
        scenario.oncoming,
        ShiftKind.POWER_ON_UP,
        (0.0, start),
        (start, truth.inertia_start),
        (truth.inertia_start, truth.lockup),
        (truth.lockup, end),
        truth.lockup,
        sigma=SHIFT_SIGMA,
    )
    return ShiftSignals(
        channels["engine_torque"],
        channels["output_torque"],
        channels["input_speed"],
        channels["output_speed"],
        channels["wheel_speed"],
        {n: channels[f"pressure.{n}"] for n in (scenario.offgoing, scenario.oncoming)},
        shift,
        estimate_rounding_step(channels["engine_torque"].values),
    )


def read_run(
    made: DynoRun,
    mapping: str = "",
    P0_std: float | None = None,
    name: str = "log",
    **stated: Any,
) -> tuple[ShiftLog, VehicleCard]:
    """Write a run to files and read its log and card; `stated` replaces fields of the card.

    `mapping` is the text of a channel mapping; with `P0_std` the card leaves P0 that spread [Pa].
    """
    with tempfile.TemporaryDirectory() as folder:
        log_file, card_file, _ = write_run(Path(folder) / f"{name}.csv", made)
        card = replace(drivetwin.load_card(card_file), **stated)
        if P0_std is not None:
            elements = {
                name: replace(one, P0=replace(one.P0, std=P0_std))
                for name, one in card.elements.items()
            }
            card = replace(card, elements=elements)
        rows = Path(folder) / "mapping.toml"
        rows.write_text(mapping, encoding="utf-8")
        return drivetwin.read_log(log_file, card, rows if mapping else None), card


def identify_run(made: DynoRun, P0_std: float | None = None, **stated: Any) -> Identification:
    """Identify the log of a run by its card, of which `stated` replaces fields."""
    log, card = read_run(made, P0_std=P0_std, **stated)
    return drivetwin.identify(log, card, drivetwin.detect_shifts(log, card))

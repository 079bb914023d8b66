# SPDX-License-Identifier: MIT
"""The observer on a log whose torques are known: the bands hold the truth and are narrow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import DamagedChannelError, MissingChannelError, MissingParameterError
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.observer.linear_model import Band
from drivetwin.observer.smooth import estimate_torques
from tests.observer.conftest import Bench, brief
from tests.support.arrays import FloatArray


def _without(log: ShiftLog, *roles: str) -> ShiftLog:
    kept = {k: v for k, v in log.channels.items() if not k.startswith(roles)}
    return replace(log, channels=kept)


def _with_gap(log: ShiftLog, role: str, start: float, end: float) -> ShiftLog:
    channel = log.channels[role]
    kept = (channel.time < start) | (channel.time > end)
    torn = replace(channel, time=channel.time[kept], values=channel.values[kept])
    return replace(log, channels={**log.channels, role: torn})


def _deviates(band: Band, truth: FloatArray) -> float:
    """Root mean square of the error in standard deviations, where the band has a width."""
    wide = band.std > 0.1
    return float(np.sqrt(np.mean(((band.value - truth)[wide] / band.std[wide]) ** 2)))


def test_bands_hold_the_truth(bench: Bench) -> None:
    """T_o reaches 5 kN·m. Errors of a log go together, since they share the twin's: they are about
    one draw, of which all samples may lie beyond a standard deviation but not far beyond two.
    """
    blind = _without(bench.log, "output_torque")
    one = estimate_torques(bench.twin, blind, bench.shift)
    seen = estimate_torques(bench.twin, bench.log, bench.shift)
    assert np.array_equal(seen.output_torque.value, one.output_torque.value)
    for name, truth in bench.truth(one).items():
        band = one.bands[name]
        assert _deviates(band, truth) < 2.0, name
        assert np.sqrt(np.mean((band.value - truth) ** 2)) < 20.0, name
        assert band.std.mean() < 20.0, name


def test_parts_of_the_twin_widen_the_bands_of_the_smoother(bench: Bench) -> None:
    log = _without(bench.log, "output_torque")
    plain = estimate_torques(bench.twin, log, bench.shift)
    play = Estimate("tyre_slip", 0.004, 1e-4, Verdict.IDENTIFIED, "given")
    reference = Estimate("shaft_reference", 5e3, 0.0, Verdict.IDENTIFIED, "given")
    own = {**bench.twin.parameters, "tyre_slip": play, "shaft_reference": reference}
    found = estimate_torques(replace(bench.twin, parameters=own), log, bench.shift)
    assert "slip of the tyres" in found.notes[-1]
    for name, band in found.bands.items():
        assert band.value == pytest.approx(plain.bands[name].value)
        assert np.all(band.std >= plain.bands[name].std)
    assert np.max(found.output_torque.std) > 1.5 * np.max(plain.output_torque.std)


def test_without_pressures_the_bands_widen_and_hold(bench: Bench) -> None:
    log = _without(bench.log, "output_torque", "pressure.")
    shift = brief(log, bench.twin.build_card())
    one = estimate_torques(bench.twin, log, shift)
    full = estimate_torques(bench.twin, bench.log, bench.shift)
    truth = bench.truth(one)
    assert _deviates(one.output_torque, truth["output_torque"]) < 2.0
    assert _deviates(one.clutch_torque["B3"], truth["torque.B3"]) < 2.0
    slipping = (one.time > shift.inertia_phase[0]) & (one.time < shift.lockup_time)
    assert one.clutch_torque["B3"].std[slipping].mean() > full.clutch_torque["B3"].std.mean()
    assert one.notes[0].startswith("no pressure of B2 and B3:")


def test_a_twin_without_scale_is_refused(bench: Bench) -> None:
    """A twin from a log without output torque has ratios over η only."""
    parameters = dict(bench.twin.parameters)
    torque_like = ("J_", "k_o", "c_o", "Tv_over_if", "mu_gain", "drum", "eta")
    for name, one in bench.twin.parameters.items():
        if name.startswith(torque_like):
            parameters[name] = replace(
                one, value=None, std_noise=None, verdict=Verdict.NOT_IDENTIFIABLE
            )
            parameters[name + "_over_eta"] = replace(one, id=name + "_over_eta")
    twin = replace(bench.twin, parameters=parameters)
    assert twin.over_eta
    with pytest.raises(MissingParameterError, match="over η only"):
        estimate_torques(twin, bench.log, bench.shift)


def test_a_log_without_engine_torque_is_refused(bench: Bench) -> None:
    with pytest.raises(MissingChannelError, match="engine_torque"):
        estimate_torques(bench.twin, _without(bench.log, "engine_torque"), bench.shift)


@pytest.mark.parametrize("role", ["engine_torque", "pressure.B3"])
def test_what_is_missing_in_the_shift_is_never_bridged(bench: Bench, role: str) -> None:
    start = bench.shift.inertia_phase[0]
    log = _with_gap(bench.log, role, start, start + 0.2)
    with pytest.raises(DamagedChannelError, match="during the shift"):
        estimate_torques(bench.twin, log, bench.shift)


def test_a_gear_counts_as_far_as_its_torque_was_recorded(bench: Bench) -> None:
    end = bench.shift.before[1]
    log = _with_gap(bench.log, "engine_torque", end - 0.8, end - 0.5)
    one = estimate_torques(bench.twin, log, bench.shift)
    assert end - 0.5 < one.time[0] < end - 0.4
    assert "used only from there on" in one.notes[0]
    assert _deviates(one.output_torque, bench.truth(one)["output_torque"]) < 2.0

# SPDX-License-Identifier: MIT
"""Two logs in one likelihood: narrower as it should be, true, and refused where it is senseless."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import IdentificationError, InputError
from drivetwin.estimation.analysis.profile_likelihood import get_likelihood_fit
from drivetwin.estimation.data.prepare import prepare
from drivetwin.estimation.identification import Several
from drivetwin.estimation.likelihood.fit import invert_information
from drivetwin.estimation.likelihood.parametrization import LOG_SPECIFIC
from drivetwin.estimation.multi_log.consistency import find_shared
from drivetwin.estimation.multi_log.fit import (
    extract_log,
    merge_tolerances,
)
from drivetwin.parameters import split_log_number
from drivetwin.pipeline import identify, identify_jointly
from tests.estimation.multi_log.fixtures import (
    LOADS,
    card,
    loaded,
    pair,
    scenario,
    source,
    together,
)


def _several() -> Several:
    found = together().found.evidence.several
    assert found is not None
    return found


def test_the_common_covariance_is_that_of_the_summed_information() -> None:
    """Each log alone counts the design prior; of two logs one of them is one too many."""
    fit, _ = get_likelihood_fit(together().found)
    shared = find_shared(fit)
    names = [fit.point.names[k] for k in shared]
    summed = -fit.problem.prior.precision[np.ix_(shared, shared)]
    for log, number in zip(pair(), (1, 2), strict=True):
        alone, _ = get_likelihood_fit(identify(log.log, card(), log.shifts))
        place = [alone.point.names.index(name) for name in names]
        assert len(place) == len(shared), number
        summed = summed + invert_information(alone.covariance[np.ix_(place, place)])
    by_sum = np.sqrt(np.diag(invert_information(summed)))
    common = np.sqrt(np.diag(fit.covariance)[shared])
    # The weighting is formed at slightly different points, and chi2 above 1 widens.
    assert common == pytest.approx(by_sum, rel=0.1)


def test_two_equal_logs_halve_the_variance() -> None:
    for name in ("eta", "J_vehicle", "te_delay.1"):
        alone = _several().logs[0].alone[split_log_number(name)[0]].std_noise
        common = together().found.estimates[name].std_noise
        assert alone is not None
        assert common is not None
        share = 1.0 if split_log_number(name)[1] else 2.0**-0.5
        assert common == pytest.approx(share * alone, rel=0.2), name


def test_the_truth_of_shared_and_of_own_values_is_within_the_intervals() -> None:
    model = scenario().model
    truth = {"eta": model.eta, "J_vehicle": model.J_v, "k_o": model.k_o, "c_o": model.c_o}
    truth |= {"J_out": model.J_out}
    truth |= {f"Tv_over_if.{k}": load for k, load in enumerate(LOADS, 1)}
    truth |= {f"te_delay.{k}": 0.010 for k in (1, 2)}
    for name, value in truth.items():
        estimate = together().found.estimates[name]
        assert estimate.value is not None
        assert estimate.std_noise is not None
        assert abs(estimate.value - value) < 3.3 * estimate.std_noise, name


@pytest.mark.parametrize("first", [0.0, 0.01])
def test_the_log_that_shows_values_latest_tells_how_old_they_may_be(first: float) -> None:
    prepared = []
    for one, late in zip(pair(), (first, 0.01 - first), strict=True):
        channels = {r: replace(c, late=late) for r, c in one.log.channels.items()}
        prepared.append(prepare(replace(one.log, channels=channels), card(), one.shifts))
    tolerances = merge_tolerances(prepared)
    assert tolerances["output_torque"].delay == pytest.approx(0.01 / np.sqrt(12.0))


def test_a_design_prior_counts_once() -> None:
    fit, _ = get_likelihood_fit(together().found)
    known = card().J_out
    assert known is not None
    place = fit.point.names.index("J_out")
    assert fit.problem.prior.precision[place, place] == pytest.approx(known.std**-2)


def test_each_log_has_its_own_and_nothing_else() -> None:
    names = get_likelihood_fit(together().found)[0].point.names
    assert not set(LOG_SPECIFIC) & set(names)
    assert {f"log{k}.{name}" for k in (1, 2) for name in LOG_SPECIFIC[:2]} <= set(names)


def test_the_same_recording_twice_is_refused() -> None:
    one = pair()[0]
    again = replace(one.log, source="copy.mf4", sha256="another")
    with pytest.raises(InputError, match="same recording"):
        identify_jointly([one.log, again], card(), [one.shifts, one.shifts])


def test_logs_with_and_without_output_torque_are_refused() -> None:
    one, other = pair()
    channels = {k: v for k, v in other.log.channels.items() if k != "output_torque"}
    without = ShiftLog(channels, "blind.csv", "x")
    with pytest.raises(InputError, match=r"blind\.csv without an output torque"):
        identify_jointly([one.log, without], card(), [one.shifts, other.shifts])


def test_logs_of_different_vehicles_are_refused_with_what_differs() -> None:
    heavy = source(scenario(payload=1.25), 25)
    with pytest.raises(IdentificationError, match="J_vehicle"):
        identify_jointly([pair()[0].log, heavy.log], card(), [pair()[0].shifts, heavy.shifts])


def test_a_disagreement_widens_and_weakens_what_it_concerns() -> None:
    found = loaded().found
    estimate = found.estimates["J_vehicle"]
    assert estimate.verdict.value == "weak"
    assert "The logs do not agree: log 2" in estimate.reason
    low, high = estimate.ci95_total or (0.0, 0.0)
    light = scenario().model.J_v
    assert low < light < 1.03 * light < high
    assert found.estimates["eta"].verdict.value == "identified"


def test_each_log_keeps_the_loads_of_its_own_shifts() -> None:
    found = together().found
    several = found.evidence.several
    assert several is not None
    counts = [len(share.shifts) for share in several.logs]
    loads = tuple(float(k) for k in range(sum(counts)))
    hilly = replace(found, evidence=replace(found.evidence, loads=loads))
    told = [extract_log(hilly, share).evidence.loads for share in several.logs]
    assert [len(one) for one in told] == counts
    assert tuple(load for one in told for load in one) == loads

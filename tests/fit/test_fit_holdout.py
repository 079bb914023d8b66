# SPDX-License-Identifier: MIT
"""Prediction of recordings that took no part in a fit."""

from __future__ import annotations

import pytest

from drivetwin.fit.fit import fit_network, predict
from drivetwin.fit.synthesize import ModelName
from drivetwin.fit.unknown import Unknown
from tests.support.fits import fit_log, make_log, make_small, record_two_sided


@pytest.mark.parametrize("name", ModelName)
def test_another_recording_of_the_driveline_is_predicted_to_its_noise(name: ModelName) -> None:
    found = fit_log(name)
    (held,) = predict(found, [make_log(name, 1).recording])
    assert held.chi2 == pytest.approx(1.0, abs=0.1)
    for output, fit in held.agreement.items():
        assert fit.fit_percent == pytest.approx(found.agreement[0][output].fit_percent, abs=0.5)


def test_another_driveline_is_not_predicted() -> None:
    model, recording = make_small({"left.stiffness": Unknown(450.0, 100.0)})
    found = fit_network(model, [recording])
    same, softer = (record_two_sided(stiffness) for stiffness in (800.0, 500.0))
    good, bad = predict(found, [same, softer])
    assert good.chi2 < 1.2
    assert bad.chi2 > 10.0 * good.chi2


def test_nothing_held_out_gives_nothing() -> None:
    assert predict(fit_log(ModelName.TIP_IN), []) == ()

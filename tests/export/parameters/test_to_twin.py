# SPDX-License-Identifier: MIT
"""A parameter file that was edited becomes a twin with those values."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.estimation.result.estimate import Estimate, LoadLaw, Verdict
from drivetwin.export.parameters.content import Curve, ParameterSet, Scalar
from drivetwin.export.parameters.files import ParameterFormat, show_units
from drivetwin.export.parameters.of_twin import collect_parameters
from drivetwin.export.parameters.to_twin import update_twin
from drivetwin.simulation.dual_clutch import FrictionTable, Stribeck
from tests.export.parameters.sample import reread, twin
from tests.report.sample import SHIFT


def _edited(**values: float) -> ParameterSet:
    """The exported set with other values, names with `__` for the dot."""
    new = {name.replace("__", "."): value for name, value in values.items()}
    content = collect_parameters(twin())
    return replace(
        content,
        scalars=tuple(replace(one, value=new.get(one.name, one.value)) for one in content.scalars),
    )


@pytest.mark.parametrize("kind", ParameterFormat)
def test_edited_values_reach_the_simulation(kind: ParameterFormat) -> None:
    edited = _edited(k_o=2e5, gain__B3=0.03, P0__B3=9e4, i_f=5.0, ratio_3=1.5, mu_c__B3=0.1)
    given = twin()
    unchanged = update_twin(given, reread(collect_parameters(given), kind))
    assert unchanged.changed == unchanged.idle == unchanged.unknown == ()
    assert unchanged.twin == given
    update = update_twin(twin(), reread(edited, kind))
    assert set(update.changed) == {"k_o", "gain.B3", "P0.B3", "i_f", "ratio_3", "mu_c.B3"}
    model, element = (
        update.twin.build_dual_clutch(SHIFT),
        update.twin.build_dual_clutch(SHIFT).elements[1],
    )
    assert (model.k_o, model.i_f, element.gain, element.P0) == (2e5, 5.0, 0.03, 9e4)
    assert isinstance(element.friction, Stribeck)
    assert element.friction.mu_c == 0.1
    assert update.twin.get_gear("3").ratio == 1.5
    assert update.twin.parameters["k_o"].verdict is Verdict.DESIGN
    assert update.twin.covariance is not None
    assert update_twin(twin(), _edited(eta=0.9)).twin.covariance is None


@pytest.mark.parametrize("reported", [False, True])
def test_every_name_that_is_told_as_changed_acts(reported: bool) -> None:
    given = replace(twin(), load_law=LoadLaw(aero=7.0, std=0.5, mean_speed=14.0))
    if reported:
        drum = Estimate("drum.B3", 0.07, 0.01, Verdict.IDENTIFIED, "likelihood")
        given = replace(given, parameters={**given.parameters, "drum.B3": drum})
    changed: list[str] = []
    for one in collect_parameters(given).scalars:
        file = ParameterSet("t", (replace(one, value=1.5 * one.value + 0.1),))
        update = update_twin(given, file)
        changed += update.changed
        acts = update.twin.build_dual_clutch(SHIFT) != given.build_dual_clutch(SHIFT)
        # The gears' ratios find the shifts of a log as well.
        assert acts == bool(update.changed) or one.name == "ratio_3", one.name
        assert update.twin == given if update.idle else update.changed == (one.name,)
    assert set(changed) >= {"J_prime_2", "J_prime_3", "drum.B2", "drum.B3", "load.mean_speed"}
    assert not {"f_d_3", "zeta_3"} & set(changed)


def test_an_edited_curve_becomes_the_law() -> None:
    content = collect_parameters(twin())
    (curve,) = content.curves
    raised = tuple(1.1 * mu for mu in curve.values)
    update = update_twin(twin(), replace(content, curves=(replace(curve, values=raised),)))
    law = update.twin.build_dual_clutch(SHIFT).elements[1].friction
    assert isinstance(law, FrictionTable)
    assert (law.slip, law.mu) == (curve.axis.points, raised)


def test_friction_over_eta_is_written_and_changed_as_such() -> None:
    given = twin()
    curve = given.friction["B3"]
    given = replace(given, friction={"B3": replace(curve, over_eta=True)})
    content = collect_parameters(given)
    numbers = {one.name: one for one in content.scalars}
    mu_c, (curve_then,) = numbers["mu_c.B3"], content.curves
    assert mu_c.text.removesuffix("; identified").endswith("over η")
    assert not numbers["v_s.B3"].text.removesuffix("; identified").endswith("over η")
    raised = replace(curve_then, values=tuple(1.1 * mu for mu in curve_then.values))
    law = ParameterSet("t", (replace(mu_c, value=0.1),))
    curve_only = ParameterSet("t", (), (raised,))
    for file in (law, curve_only):
        assert update_twin(given, file).twin.friction["B3"].over_eta


def test_a_curve_and_its_law_cannot_both_change() -> None:
    edited = _edited(mu_s__B3=0.2)
    (curve,) = edited.curves
    assert isinstance(curve, Curve)
    both = replace(edited, curves=(replace(curve, values=tuple(np.array(curve.values) * 1.1)),))
    with pytest.raises(InputError, match="both the friction curve of B3 and mu_s"):
        update_twin(twin(), both)


def test_values_in_bar_and_rpm_are_converted() -> None:
    """Of calibration tools as they were written, and edited ones in Pa and rad/s."""
    content = collect_parameters(twin())
    shown = show_units(content, ParameterFormat.DCM)
    assert {one.unit for one in shown.scalars} >= {"bar", "rpm"}
    assert {one.axis.unit for one in shown.curves} == {"rpm"}
    assert update_twin(twin(), reread(shown, ParameterFormat.DCM)).changed == ()
    update = update_twin(twin(), ParameterSet("t", (Scalar("P0.B3", 0.9, "bar"),)))
    assert update.twin.get_value("P0.B3", 0.0) == pytest.approx(9e4)


def test_a_value_in_another_unit_is_refused() -> None:
    content = collect_parameters(twin())
    with pytest.raises(InputError, match=r"gives P0\.B3 in psi, not in Pa"):
        update_twin(twin(), ParameterSet("t", (Scalar("P0.B3", 12.0, "psi"),)))
    (curve,) = content.curves
    in_hertz = replace(curve, axis=replace(curve.axis, unit="Hz"))
    with pytest.raises(InputError, match=r"gives mu\.B3 in Hz, not in rad/s"):
        update_twin(twin(), ParameterSet("t", (), (in_hertz,)))
    with pytest.raises(InputError, match="gives te_delay in ms, not in s"):
        update_twin(twin(), ParameterSet("t", (Scalar("te_delay", 10.0, "ms"),)))


def test_a_name_that_is_given_twice_is_refused() -> None:
    """Also where a format spells it otherwise."""
    twice = ParameterSet("t", (Scalar("P0.B3", 9e4, "Pa"), Scalar("P0_B3", 8e4, "Pa")))
    with pytest.raises(InputError, match=r"gives P0\.B3 twice"):
        update_twin(twin(), twice)


@pytest.mark.parametrize("name", ["k_o", "i_in", "i_f", "i_c.B3", "i_out.B3", "ratio_3"])
def test_zero_is_refused_where_a_run_divides_by_it(name: str) -> None:
    with pytest.raises(InputError, match=f"{name} = 0 is impossible"):
        update_twin(twin(), ParameterSet("t", (Scalar(name, 0.0),)))


def test_what_the_log_could_not_tell_may_be_given_and_other_names_are_told() -> None:
    given = ParameterSet("t", (Scalar("te_delay", 0.01, "s"), Scalar("wheel_colour", 3.0)))
    update = update_twin(twin(), given)
    assert update.changed == ("te_delay",)
    assert (update.idle, update.unknown) == ((), ("wheel_colour",))
    assert update.twin.get_value("te_delay", 0.0) == 0.01

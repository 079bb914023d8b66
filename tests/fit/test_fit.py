# SPDX-License-Identifier: MIT
"""Fits of networks: truth within the intervals, what several recordings share, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.errors import InputError, PlausibilityError
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.findings import Code
from drivetwin.fit import search
from drivetwin.fit.fit import build_problem, fit_network
from drivetwin.fit.fixed_numbers import Tolerance
from drivetwin.fit.network_model import NetworkModel
from drivetwin.fit.recording import Measured, Recording
from drivetwin.fit.synthesize import ModelName, read_builtin, synthesize_log
from drivetwin.fit.unknown import Unknown
from drivetwin.likelihood.budget import limit_evaluations
from drivetwin.modeling.model import Model
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Output, Start
from tests.support.fits import (
    TWO_SIDED,
    TWO_SIDED_NOISE,
    fit_log,
    make_log,
    make_small,
    make_two_sided,
    read_log,
    record_run,
    record_two_sided,
)

STIFFNESS = Unknown(450.0, 100.0)
LEFT = {"left.stiffness": STIFFNESS}


@pytest.mark.parametrize("name", ModelName)
def test_the_truth_is_within_the_intervals_and_the_model_is_valid(name: ModelName) -> None:
    """One in 370 of the normal deviates is beyond three standard deviations; there are 22."""
    found, truth = fit_log(name), make_log(name).truth
    assert found.status is ModelStatus.VALID
    assert found.chi2 == pytest.approx(1.0, abs=0.05)
    assert set(found.values) == set(truth)
    for key, value in truth.items():
        assert abs(found.values[key] - value) < 3.0 * found.std[key], key
        assert found.estimates[key].verdict is Verdict.IDENTIFIED, key
        low, high = found.intervals[key]
        assert low < found.values[key] < high, key


def test_a_builder_fits_unknowns_that_share_numbers_by_factors() -> None:
    model, _ = make_two_sided()
    unknowns = {
        "side shafts": Unknown(500.0, 200.0, paths={"left.stiffness": 1.0, "right.stiffness": 2.0}),
        "dampers": Unknown(3.0, 1.5, paths=["left.damping", "right.damping"]),
    }
    found = model.fit(record_two_sided(), unknowns, TWO_SIDED)
    assert found.status is ModelStatus.VALID
    for name, true in {"side shafts": 400.0, "dampers": 2.0}.items():
        assert abs(found.values[name] - true) < 3.0 * found.std[name], name
    springs = {one["name"]: one for one in found.fitted.elements if "stiffness" in one}
    stiffness = found.values["side shafts"]
    assert springs["left"]["stiffness"] == pytest.approx(stiffness)
    assert springs["right"]["stiffness"] == pytest.approx(2.0 * stiffness)


def test_the_delay_of_an_input_is_found() -> None:
    """The recorded torque is stamped 12 ms before it acts."""
    model, torque = make_two_sided()
    run = model.simulate(torque.time)
    early = replace(torque, time=np.asarray(torque.time) - 0.012)
    recording = record_run(run, {"torque": early}, TWO_SIDED, TWO_SIDED_NOISE)
    found = model.fit(recording, {"delay.torque": Unknown(0.0, 0.02), **LEFT}, TWO_SIDED)
    assert found.status is ModelStatus.VALID
    assert found.std["delay.torque"] < 1e-3
    assert abs(found.values["delay.torque"] - 0.012) < 3.0 * found.std["delay.torque"]
    assert abs(found.values["left.stiffness"] - 400.0) < 3.0 * found.std["left.stiffness"]


def test_the_noise_of_a_slow_pressure_does_not_count_as_information_on_its_delay() -> None:
    """At 200 Hz 15 ms hold no cubic: the delay was 6.5 standard deviations off."""
    model, channels = read_builtin(ModelName.ENGINE_START)
    assert channels.run is not None
    noisy = channels.run.inputs["K0"].model_copy(update={"sigma": 1500.0})
    update = {"rate_Hz": 200.0, "inputs": {**channels.run.inputs, "K0": noisy}}
    run = channels.run.model_copy(update=update)
    made = read_log(synthesize_log(model, replace(channels, run=run), 1))
    unknowns = {**made.model.unknowns, "delay.K0": Unknown(0.0, 0.01)}
    exact = {"K0": Tolerance(exact=True)}
    found = fit_network(replace(made.model, unknowns=unknowns, tolerances=exact), [made.recording])
    assert found.std["delay.K0"] < 2e-3
    for name, value in {**made.truth, "delay.K0": 0.0}.items():
        assert abs(found.values[name] - value) < 3.0 * found.std[name], name


def test_the_noise_of_a_prescribed_speed_counts() -> None:
    """A shaft driven by the measured speed of the motor."""
    time = np.arange(0.0, 2.0, 2e-3)
    speed = Signal(time, 50.0 + 8.0 * np.sin(9.0 * time))
    model = Model("driven")
    motor, wheel = model.inertia("motor", 0.1), model.inertia("wheel", 1.0)
    model.prescribed_speed("drive", motor, speed)
    model.spring_damper("shaft", motor, wheel, stiffness=300.0, damping=2.0)
    model.start({wheel: 50.0})
    outputs: dict[str, Output] = {"wheel": ("speed", "wheel"), "shaft": ("shaft_torque", "shaft")}
    noise = {"drive": 0.5, "wheel": 0.02, "shaft": 0.5}
    recording = record_run(model.simulate(time), {"drive": speed}, outputs, noise)
    sought = {"wheel.inertia": 1.0, "shaft.stiffness": 300.0, "shaft.damping": 2.0}
    unknowns = {name: Unknown(1.2 * value, 0.3 * value) for name, value in sought.items()}
    found = model.fit(recording, unknowns, outputs)
    assert found.chi2 == pytest.approx(1.0, abs=0.1)
    for name, value in sought.items():
        assert abs(found.values[name] - value) < 3.0 * found.std[name], name


def test_a_residual_above_the_noise_is_valid_with_limits() -> None:
    model, recording = make_small(LEFT)
    outputs = {
        name: replace(one, sigma=0.85 * TWO_SIDED_NOISE[name])
        for name, one in recording.outputs.items()
    }
    found = fit_network(model, [replace(recording, outputs=outputs)])
    assert 1.1 < found.chi2 < 1.6
    assert found.status is ModelStatus.LIMITED
    assert Code.RESIDUAL_ABOVE_NOISE in {one.code for one in found.findings}


def test_two_recordings_share_the_unknowns_and_have_starts_of_their_own() -> None:
    model, recording = make_small(LEFT)
    common = ("gain.torque", "curve.torque")  # errors that both recordings have
    model = replace(model, tolerances=dict.fromkeys(common, Tolerance(exact=True)))
    one, both = (fit_network(model, [recording] * count) for count in (1, 2))
    names = both.minimum.point.names
    assert {"log1.start.motor", "log2.start.motor", "log2.start.left"} <= set(names)
    assert len(both.agreement) == len(both.simulate()) == 2
    assert both.values["left.stiffness"] == pytest.approx(one.values["left.stiffness"], rel=1e-3)
    ratio = both.std["left.stiffness"] / one.std["left.stiffness"]
    assert ratio == pytest.approx(1.0 / np.sqrt(2.0), rel=0.02)


def test_the_intervals_of_two_recordings_contain_the_truth() -> None:
    made, second = make_log(ModelName.TIP_IN), make_log(ModelName.TIP_IN, 1)
    found = fit_network(made.model, [made.recording, second.recording])
    for name, value in made.truth.items():
        assert abs(found.values[name] - value) < 3.0 * found.std[name], name


def test_a_known_start_is_no_unknown() -> None:
    model, recording = make_small(LEFT)
    known = {"motor": 10.0, "left wheel": 10.0, "left": 0.0}
    found = fit_network(model, [replace(recording, start=known)])
    names = ("left.stiffness", "start.right wheel", "start.right")
    assert found.minimum.point.names[:3] == names
    assert not any(name.startswith("start") for name in found.minimum.point.names[3:])
    start = found.fitted.start
    assert {name: {**start.speeds, **start.twists}[name] for name in known} == known


def test_a_start_can_be_an_unknown_with_a_prior_of_its_own() -> None:
    model, recording = make_small({**LEFT, "start.motor": Unknown(10.0, 0.1)})
    found = fit_network(model, [recording])
    assert found.minimum.point.names.count("start.motor") == 1
    assert found.estimates["start.motor"].std_noise is not None
    assert abs(found.values["start.motor"] - 10.0) < 3.0 * found.std["start.motor"]


def test_equal_seeds_give_equal_fits() -> None:
    model, recording = make_small(LEFT)
    first, again = (fit_network(model, [recording], seed=3) for _ in range(2))
    assert np.array_equal(first.minimum.point.values, again.minimum.point.values)
    assert np.array_equal(first.covariance, again.covariance)
    assert first.findings == again.findings


def test_what_the_recording_does_not_show_keeps_its_prior_and_is_reported() -> None:
    """Two inertias on one node: the recording shows their sum only."""
    model, torque = make_two_sided()
    model.inertia("rotor", 0.05, "motor")
    run = model.simulate(torque.time)
    recording = record_run(run, {"torque": torque}, TWO_SIDED, TWO_SIDED_NOISE)
    unknowns = {"motor.inertia": Unknown(0.1, 0.02), "rotor.inertia": Unknown(0.05, 0.002)}
    found = model.fit(recording, unknowns, TWO_SIDED)
    (finding,) = (one for one in found.findings if one.code is Code.NULL_DIRECTIONS)
    assert set(finding.names["parameters"].split(" and ")) == set(unknowns)
    rotor = found.estimates["rotor.inertia"]
    assert rotor.verdict is Verdict.DESIGN
    assert rotor.reason.startswith("Prior value")
    assert rotor.std_noise == pytest.approx(0.002, rel=0.05)
    assert found.estimates["motor.inertia"].verdict is Verdict.IDENTIFIED
    total = found.values["motor.inertia"] + found.values["rotor.inertia"]
    assert total == pytest.approx(0.15, rel=0.01)


def test_a_number_without_any_effect_is_named_alone() -> None:
    model, recording = make_small(LEFT)
    idle = {"type": "inertia", "name": "idle", "node": "idle", "inertia": 1.0}
    start = replace(model.start, speeds={**model.start.speeds, "idle": 5.0})
    unknowns = {**LEFT, "idle.inertia": Unknown(1.0, 0.3)}
    wider = replace(model, elements=[*model.elements, idle], start=start, unknowns=unknowns)
    found = fit_network(wider, [recording])
    (finding,) = (one for one in found.findings if one.code is Code.NULL_DIRECTION)
    assert finding.names["parameters"] == "idle.inertia"
    assert found.estimates["idle.inertia"].verdict is Verdict.DESIGN
    assert found.values["idle.inertia"] == pytest.approx(1.0)


def test_a_play_that_the_model_lacks_is_found() -> None:
    made = make_log(ModelName.TIP_IN)
    elements = [
        {key: value for key, value in {**one, "type": "spring_damper"}.items() if key != "gap"}
        if one["type"] == "backlash"
        else one
        for one in made.model.elements
    ]
    unknowns = {name: one for name, one in made.model.unknowns.items() if name != "shaft.gap"}
    wrong = replace(made.model, elements=elements, unknowns=unknowns)
    found = fit_network(wrong, [made.recording])
    (finding,) = (one for one in found.findings if one.code is Code.OMISSION_SHOWN)
    assert finding.subject == "play of shaft"
    assert found.status is ModelStatus.LIMITED
    (moved,) = (one for one in found.moved if one.number.name == "play of shaft")
    assert moved.value == pytest.approx(made.truth["shaft.gap"], abs=3.0 * moved.std)
    for name in unknowns:
        assert found.values[name] == pytest.approx(made.truth[name], abs=3.0 * found.std[name])


def test_a_search_without_explanation_ends_at_its_work_limit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = make_log(ModelName.ENGINE_START)
    outputs = {
        name: replace(one, values=one.values * (1.0 + 0.02 * np.sin(19.0 * one.time)))
        for name, one in made.recording.outputs.items()
    }
    monkeypatch.setattr(search, "FIT_SEARCH", replace(search.FIT_SEARCH, work=300.0))
    found = fit_network(made.model, [replace(made.recording, outputs=outputs)])
    assert Code.SEARCH_LIMITED in {one.code for one in found.findings}
    assert found.status is ModelStatus.NOT_VALID
    assert 1 <= len(found.starts) < 8  # four rounds of two starts without the limit


def test_a_first_guess_that_leads_to_the_recording_needs_no_draws(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = make_log(ModelName.TIP_IN)
    shafts = {**made.model.unknowns, "shaft.stiffness": Unknown(2000.0, 2500.0)}
    model = replace(made.model, unknowns=shafts)
    problem, point, _ = build_problem(model, [made.recording])
    weighted = problem.update_weighting(point)
    assert weighted.cost(point) > 200.0 * problem.size
    monkeypatch.setattr(search, "refine_draws", lambda *_: pytest.fail("draws"))
    found = fit_network(model, [made.recording])
    stiffness = found.values["shaft.stiffness"]
    assert stiffness == pytest.approx(made.truth["shaft.stiffness"], rel=0.05)


def test_a_recording_that_contradicts_the_network_is_not_valid() -> None:
    made = make_log(ModelName.TIP_IN)
    wheel = made.recording.outputs["wheel speed"]
    outputs = {**made.recording.outputs, "wheel speed": replace(wheel, values=1.3 * wheel.values)}
    found = fit_network(made.model, [replace(made.recording, outputs=outputs)])
    assert found.status is ModelStatus.NOT_VALID
    assert found.chi2 > 120.0


def test_a_motion_that_the_recording_cannot_show_is_not_simulated() -> None:
    made = make_log(ModelName.TIP_IN)
    problem, point, _ = build_problem(made.model, [made.recording])
    damping = point.names.index("shaft.damping")
    costs = []
    for factor in (1.0, 30.0, 1e4):
        values = point.values.copy()
        values[damping] += np.log(factor)
        with limit_evaluations(1e6) as budget:
            costs.append((problem.cost(point.replace_values(values)), 1e6 - budget.left))
    usual, fast, fastest = costs
    assert np.isfinite([usual[0], fast[0]]).all()
    assert fast[1] > usual[1]  # a stiff run takes more steps
    assert fastest[0] == np.inf


def test_a_coast_down_needs_no_input() -> None:
    model = Model("coast-down")
    wheel = model.inertia("wheel", 2.0)
    model.road_load("load", wheel, constant=3.0, rolling=0.0, aero=2e-4)
    model.start({wheel: 100.0})
    run = model.simulate(np.arange(0.0, 20.0, 0.02))
    outputs = {"wheel": wheel.speed}
    recording = record_run(run, {}, outputs, {"wheel": 0.02})
    unknowns = {"load.constant": Unknown(4.0, 2.0), "load.aero": Unknown(1e-4, 1e-4)}
    found = model.fit(recording, unknowns, outputs)
    assert found.status is ModelStatus.VALID
    assert abs(found.values["load.constant"] - 3.0) < 3.0 * found.std["load.constant"]
    assert abs(found.values["load.aero"] - 2e-4) < 3.0 * found.std["load.aero"]


def test_a_point_on_the_axis_of_a_table_can_be_an_unknown() -> None:
    """The core has no derivatives by it, as its schema states."""
    model = Model("retarder")
    wheel = model.inertia("wheel", 2.0)
    model.viscous_coupling("oil", wheel, model.ground, slip=[10.0, 200.0], torque=[4.0, 6.0])
    model.start({wheel: 100.0})
    run = model.simulate(np.arange(0.0, 30.0, 0.02))
    outputs = {"wheel": wheel.speed}
    recording = record_run(run, {}, outputs, {"wheel": 0.02})
    unknown = {"oil.slip.0": Unknown(12.0, 4.0)}
    known = {name: Tolerance(exact=True) for name in ("wheel", "oil")}
    found = model.fit(recording, unknown, outputs, tolerances=known)
    assert found.status is ModelStatus.VALID
    assert found.std["oil.slip.0"] < 1.0
    assert abs(found.values["oil.slip.0"] - 10.0) < 3.0 * found.std["oil.slip.0"]


def change(**entries: object) -> tuple[NetworkModel, list[Recording]]:
    model, recording = make_small(LEFT)
    return replace(model, **entries), [recording]  # type: ignore[arg-type]


def change_recording(**entries: object) -> tuple[NetworkModel, list[Recording]]:
    model, recording = make_small(LEFT)
    return model, [replace(recording, **entries)]  # type: ignore[arg-type]


def short_outputs() -> dict[str, Measured]:
    return {
        name: replace(one, time=one.time[:5], values=one.values[:5])
        for name, one in record_two_sided().outputs.items()
    }


def change_outputs(**entries: object) -> dict[str, Measured]:
    every = record_two_sided().outputs
    return {name: replace(one, **entries) for name, one in every.items()}  # type: ignore[arg-type]


def add_input(name: str) -> tuple[NetworkModel, list[Recording]]:
    inputs = record_two_sided().inputs
    return change_recording(inputs={**inputs, name: inputs["torque"]})


def make_known_start(name: str) -> Recording:
    return replace(record_two_sided(), start={name: 10.0})


def loosen(element: str, **ends: str) -> tuple[NetworkModel, list[Recording]]:
    """Put an end of an element at another node, where the inertia of the old one stays."""
    model, _ = make_small(LEFT)
    idle = {"type": "spring_damper", "name": "aid", "a": "motor", "b": "right wheel"}
    elements = [{**one, **ends} if one["name"] == element else one for one in model.elements]
    return change(elements=[*elements, {**idle, "stiffness": 1.0, "damping": 0.0}])


@pytest.mark.parametrize(
    ("case", "said"),
    [
        (
            change(unknowns={"lft.stiffness": STIFFNESS}),
            "lft.stiffness: no number of the model; did you mean 'left'",
        ),
        (change(unknowns={"left.mu_x": STIFFNESS}), "left.mu_x: no number of the model"),
        (change(unknowns={"start.moter": STIFFNESS}), "start.moter: .* did you mean 'start.motor'"),
        (change(unknowns={"delay.engine": STIFFNESS}), "delay.engine: no number of the model"),
        (change(outputs={"motor": ("speed", "rotor")}), "rotor"),
        (change(outputs={"motor": ("sped", "motor")}), "did you mean 'speed'"),
        (change(outputs={"right": ("speed", "motor")}), "the recording has no right"),
        (change(outputs={}), "the model has no outputs"),
        (change(unknowns={}), "the model has no unknowns"),
        (change(start=Start({})), "the model has no start"),
        (change(start=Start({"rotor": 1.0})), "rotor"),
        (change_recording(inputs={}), "no input 'torque'"),
        (change_recording(start={"rotor": 1.0}), "rotor"),
        (change_recording(outputs=short_outputs()), "motor: 5 samples"),
        ((make_small(LEFT)[0], []), "there is no recording"),
        (add_input("torqe"), "inputs.torqe: no element takes this input; did you mean 'torque'"),
        (change(outputs={"motor": ("speed", "motor")}), "outputs.left: the model has no quantity"),
        (
            change(unknowns={**LEFT, "shafts": Unknown(450.0, paths=["left.stiffness"])}),
            "left.stiffness: set by 'left.stiffness' and 'shafts'",
        ),
        (
            change_recording(outputs=change_outputs(time=np.arange(3.0))),
            r"outputs.motor: values of shape \(1000,\) at times of shape \(3,\)",
        ),
        (
            change_recording(outputs=change_outputs(time=np.zeros(1000))),
            "outputs.motor: the time of sample 1 is not later",
        ),
        (change_recording(outputs=change_outputs(sigma=-1.0)), "outputs.motor: the noise sigma"),
        (
            (make_small({"start.motor": STIFFNESS})[0], [make_known_start("motor")]),
            "start.motor: known by the recording",
        ),
        (
            loosen("right", b="right whel"),
            "right.b: no other element is at the node 'right whel'; did you mean 'right wheel'",
        ),
    ],
)
def test_refusals_name_the_path_or_the_channel(
    case: tuple[NetworkModel, list[Recording]], said: str
) -> None:
    with pytest.raises(InputError, match=said):
        fit_network(*case)


@pytest.mark.parametrize(
    "names", [["engine torque"], ["motor torque"], ["engine speed"], ["motor speed", "wheel speed"]]
)
def test_channels_of_the_wrong_sign_are_refused(names: list[str]) -> None:
    """Of several channels those are named that fit the rest: the sign of a whole is free."""
    made = make_log(ModelName.ENGINE_START)
    every = {*made.recording.inputs, *made.recording.outputs} - {"K0"}
    recorded = {
        table: {
            name: replace(one, values=-one.values) if name in names else one
            for name, one in getattr(made.recording, table).items()
        }
        for table in ("inputs", "outputs")
    }
    with pytest.raises(PlausibilityError, match="with the other sign of") as refusal:
        fit_network(made.model, [replace(made.recording, **recorded)])
    named = {name for name in every if name in refusal.value.what}
    assert named in (set(names), every - set(names))


def test_exchanged_outputs_are_refused_by_name() -> None:
    made = make_log(ModelName.ENGINE_START)
    outputs = dict(made.recording.outputs)
    pair = "engine speed", "wheel speed"
    outputs.update({pair[0]: outputs[pair[1]], pair[1]: outputs[pair[0]]})
    with pytest.raises(PlausibilityError, match="only with engine speed and wheel speed exchanged"):
        fit_network(made.model, [replace(made.recording, outputs=outputs)])


def test_a_prior_of_another_unit_is_no_residual() -> None:
    made = make_log(ModelName.TIP_IN)
    model = replace(
        made.model, unknowns={**made.model.unknowns, "shaft.stiffness": Unknown(7.0, 2.5)}
    )
    found = fit_network(model, [made.recording])
    assert found.values["shaft.stiffness"] == pytest.approx(9000.0, rel=0.05)
    codes = {one.code for one in found.findings}
    assert Code.PRIOR_MISSED in codes
    assert Code.SEARCH_LIMITED not in codes


def test_a_recorded_input_takes_the_place_of_that_of_the_model() -> None:
    model, recording = make_small(LEFT)
    found = fit_network(replace(model, inputs={"torque": 0.0}), [recording])
    signal = found.problem.terms[0].record.inputs["torque"]
    assert np.ptp(signal.values) > 100.0
    assert found.status is ModelStatus.VALID


def test_speeds_that_follow_from_others_are_left_out_of_the_start() -> None:
    """A stated speed behind a gear would contradict the measured one before it."""
    made = make_log(ModelName.CONVERTER_LOCK_UP)
    start = made.model.start
    behind = {"out": start.speeds["turbine"] / 2.1, "axle": start.speeds["turbine"] / 7.35}
    more = replace(start, speeds={**start.speeds, **behind})
    problem, _, _ = build_problem(replace(made.model, start=more), [made.recording])
    assert problem.terms[0].plant.own == ["engine", "turbine", "wheel", "half shafts"]


def test_the_delay_of_an_input_leaves_the_start_of_a_node_of_its_name_unknown() -> None:
    model, recording = make_small({"delay.motor": Unknown(0.0, 0.01)})
    named = replace(
        model,
        elements=[{**one, "input": "motor"} if "input" in one else one for one in model.elements],
    )
    inputs = {"motor": recording.inputs["torque"]}
    problem, _, _ = build_problem(named, [replace(recording, inputs=inputs)])
    assert "motor" in problem.terms[0].plant.own


def test_a_bounded_delay_costs_no_more_of_the_recording_than_its_bounds() -> None:
    spans = []
    for bounds in ((None, None), (-0.02, 0.02)):
        model, recording = make_small({"delay.torque": Unknown(0.0, 0.03, bounds)})
        problem, _, _ = build_problem(model, [recording])
        spans.append(float(np.ptp(problem.terms[0].record.time)))
    assert spans[1] - spans[0] == pytest.approx(2.0 * (0.15 - 0.02), abs=0.02)

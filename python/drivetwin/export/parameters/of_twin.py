# SPDX-License-Identifier: MIT
"""The parameters of a twin, as its files name them, Simscape Driveline's names included.

The mapping of variables to block fields is in docs/reference/parameter-files.md.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np
from scipy.constants import zero_Celsius

from drivetwin.calibration.calibrate import Calibration
from drivetwin.calibration.maneuver import ClosedLoop, OperatingPoint
from drivetwin.calibration.operating_map import OperatingMap
from drivetwin.calibration.policy import PolicyParameter
from drivetwin.estimation.result.estimate import Estimate
from drivetwin.export.parameters.content import (
    Axis,
    Curve,
    ParameterSet,
    Scalar,
    choose_unit,
    to_one_line,
)
from drivetwin.export.targets import Names
from drivetwin.parameters import FINAL_DRIVE, OVER_ETA, get_parameter_spec, make_ratio_id
from drivetwin.simulation.added_elements import Converter
from drivetwin.simulation.dual_clutch import FloatArray, FrictionTable, Signal, Stribeck
from drivetwin.twin.twin import Twin, TwinElement, build_friction_law

_CURVES = {
    "engine_torque": ("N*m", "engine torque demand"),
    "pressure.offgoing": ("Pa", "pressure of the off-going element, at the clutch"),
    "pressure.oncoming": ("Pa", "pressure of the on-coming element, at the clutch"),
}
"""Units and meanings of the profiles."""


def collect_calibration(
    found: Calibration, name: str, mapped: OperatingMap | None = None
) -> ParameterSet:
    """Collect the policy's parameters, and the profiles over the time from the request [s].

    Of a map each parameter is a curve over the engine speed for each engine torque, and for each
    oil temperature if the map has an axis of it.
    """
    task = found.task
    values = zip(task.policy.parameters, found.after.values.tolist(), strict=True)
    request = task.maneuver.request
    return ParameterSet(
        name=name,
        scalars=tuple(
            Scalar(one.name, value, one.unit, one.text, *_describe_range(one))
            for one, value in values
        ),
        curves=tuple(
            _build_curve(f"profile.{label}", signal, request, _CURVES[label])
            for label, signal in found.after.profiles.signals.items()
        )
        + (() if mapped is None else tuple(_iterate_map_curves(mapped))),
        notes=(
            f"engine torque {task.maneuver.point.engine_torque:.6g} N*m, engine speed "
            f"{task.maneuver.point.engine_speed:.6g} rad/s at the request",
            _describe_pressures(found),
        ),
    )


_FINE = 1e-4
"""Resolution of a parameter over its range: half of the last step of a polish."""


def _describe_range(one: PolicyParameter) -> tuple[float, tuple[float, float]]:
    """Return resolution and bounds of a parameter."""
    return _FINE * (one.high - one.low), (one.low, one.high)


def _describe_pressures(found: Calibration) -> str:
    if isinstance(found.after.control, ClosedLoop):
        return (
            "pressures of parameters are commands of the controller; profiles are those at the "
            "clutches of the nominal unit"
        )
    return (
        "pressures are those at the clutch, not commands: dead time, lag and filling of the "
        "actuator are not subtracted"
    )


def _iterate_map_curves(mapped: OperatingMap) -> Iterator[Curve]:
    grid = mapped.grid
    axis = Axis("engine_speed", grid.speeds, "rad/s")
    columns = sorted({(place[0], *place[2:]) for place in mapped.points})
    for k, one in enumerate(mapped.main.task.policy.parameters):
        for torque, *oil in columns:
            points = [mapped.points[torque, j, *oil] for j in range(len(grid.speeds))]
            values = tuple(float(each.found.values[k]) for each in points)
            label, text = _name_column(points[0].task.maneuver.point)
            labels = one.unit, f"{one.text}, {text}"
            yield Curve(f"map.{one.name}.{label}", axis, values, *labels, *_describe_range(one))


def _name_column(point: OperatingPoint) -> tuple[str, str]:
    """Return label and words of the torque and oil temperature of a column of a map."""
    torque, kelvin = point.engine_torque, point.oil_temperature
    label, text = f"{torque:.0f}_Nm", f"at {torque:.6g} N*m"
    if kelvin is not None:
        label += f".{kelvin - zero_Celsius:.0f}_degC"
        text += f" and oil at {kelvin:.6g} K"
    return label.replace("-", "minus_"), text


def _build_curve(name: str, signal: Signal, request: float, labels: tuple[str, str]) -> Curve:
    times = tuple((signal.time - request).tolist())
    fine = _FINE * float(np.ptp(signal.values))
    return Curve(name, Axis("time", times, "s"), tuple(signal.values.tolist()), *labels, fine)


_RENAMED = {
    "i_in": "ratio_input",
    "i_f": "ratio_final_drive",
    "k_o": "k_shaft",
    "c_o": "b_shaft",
    "J_out": "J_output",
}
_CLUTCH_FIELDS = ("gain", "P0", "peak", "mu_c", "mu_s", "v_s", "mu_v")
"""Parameters that blocks state in another way: the geometry, and the friction law as a table."""


def convert_to_simscape_blocks(own: ParameterSet, elements: tuple[str, ...]) -> ParameterSet:
    """Convert a set to Simscape blocks: each clutch of `elements` as a Disc Friction Clutch.

    Only the product of surfaces, de-rating, area and radius is known of a clutch. It is written
    as the piston area, with one surface and an effective radius of 1 m. The static coefficient is
    peak · μ(0).
    """
    consumed = {f"{field}.{name}" for field in _CLUTCH_FIELDS for name in elements}
    kept = [one for one in own.scalars if one.name not in consumed]
    return replace(
        own,
        scalars=(
            *(replace(one, name=_RENAMED.get(one.name, one.name)) for one in kept),
            *(one for name in elements for one in _convert_clutch(own, name)),
        ),
        curves=tuple(_convert_curve(one) for one in own.curves),
    )


def _convert_clutch(own: ParameterSet, name: str) -> tuple[Scalar, ...]:
    values = {one.name: one for one in own.scalars}
    area, pressure = values[f"gain.{name}"], values[f"P0.{name}"]
    geometry = (
        Scalar(f"Ndisc.{name}", 1.0, "1", "number of friction surfaces; in the piston area"),
        Scalar(f"Reff.{name}", 1.0, "m", "effective torque radius; in the piston area"),
        Scalar(f"Aeff.{name}", area.value, "m^2", f"engagement piston area; {area.text}"),
        replace(pressure, name=f"P_eng.{name}"),
    )
    curve = next((one for one in own.curves if one.name == f"mu.{name}"), None)
    if curve is None:
        return geometry
    static = values[f"peak.{name}"].value * curve.values[0]
    text = "static friction coefficient: peak x kinetic one at zero slip"
    return (*geometry, Scalar(f"mu_s.{name}", static, "1", text))


def _convert_curve(curve: Curve) -> Curve:
    if curve.name.startswith("mu."):
        return replace(
            curve,
            name=f"mu_k.{curve.name.removeprefix('mu.')}",
            axis=replace(curve.axis, name="w_slip"),
        )
    axis = replace(curve.axis, name="speed_ratio")
    if curve.name == "converter.torque_ratio":
        return replace(curve, name="tc_torque_ratio", axis=axis)
    return _compute_capacity_factor(curve, axis)


def _compute_capacity_factor(capacity: Curve, axis: Axis) -> Curve:
    """Speed over root of torque, which is how the block states it; finite below ν = 1 only."""
    drive = [
        (ratio, value)
        for ratio, value in zip(axis.points, capacity.values, strict=True)
        if value > 0
    ]
    return Curve(
        "tc_capacity_factor",
        replace(axis, points=tuple(ratio for ratio, _ in drive)),
        tuple(value**-0.5 for _, value in drive),
        "rad/(s*N^0.5*m^0.5)",
        "pump speed over root of pump torque; drive only, where the torque is positive",
    )


POINTS = 33
"""Points of a curve drawn from a law, denser towards zero slip where it bends: linear interpolation
between them stays within 0.1 % of μ, unless stiction adds more than 85 % to it."""
BENDS = 8.0
"""Slips in v_s beyond which a law is as good as straight: of its stiction 3e-4 are left."""

DESIGN_FIELDS = {
    "i_c": ("1", "ratio between input gear and clutch (eq. 15)"),
    "i_out": ("1", "ratio between clutch and output (eq. 15)"),
    "gain": ("m^3", "friction surfaces x de-rating x area x effective radius (eq. 5)"),
    "P0": ("Pa", "pressure at which the clutch fill ends"),
    "peak": ("1", "static over kinetic capacity at zero slip"),
    "drum": ("kg*m^2", "inertia that turns with the slip"),
}
"""Fields of a shift element on the card: unit and meaning."""
LAW_FIELDS = {
    "mu_c": ("1", "friction coefficient at large slip"),
    "mu_s": ("1", "friction coefficient at zero slip"),
    "v_s": ("rad/s", "slip over which the difference decays"),
    "mu_v": ("s/rad", "rise of the friction coefficient with slip"),
}
"""Numbers of a friction law: unit and meaning."""


def collect_parameters(twin: Twin, names: Names = Names.DRIVETWIN) -> ParameterSet:
    """All numbers of a twin that are known, and μ over slip of its elements.

    Unidentified parameters have no entry and are listed in the notes. The map of a converter is
    that of the vehicle card.
    """
    own = ParameterSet(
        name=to_one_line(twin.name),
        scalars=(
            *_collect_estimates(twin.parameters),
            *_collect_load_terms(twin),
            *_collect_gearing(twin),
            *_collect_elements(twin),
            *_collect_laws(twin),
        ),
        curves=(
            *_collect_friction(twin),
            *(() if twin.converter is None else build_converter_curves(twin.converter)),
        ),
        notes=tuple(to_one_line(note) for note in _collect_notes(twin)),
    )
    return convert_to_simscape_blocks(own, tuple(twin.elements)) if names is Names.SIMSCAPE else own


def build_converter_curves(converter: Converter) -> tuple[Curve, Curve]:
    """Torque ratio and capacity over the speed ratio."""
    axis = Axis("speed_ratio", converter.speed_ratio)
    return (
        Curve(
            "converter.torque_ratio",
            axis,
            converter.torque_ratio,
            text="turbine torque over pump torque",
        ),
        Curve(
            "converter.capacity",
            axis,
            converter.capacity,
            "N*m*s^2/rad^2",
            "pump torque over pump speed squared",
        ),
    )


def collect_estimates(
    name: str, estimates: Mapping[str, Estimate], notes: Iterable[str]
) -> ParameterSet:
    """Collect the estimates of a result without a twin; those without a value are in the notes."""
    lines = (*notes, *_list_unvalued(estimates))
    return ParameterSet(
        name=to_one_line(name),
        scalars=tuple(_collect_estimates(estimates)),
        notes=tuple(map(to_one_line, lines)),
    )


def _collect_estimates(estimates: Mapping[str, Estimate]) -> Iterator[Scalar]:
    for estimate in estimates.values():
        if estimate.value is not None:
            yield Scalar(
                estimate.id,
                estimate.value,
                estimate.unit,
                to_one_line(_describe_estimate(estimate)),
            )


def _list_estimated(twin: Twin) -> set[str]:
    return {one.id for one in twin.parameters.values() if one.value is not None}


def _describe_estimate(estimate: Estimate) -> str:
    """Meaning, verdict and interval; that of a value of the card has no width and is left out."""
    spec = estimate.spec or get_parameter_spec(estimate.id)
    text = f"{spec.meaning}; {estimate.verdict.value}"
    low, high = estimate.ci95_total or (0.0, 0.0)
    unit, factor = choose_unit(estimate.unit)
    shown = "" if unit == "1" else f" {unit}"
    ends = f"{low * factor:.5g} .. {high * factor:.5g}{shown}"
    return f"{text}, 95 %: {ends}" if low < high else text


def _collect_load_terms(twin: Twin) -> Iterator[Scalar]:
    """Speed-dependent load terms, if they were estimated."""
    if (law := twin.load_law) is not None:
        over = ", over η" if law.over_eta else ""
        text = f"load torque at the wheel per speed squared, from mean_speed on{over}"
        yield Scalar("load.aero", law.aero, "N*m*s^2/rad^2", text)
        text = "speed of the wheel at which the load is that of Tv_over_if"
        yield Scalar("load.mean_speed", law.mean_speed, "rad/s", text)


def _collect_gearing(twin: Twin) -> Iterator[Scalar]:
    """Input gear, and the ratios without an estimate; an estimated one is among the estimates."""
    estimated = _list_estimated(twin)
    yield Scalar("i_in", twin.i_in, text="input gear")
    if FINAL_DRIVE not in estimated:
        yield Scalar(FINAL_DRIVE, twin.final_drive, text="final drive; design value")
    for name, gear in twin.gears.items():
        text = f"ratio of gear {name} without the input gear, held by {gear.element}; design value"
        if (key := make_ratio_id(name)) not in estimated:
            yield Scalar(key, gear.ratio / twin.i_in, text=to_one_line(text))


def _collect_elements(twin: Twin) -> Iterator[Scalar]:
    for name, element in twin.elements.items():
        yield from _build_design_scalar(name, element, twin)


def _build_design_scalar(name: str, element: TwinElement, twin: Twin) -> Iterator[Scalar]:
    estimated = _list_estimated(twin)
    for field, (unit, text) in DESIGN_FIELDS.items():
        key = f"{field}.{name}"
        if not estimated & {key, key + OVER_ETA}:
            yield Scalar(key, getattr(element, field), unit, f"{text}; design value")


def _collect_laws(twin: Twin) -> Iterator[Scalar]:
    for name, curve in twin.friction.items():
        law = {} if curve.stribeck is None else vars(curve.stribeck)
        for field, value in law.items():
            unit, text = LAW_FIELDS[field]
            over = ", over η" if curve.over_eta and field != "v_s" else ""
            text = f"{text}{over}; {curve.verdict.value}"
            yield Scalar(f"{field}.{name}", value, unit, text)


def _collect_friction(twin: Twin) -> Iterator[Curve]:
    for name, curve in twin.friction.items():
        law = build_friction_law(curve)
        text = f"friction coefficient of {name} over slip; {curve.verdict.value}"
        origin = curve.reason if curve.is_borrowed else curve.method_text
        points = _select_breakpoints(law, float(curve.slip[-1]))
        yield Curve(
            f"mu.{name}",
            Axis("slip", tuple(points.tolist()), "rad/s"),
            tuple(law.evaluate(points).tolist()),
            text=to_one_line(f"{text}, {origin}" if origin else text),
        )


def _select_breakpoints(law: Stribeck | FrictionTable, last: float) -> FloatArray:
    """Slips (n,) [rad/s] at which a curve gives the law: those of a table, or from 0 to `last`."""
    if hasattr(law, "slip"):
        return np.asarray(law.slip, dtype=np.float64)
    bent = BENDS * law.v_s
    if last <= bent:
        return np.asarray(last * np.linspace(0.0, 1.0, POINTS) ** 2, dtype=np.float64)
    return np.append(bent * np.linspace(0.0, 1.0, POINTS - 1) ** 2, last)


def _collect_notes(twin: Twin) -> Iterator[str]:
    yield f"drivetwin {twin.version}, method {twin.method.value}, loss law {twin.loss_law}"
    for name, digest in twin.inputs.items():
        yield f"from {name}, SHA-256 {digest}"
    yield from _list_unvalued(twin.parameters)
    yield from twin.assumptions


def _list_unvalued(estimates: Mapping[str, Estimate]) -> Iterator[str]:
    for estimate in estimates.values():
        if estimate.value is None:
            yield f"no value of {estimate.id}: {estimate.reason or estimate.verdict.value}"

# SPDX-License-Identifier: MIT
"""Clutches, shaft and converter under the names that Simscape Driveline models use.

The mapping of variables to block fields is in docs/reference/parameter-files.md.
"""

from __future__ import annotations

from dataclasses import replace

from drivetwin.export.parameters.content import Axis, Curve, ParameterSet, Scalar

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

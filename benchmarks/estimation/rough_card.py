# SPDX-License-Identifier: MIT
"""Vehicle cards as people write them: rounded or cut ratios, values off by their error."""

from __future__ import annotations

from decimal import ROUND_DOWN, ROUND_HALF_EVEN, Decimal

import numpy as np
import tomlkit

from benchmarks.estimation.vehicles import build_tolerances
from drivetwin.channels.units import BAR
from drivetwin.dyno.scenario import Scenario
from drivetwin.simulation.dual_clutch import ShiftElement

FILL_STD = 0.1
"""Error of a bare P0 [bar]."""
INERTIA_STD = 0.1
"""Relative error of a bare inertia."""
DIGITS = (2, 5)
"""Least and greatest number of digits of a ratio after the point."""
WITH_STD = 0.5
"""Share of pressures and inertias that are written with a standard deviation."""
GAIN_WITH_STD = 0.3
"""Share of cards with a standard deviation of the gains; people seldom have one."""
DRIVE_WITH_STD = 0.2
"""Share of final drives that are written with a standard deviation."""
GAIN_STDS = (0.03, 0.05, 0.2)
"""Relative standard deviations of a gain: from a drawing, the same with a worn edge, a guess."""
DRIVE_STDS = (5e-5, 1e-3)
"""Least and greatest relative standard deviation of a final drive."""
BARE_GAIN = 4
"""Significant digits of a bare gain."""


def write_ratio(value: float, digits: int, *, cut: bool) -> str:
    """Write a ratio with `digits` after the point, rounded or cut; zeros at its end stay."""
    way = ROUND_DOWN if cut else ROUND_HALF_EVEN
    return str(Decimal(value).quantize(Decimal(1).scaleb(-digits), rounding=way))


def draw_ratio_text(rng: np.random.Generator, value: float, factor: float = 1.0) -> str:
    """Draw the text of a ratio.

    A `factor` of 2 draws its error from two units of the last digit to either side, where one unit
    is usual.
    """
    digits = int(rng.integers(DIGITS[0], DIGITS[1] + 1))
    cut, error = bool(rng.uniform() < 0.5), float(rng.uniform(-1.0, 1.0))
    if factor == 1.0:
        return write_ratio(value, digits, cut=cut)
    return write_ratio(value + factor * error * 10.0**-digits, digits, cut=False)


def write_card(seed: int, scenario: Scenario, *, factor: float = 1.0, tolerances: bool) -> str:
    """Write the card of a scenario as TOML.

    Parameters
    ----------
    seed
        Seed of digits, errors and forms.
    scenario
        The vehicle with its true values.
    factor
        Factor of all errors; the written standard deviations stay.
    tolerances
        State the tolerances of the sensors.

    Returns
    -------
    str
        Text of the card; bare gains are right to their last digit, because a log determines
        friction for the gain on the card alone.
    """
    rng = np.random.default_rng([seed, 53])
    model = scenario.model
    drive = draw_ratio_text(rng, model.i_f, factor)
    if rng.uniform() < DRIVE_WITH_STD:
        spread = float(np.exp(rng.uniform(*np.log(DRIVE_STDS))))
        drive = _draw_stated(rng, model.i_f, factor, spread * model.i_f, digits=8)
    lines = [
        f'name = "vehicle {seed}"',
        f'loss_law = "{model.loss_law}"',
        f"i_in = {model.i_in!r}",
        f"final_drive = {drive}",
    ]
    for gear in sorted(scenario.gears, key=lambda one: -scenario.get_ratio(one.element)):
        ratio = draw_ratio_text(rng, scenario.get_ratio(gear.element) / model.i_in, factor)
        lines += ["", "[[gears]]", f'name = "{gear.name}"', f"ratio = {ratio}"]
        lines.append(f'elements = ["{gear.element}"]')
    has_std = bool(rng.uniform() < GAIN_WITH_STD)
    for element in model.elements:
        lines += ["", *_write_element(rng, element, factor, has_std=has_std)]
    lines += [
        "",
        "[inertia]",
        f"J_prime_kgm2 = {_write_range(scenario.J_prime_range)}",
        f"J_vehicle_kgm2 = {_write_range(scenario.J_vehicle_range)}",
        f"J_out_kgm2 = {_draw_inertia(rng, model.J_out, factor)}",
        "",
    ]
    sensors = tomlkit.dumps({"sensors": build_tolerances(scenario)}) if tolerances else ""
    return "\n".join(lines) + sensors


def _write_element(
    rng: np.random.Generator, element: ShiftElement, factor: float, *, has_std: bool
) -> list[str]:
    """Write the table of a brake."""
    spread = float(rng.choice(GAIN_STDS)) * element.gain
    stated = _draw_stated(rng, element.gain, factor, spread)
    gain = stated if has_std else f"{element.gain:.{BARE_GAIN}g}"
    P0 = element.P0 / BAR
    error = float(rng.uniform(0.03, 0.1)) if rng.uniform() < WITH_STD else 0.0
    bare = max(P0 + factor * FILL_STD * float(rng.standard_normal()), 0.0)
    lines = [
        f"[elements.{element.name}]",
        'kind = "brake"',
        f"gain_m3 = {gain}",
        f"peak = {element.peak!r}",
        f"P0_bar = {_draw_stated(rng, P0, factor, error) if error else f'{bare:.2f}'}",
    ]
    if element.drum_inertia > 0.0:
        lines.append(f"drum_inertia_kgm2 = {_draw_inertia(rng, element.drum_inertia, factor)}")
    return lines


def _draw_inertia(rng: np.random.Generator, value: float, factor: float) -> str:
    """Draw the text of an inertia [kg m^2], bare or with a standard deviation."""
    if rng.uniform() < WITH_STD:
        return _draw_stated(rng, value, factor, float(rng.uniform(0.05, 0.15)) * value)
    return f"{value * max(1.0 + factor * INERTIA_STD * float(rng.standard_normal()), 0.1):.3g}"


def _draw_stated(
    rng: np.random.Generator, value: float, factor: float, std: float, digits: int = 5
) -> str:
    """Draw a value about the true one and write it with its standard deviation."""
    drawn = max(value + factor * std * float(rng.standard_normal()), 0.1 * value)
    return f"{{ value = {drawn:.{digits}g}, std = {std:.2g} }}"


def _write_range(limits: tuple[float, float]) -> str:
    return f"[{limits[0]:.3g}, {limits[1]:.3g}]"

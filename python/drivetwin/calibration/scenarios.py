# SPDX-License-Identifier: MIT
"""Scenarios: drivelines and actuators drawn from identified covariance and production scatter.

All profiles of one search run through the same draws (common random numbers), so that differences
of their metrics are differences of the profiles. Draws are designed: points of a scrambled Sobol
sequence as normal numbers. Few of them stand for the spread far better than few random ones: a mean
over n has an error near 1/n in place of 1/√n. Source: A. Owen, Scrambling Sobol' and
Niederreiter-Xing points, J. Complexity 14 (1998).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import qmc

from drivetwin._util.arrays import FloatArray, compute_directions
from drivetwin.actuator.model import QUANTITIES, ActuatorModel, IdentifiedActuator
from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.spread import SAME_OIL, OilState, Spread
from drivetwin.errors import InputError
from drivetwin.parameters import OVER_ETA
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.driveline import SHAFT, Driveline, build_driveline
from drivetwin.simulation.dual_clutch import DualClutch
from drivetwin.simulation.shift_control import ControlledUnit, Sensors
from drivetwin.twin.distribution import ModelDistribution, describe_model
from drivetwin.twin.twin import Twin

_DIMENSIONS = 64
"""Normal numbers of a unit that are designed: more than a twin has. Further ones are random."""


class DesignedNormals(np.random.Generator):
    """Generator whose normal numbers are the `row` (n,) of a design, then random by `seed`."""

    def __init__(self, row: FloatArray, seed: list[int]) -> None:
        super().__init__(np.random.PCG64(seed))
        self._row = row.tolist()[::-1]

    def standard_normal(self, size: Any = None, *_: Any, **__: Any) -> Any:
        """Return the next numbers of the design."""
        if size is None:
            return self._row.pop() if self._row else super().standard_normal()
        return np.array([self.standard_normal() for _ in range(int(np.prod(size)))]).reshape(size)

    def normal(self, loc: Any = 0.0, scale: Any = 1.0, size: Any = None) -> Any:
        """Return the next numbers of the design with a mean and a standard deviation."""
        return loc + scale * self.standard_normal(size)


def list_designed(count: int, seed: list[int]) -> list[np.random.Generator]:
    """List the generators of `count` units; a power of two makes the design even."""
    rows = design_normals(count, _DIMENSIONS, np.random.default_rng(seed))
    return [DesignedNormals(row, [*seed, k]) for k, row in enumerate(rows)]


def design_normals(count: int, dimensions: int, random: np.random.Generator) -> FloatArray:
    """Return designed normal numbers (count, dimensions), scrambled by `random`."""
    sobol = qmc.Sobol(dimensions, seed=random)
    return np.asarray(ndtri(sobol.random_base2(max(0, (count - 1).bit_length()))[:count]))


MakeActuators = Callable[[np.random.Generator], ControlledUnit]
"""Makes the actuators of a unit."""
DrawActuators = Callable[[np.random.Generator], MakeActuators]
"""Draws a type of actuators that the identified ones may be."""

_DEAD_TIMES = (0.25, 2.0)
"""Range of drawn dead times, over the nominal one."""


@dataclass(frozen=True, eq=False)
class UnitDraws:
    """Draws of actuators with identified values, and of the engine's lag [s] around `engine_lag`.

    Parameters that the twin's log does not determine stay at their assumed values. Each unit has
    the `sensors` with a noise of its own.
    """

    offgoing: IdentifiedActuator
    oncoming: IdentifiedActuator
    engine_lag: float
    spread: Spread
    sensors: Sensors | None = None

    @property
    def nominal(self) -> ControlledUnit:
        """Nominal unit."""
        return ControlledUnit(self.offgoing.model, self.oncoming.model, self.engine_lag)

    def __call__(self, random: np.random.Generator) -> MakeActuators:
        """Draw a type within the identified covariance."""
        identified = ControlledUnit(
            _draw_actuator(self.offgoing, random),
            _draw_actuator(self.oncoming, random),
            self.engine_lag,
        )

        def make(random: np.random.Generator) -> ControlledUnit:
            unit = scale_unit(identified, self.spread, random)
            if self.sensors is None:
                return unit
            return replace(unit, sensors=replace(self.sensors, seed=int(random.integers(2**53))))

        return make


def scale_unit(unit: ControlledUnit, spread: Spread, random: np.random.Generator) -> ControlledUnit:
    """Draw a made unit around `unit`: dead time and lags common to both clutches, fill of each."""
    late = spread.dead_time * float(random.standard_normal())
    slow = float(np.exp(spread.actuator_lag * random.standard_normal()))
    engine = float(np.exp(spread.engine_lag * random.standard_normal()))

    def scale(model: ActuatorModel) -> ActuatorModel:
        kiss = spread.kiss_pressure * float(random.standard_normal())
        fill = float(np.exp(spread.fill_time * random.standard_normal()))
        least, largest = (model.dead_time * one for one in _DEAD_TIMES)
        return _limit(
            model,
            dead_time=min(max(model.dead_time + late, least), largest),
            rising_lag=slow * model.rising_lag,
            falling_lag=slow * model.falling_lag,
            kiss_pressure=model.kiss_pressure + (kiss if model.fill_time > 0.0 else 0.0),
            fill_time=fill * model.fill_time,
        )

    return ControlledUnit(scale(unit.offgoing), scale(unit.oncoming), engine * unit.engine_lag)


def _draw_actuator(one: IdentifiedActuator, random: np.random.Generator) -> ActuatorModel:
    finite = np.isfinite(one.std)
    directions = compute_directions(np.where(np.outer(finite, finite), one.covariance, 0.0))
    drawn = one.model.values + directions @ random.standard_normal(directions.shape[1])
    return ActuatorModel.from_values(_clip(drawn))


def _limit(model: ActuatorModel, **changed: float) -> ActuatorModel:
    values = {name: changed.get(name, getattr(model, name)) for name in QUANTITIES}
    return ActuatorModel.from_values(_clip(np.array(list(values.values()))))


def _clip(values: FloatArray) -> FloatArray:
    low = [one.lower for one in QUANTITIES.values()]
    high = [one.upper for one in QUANTITIES.values()]
    return np.clip(values, low, high)


_TRIES = 20
"""Draws per scenario after which a covariance counts as too wide."""
_DESIGN = (".ratio", ".drum_inertia")
"""Endings of numbers that all units share with the nominal driveline."""


_T = TypeVar("_T")


class Purpose(IntEnum):
    """Use of a set of draws; each has a stream of random numbers of its own."""

    SEARCH = 1
    POLISH = 2
    TAIL = 3
    CERTIFICATE = 4
    CHECK = 5
    PROMISE = 6


MakeDriveline = Callable[[np.random.Generator], Driveline]
"""Makes a unit of a vehicle type."""
DrawDriveline = Callable[[np.random.Generator], MakeDriveline | None]
"""Draws a vehicle type that the twin may stand for; None where the draw is impossible."""


@dataclass(frozen=True, eq=False)
class Scenarios:
    """Drivelines as parameter sets of one batch: values (runs,) by path.

    `units` are the actuators of each; empty where the control is given at the clutches.
    """

    sets: Mapping[str, FloatArray]
    count: int
    units: Sequence[ControlledUnit] = ()

    def select(self, part: slice | NDArray[np.bool_] | NDArray[np.intp]) -> Scenarios:
        """Return a part of the scenarios."""
        places = np.arange(self.count)[part]
        sets = {name: values[part] for name, values in self.sets.items()}
        return Scenarios(sets, places.size, [self.units[k] for k in places if self.units])

    def join(self, more: Scenarios) -> Scenarios:
        """Return these scenarios and `more` of the same driveline."""
        sets = {name: np.concatenate([one, more.sets[name]]) for name, one in self.sets.items()}
        return Scenarios(sets, self.count + more.count, [*self.units, *more.units])


@dataclass(frozen=True)
class Draw:
    """Draws of the driveline, and of its actuators where these are simulated.

    Both have two stages: a type within the uncertainty of the twin, then a made unit of it.
    """

    driveline: DrawDriveline
    actuators: DrawActuators | None = None


def draw_scenarios(
    maneuver: Maneuver, draw: Draw, count: int, seed: int, purpose: Purpose
) -> Scenarios:
    """Draw `count` units, each of a type of its own, with steady starts.

    Draws of the optimiser are designed, all others random. An impossible unit (an inertia below
    zero) is replaced by a random one. Raises InputError where most draws are impossible.
    """
    random = np.random.default_rng([seed, int(purpose)])
    designed = purpose in (Purpose.SEARCH, Purpose.POLISH, Purpose.TAIL)
    sources = iter(list_designed(count, [seed, int(purpose)]) if designed else ())

    def make() -> Driveline | None:
        source = next(sources, random)
        unit = draw.driveline(source)
        made = None if unit is None else unit(source)
        return made if made is not None and is_possible(made.model) else None

    drawn = collect_scenarios(maneuver, _repeat(make, count))
    if draw.actuators is None:
        return drawn
    own = np.random.default_rng([seed, int(purpose), 1])
    return replace(drawn, units=[draw.actuators(own)(own) for _ in range(count)])


def draw_types(maneuver: Maneuver, draw: Draw, types: int, units: int, seed: int) -> Scenarios:
    """Draw `types` vehicle types and `units` made units of each, those of a type in sequence.

    The units of all types have the same random numbers: differences between types are then those
    of the types. Raises InputError as `draw_scenarios` does.
    """
    random = np.random.default_rng([seed, int(Purpose.PROMISE)])
    own = np.random.default_rng([seed, int(Purpose.PROMISE), 1])
    drivelines: list[Driveline] = []
    made: list[ControlledUnit] = []
    for _ in range(types):
        drivelines += _repeat(lambda: _make_units(draw, random, units, seed), 1)[0]
        if draw.actuators is not None:
            unit = draw.actuators(own)
            same = np.random.default_rng([seed, int(Purpose.PROMISE), 3])
            made += [unit(same) for _ in range(units)]
    return replace(collect_scenarios(maneuver, drivelines), units=made)


def _make_units(
    draw: Draw, random: np.random.Generator, count: int, seed: int
) -> list[Driveline] | None:
    """Draw a type and `count` units of it; None where one of them is impossible."""
    unit = draw.driveline(random)
    if unit is None:
        return None
    same = np.random.default_rng([seed, int(Purpose.PROMISE), 2])
    made = [unit(same) for _ in range(count)]
    return made if all(is_possible(one.model) for one in made) else None


def _repeat(make: Callable[[], _T | None], count: int) -> list[_T]:
    """Return `count` possible draws. Raises InputError where most draws are impossible."""
    found: list[_T] = []
    for _ in range(_TRIES * count):
        if len(found) == count:
            break
        one = make()
        if one is not None:
            found.append(one)
    if len(found) < count:
        raise InputError(
            f"{len(found)} of {_TRIES * count} drawn drivelines are possible",
            "identify from more logs, or fix weak parameters on the vehicle card: the intervals "
            "of the twin reach impossible values",
        )
    return found


def collect_scenarios(maneuver: Maneuver, drivelines: Sequence[Driveline]) -> Scenarios:
    """Collect drivelines as parameter sets; numbers that are equal in all are left out.

    The start of each is its own steady acceleration: its shaft twist is a parameter too. Ratios,
    drums, axes of tables and a linear tyre are those of the maneuver.
    """
    base = _describe(maneuver, maneuver.driveline)
    tables = [_describe(maneuver, one.share_form(maneuver.added)) for one in drivelines]
    sets = {
        path: np.array([table[path] for table in tables])
        for path, value in base.items()
        if path == f"start.{SHAFT}" or any(table[path] != value for table in tables)
    }
    return Scenarios(sets, len(drivelines))


def _describe(maneuver: Maneuver, driveline: Driveline) -> dict[str, float]:
    """Return the numbers of elements and start that can differ between units, by path."""
    start = maneuver.build_network_start(driveline)
    own = {
        path: value
        for one in build_driveline(driveline.model, driveline.added)
        for path, value in _iterate_numbers(one["name"], one)
        if not path.endswith(_DESIGN)
    }
    return own | {f"start.{name}": one for name, one in {**start.speeds, **start.twists}.items()}


def _iterate_numbers(path: str, described: object) -> Iterator[tuple[str, float]]:
    """Yield the numbers of a description with their paths."""
    if isinstance(described, int | float):
        yield path, described
    elif isinstance(described, dict):
        for key, one in described.items():
            if not isinstance(one, str):
                yield from _iterate_numbers(f"{path}.{key}", one)
    elif isinstance(described, list | tuple):
        for place, one in enumerate(described):
            yield from _iterate_numbers(f"{path}.{place}", one)


def is_possible(model: DualClutch) -> bool:
    """Return whether the core can run a driveline: inertias, stiffness and gains above zero."""
    above = (model.J1, model.J_out, model.J_v, model.k_o, model.eta)
    gains = [one.gain for one in model.elements]
    return min(*above, *gains) > 0.0 and model.c_o >= 0.0 and np.isfinite(above).all().item()


def scale_units(model: DualClutch, spread: Spread, random: np.random.Generator) -> DualClutch:
    """Draw a made unit around `model`: gains, contact pressure, and scale of the engine torque.

    A scale s of the engine torque is η·s with J1/s: the torque at the gears is the same. By the
    dissipative law this holds while the engine drives.
    """
    gains = random.normal(1.0, spread.gain, 2) if spread.gain else np.ones(2)
    scale = float(random.normal(1.0, spread.engine_torque))
    contact = float(random.normal(0.0, spread.contact_pressure))
    old, new = model.elements
    return replace(
        model,
        eta=model.eta * scale,
        J1=model.J1 / scale,
        elements=(
            replace(old, gain=old.gain * float(gains[0]), P0=old.P0 + contact),
            replace(new, gain=new.gain * float(gains[1]), P0=new.P0 + contact),
        ),
    )


@dataclass(frozen=True, eq=False)
class TwinDraws:
    """Draws of a twin: parameters and friction laws by their joint covariance, and made units.

    Elements beside the dual clutch are drawn too; parameters without an interval keep their values.

    The covariance is the total one, with sensor tolerances and effects. The friction is that of
    `oil`, by a slope of each type and a temperature of each unit.
    """

    twin: Twin
    shift: Shift
    spread: Spread
    oil: OilState = SAME_OIL

    def __call__(self, random: np.random.Generator) -> MakeDriveline | None:
        """Draw a type; None where it is impossible."""
        known = self._known
        values = known.draw(random, known.directions)
        model = known.draw_model(values, random)
        if model is None:
            return None
        slope = self.oil.draw_slope(random)

        def make(random: np.random.Generator) -> Driveline:
            more = self.spread.oil_temperature * float(random.standard_normal())
            unit = scale_units(self.oil.warm(model, slope, more), self.spread, random)
            return Driveline(unit, self.twin.build_added_elements(unit, known.to_named(values)))

        return make

    @cached_property
    def _known(self) -> ModelDistribution:
        return describe_model(self.twin, self.shift, self.drawn_ids)

    @cached_property
    def drawn_ids(self) -> list[str]:
        """Ids of the covariance that the driveline of the shift depends on."""
        twin, used = (
            self.twin,
            {*self.twin.list_model_ids(self.shift), *self.twin.added_element_values},
        )
        gear = twin.select_inertia_gear(self.shift)
        used -= {name for name in used if name.startswith("J_prime_")}
        used.add(f"J_prime_{gear}")
        return [
            one
            for one in twin.covariance_ids
            if one.removesuffix(OVER_ETA) in used and twin.parameters[one].value is not None
        ]

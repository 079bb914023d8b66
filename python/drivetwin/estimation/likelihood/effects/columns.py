# SPDX-License-Identifier: MIT
"""Columns of all effects at a point of the unknowns, scaled to a prior of unit variance.

Gain, offset and delay errors of sensors as stated on the card.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.roles import get_pressure_element
from drivetwin.estimation.data.shift_data import KnownDriveline
from drivetwin.estimation.likelihood.effects.effect import (
    Disturbance,
    OperatingPoint,
    evaluate_operating_point,
)
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.estimation.likelihood.parametrization import DualClutchProblem
from drivetwin.estimation.likelihood.torque_record import TORQUE, get_columns
from drivetwin.estimation.result.cause import Group
from drivetwin.likelihood.point import (
    ParameterVector,
    place_columns,
    scale_columns,
    select_columns,
)
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.vehicle.effects import EffectId, EffectPrior
from drivetwin.vehicle.spec import SensorTolerance


def build_sensor_columns(
    at: OperatingPoint, tolerances: Mapping[str, SensorTolerance]
) -> Iterator[Disturbance]:
    """Build one column for each stated tolerance, its size one standard deviation.

    The subject is `<role> gain`, `<role> offset` or `<role> delay`; a sensor that the fit does not
    use has none. An error of an output is that of the simulated signal: measured samples would
    carry their own noise into the score.
    """
    for role, tolerance in tolerances.items():
        for kind, size in asdict(tolerance).items():
            found = _build_column(at, role, kind, size) if size else None
            if found is not None:
                yield found


def _build_column(at: OperatingPoint, role: str, kind: str, size: float) -> Disturbance | None:
    """Build the column of one error; None for a sensor that is not used."""
    output = "engine_speed" if role == "input_speed" else role
    source = TORQUE if role == "engine_torque" else get_pressure_element(role)
    subject = f"{role} {kind}"
    if output in (one.name for one in at.record.outputs):
        run, ones = get_columns(at.run)[output], np.ones(at.run.time.size)
        changes = {"gain": run, "offset": ones, "delay": -np.gradient(run, at.run.time)}
        return Disturbance(subject, outputs={output: size * changes[kind]})
    if source is None or source not in (TORQUE, *at.record.pressures):
        return None
    if source == TORQUE:
        values = at.engine_torque
        delay = at.term.plant.get_value(at.point, "te_delay")
        steady = at.record.engine_torque
        rate = at.compute_rate(np.interp(at.run.time + delay, steady.time, steady.values))
    else:
        signal = at.record.pressures[source]
        values = np.interp(at.middle, signal.time, signal.values)
        rate = at.compute_rate(np.interp(at.run.time, signal.time, signal.values))
    change = {"gain": -values, "offset": -np.ones(at.middle.size), "delay": rate}[kind]
    return Disturbance(subject, inputs={source: size * change})


CURVED_AMOUNTS = (0.05, 5.0)
"""Magnitudes of the amount, of the stated size, between which the column of a curved effect is
computed."""


CURVED_STEP = 0.05
"""Relative change of that amount for the slope of the column."""


@dataclass(frozen=True, eq=False)
class EffectPriors:
    """Statements of the card on effects and sensors; what is not stated has the default prior."""

    effects: Mapping[EffectId, EffectPrior] = field(default_factory=dict)
    sensors: Mapping[str, SensorTolerance] = field(default_factory=dict)

    def get_prior(self, effect: EffectId, driveline: KnownDriveline) -> EffectPrior:
        """Return the prior of an effect in its unit in a shift.

        Stated efficiencies of both gears are the default prior of their difference.
        """
        change = driveline.eta_change
        if effect is EffectId.EFFICIENCY_BY_GEAR and change and effect not in self.effects:
            return EffectPrior(change.std, change.value)
        return self.effects.get(effect, EffectPrior(EFFECTS[effect].std))

    @property
    def excluded(self) -> set[EffectId]:
        """Effects that the card states as absent."""
        return {name for name, one in self.effects.items() if not (one.std or one.value)}

    def drop_statements(self, effects: Collection[EffectId]) -> EffectPriors:
        """Return the statements without those on some effects, which get their default priors."""
        kept = {name: one for name, one in self.effects.items() if name not in effects}
        return EffectPriors(kept, self.sensors)

    def drop_effects(self) -> EffectPriors:
        """Return the statements on sensors with all effects off."""
        return EffectPriors({one: EffectPrior(0.0) for one in EffectId}, self.sensors)


@dataclass(frozen=True, eq=False)
class InputColumns:
    """Changes (N-1, q) of one input by the columns, at `time` (N-1,)."""

    time: FloatArray
    matrix: FloatArray

    def select(self, columns: list[int]) -> InputColumns:
        """Return some of the columns."""
        return InputColumns(self.time, select_columns(self.matrix, columns))


@dataclass(frozen=True, eq=False)
class EffectColumns:
    """Columns of the effects: change of the compared samples per prior standard deviation.

    `groups` (q,) is the group of each column, `matrices` (n, q) one for each shift. `known` (n,)
    are the changes by the stated values of effects, by shift.
    """

    groups: tuple[Group, ...]
    matrices: tuple[FloatArray, ...]
    known: tuple[FloatArray, ...]
    scale: FloatArray
    """Prior standard deviation (q,) of each column's amount, in stated ones."""
    inputs: tuple[Mapping[str, InputColumns], ...]
    """Changes of the inputs by the columns, by name, for each shift."""
    stds: Mapping[Group, float] = field(default_factory=dict)
    """Stated standard deviation of each effect in its unit."""

    def compute_inputs(self, amounts: FloatArray) -> list[dict[str, Signal]]:
        """Compute the changes of the inputs by name for `amounts` (q,), for each shift."""
        return [
            {name: Signal(one.time, one.matrix @ amounts) for name, one in each.items()}
            for each in self.inputs
        ]

    @property
    def acts_on_inputs(self) -> FloatArray:
        """1 for each column (q,) that acts through inputs alone, else 0."""
        acting = np.zeros(len(self.groups))
        for each in self.inputs:
            for one in each.values():
                acting[np.any(one.matrix != 0.0, axis=0)] = 1.0
        return acting

    def follow(self, first: EffectColumns, acting: FloatArray) -> EffectColumns:
        """Return the columns of `first` as recomputed, in its order and with its scale.

        `acting` (q,) are the amounts of `first` that drive the run already: their answer is taken
        out of the stated changes, so that the amounts are again the whole ones.
        """
        keys, mine = number_groups(first.groups), number_groups(self.groups)
        picked = [mine.index(key) for key in keys if key in mine]
        kept = [k for k, key in enumerate(keys) if key in mine]
        found = self.select(picked).rescale(first.scale[kept])
        known = tuple(
            one - matrix @ acting[kept]
            for one, matrix in zip(found.known, found.matrices, strict=True)
        )
        return replace(found, known=known)

    def plan_second_step(self, amounts: FloatArray) -> Relinearization:
        """Describe the columns of a second step after `amounts` (q,) of these."""
        found = {
            group.effect: amount * scale
            for group, amount, scale in zip(self.groups, amounts, self.scale, strict=True)
            if group.effect is not None and EFFECTS[group.effect].curved and amount != 0.0
        }
        return Relinearization(
            set(self.groups), {one: _limit_amount(one, amount) for one, amount in found.items()}
        )

    def find_columns(self, group: Group) -> list[int]:
        """Return the numbers of the columns of a group."""
        return [k for k, one in enumerate(self.groups) if one == group]

    def select(self, columns: Sequence[int]) -> EffectColumns:
        """Return some of the columns."""
        picked = list(columns)
        return replace(
            self,
            groups=tuple(self.groups[k] for k in picked),
            matrices=tuple(select_columns(one, picked) for one in self.matrices),
            scale=self.scale[picked],
            inputs=tuple(
                {name: one.select(picked) for name, one in each.items()} for each in self.inputs
            ),
        )

    def rescale(self, scale: FloatArray) -> EffectColumns:
        """Return the columns multiplied by `scale` (q,)."""
        matrices = tuple(scale_columns(one, scale) for one in self.matrices)
        inputs = tuple(
            {
                name: InputColumns(one.time, scale_columns(one.matrix, scale))
                for name, one in each.items()
            }
            for each in self.inputs
        )
        return replace(self, matrices=matrices, scale=self.scale * scale, inputs=inputs)


def build_columns(
    problem: DualClutchProblem,
    point: ParameterVector,
    priors: EffectPriors,
    again: Relinearization | None = None,
) -> EffectColumns | None:
    """Build the columns of all effects that are not off; None if a shift has no linear response.

    `again` describes those of a second step.
    A column that changes no compared sample is left out.
    """
    shifts: list[_ShiftColumns] = []
    for term in problem.terms:
        at = evaluate_operating_point(term, point)
        if at is None:
            return None
        shifts.append(_build_shift_columns(at, priors, again or Relinearization()))
    keys = list(dict.fromkeys(key for one in shifts for key in one.keys))
    empty = np.ones(len(keys), dtype=bool)
    for one in shifts:
        empty &= ~np.any(one.align(one.matrix, keys), axis=0)
    keys = [key for key, none in zip(keys, empty, strict=True) if not none]
    return EffectColumns(
        groups=tuple(group for group, _ in keys),
        matrices=tuple(one.align(one.matrix, keys) for one in shifts),
        known=tuple(one.known for one in shifts),
        scale=np.ones(len(keys)),
        inputs=tuple(
            {
                name: InputColumns(one.time, one.align(matrix, keys))
                for name, matrix in one.inputs.items()
            }
            for one in shifts
        ),
        stds={group: std for one in shifts for group, std in one.stds.items()},
    )


def _limit_amount(effect: EffectId, amount: float) -> float:
    """Limit the amount at which the column of a curved effect is computed."""
    size = float(np.clip(abs(amount), *CURVED_AMOUNTS))
    return -size if EFFECTS[effect].signed and amount < 0.0 else size


@dataclass(frozen=True, eq=False)
class Relinearization:
    """Columns of a further step: the `groups` of the first (None for all), and by curved effect the
    amount at which its column is computed, of the stated size."""

    groups: Collection[Group] | None = None
    amounts: Mapping[EffectId, float] = field(default_factory=dict)

    def has(self, group: Group) -> bool:
        """Return whether the columns of a group are among them."""
        return self.groups is None or group in self.groups


_Key = tuple[Group, int]


def number_groups(groups: Sequence[Group]) -> list[_Key]:
    """Return each group with the number of its column, from 1."""
    count: dict[Group, int] = {}
    keys = []
    for group in groups:
        count[group] = count.get(group, 0) + 1
        keys.append((group, count[group]))
    return keys


@dataclass(frozen=True, eq=False)
class _ShiftColumns:
    """Columns of one shift by key: answers (n, q), changes of the inputs (N-1, q) by name, and the
    stated standard deviation by effect."""

    keys: tuple[_Key, ...]
    matrix: FloatArray
    known: FloatArray
    time: FloatArray
    inputs: Mapping[str, FloatArray]
    stds: Mapping[Group, float]

    def align(self, matrix: FloatArray, keys: Sequence[_Key]) -> FloatArray:
        """Return the columns of a matrix (m, q) in the order of `keys`; zero for foreign ones."""
        place = {key: k for k, key in enumerate(self.keys)}
        index = np.array([k for k, key in enumerate(keys) if key in place], dtype=np.intp)
        own = [place[keys[k]] for k in index]
        return place_columns(matrix[:, own], index, len(keys))


def _build_shift_columns(
    at: OperatingPoint, priors: EffectPriors, again: Relinearization
) -> _ShiftColumns:
    """Build the columns of one shift; those that are not finite are left out."""
    found = list(_build_random(at, priors, again))
    numbered = number_groups([group for group, _ in found])
    named = list(zip(numbered, (one for _, one in found), strict=True))
    amounts = np.array([_get_amount(again.amounts, key[0]) for key, _ in named])
    matrix = observe(at, [one for _, one in named]) / amounts
    for k, (key, one) in enumerate(named):
        effect = key[0].effect
        if one.inputs and effect is not None and effect in again.amounts:
            matrix[:, k] = _differentiate_curved(at, priors, effect, amounts[k])
    finite = np.flatnonzero(np.all(np.isfinite(matrix), axis=0))
    stated = list(_build_known(at, priors))
    known = observe(at, [one for one, _ in stated]) @ np.array([sign for _, sign in stated])
    named, matrix, amounts = [named[k] for k in finite], matrix[:, finite], amounts[finite]
    disturbances = [one for _, one in named]
    inputs: dict[str, FloatArray] = {}
    for k, one in enumerate(disturbances):
        for name, values in one.inputs.items():
            nothing = np.zeros((at.middle.size, len(disturbances)))
            inputs.setdefault(name, nothing)[:, k] = values / amounts[k]
    keys = tuple(key for key, _ in named)
    stds = {
        group: priors.get_prior(group.effect, at.term.plant.driveline).std
        for group, _ in keys
        if group.effect is not None
    }
    return _ShiftColumns(keys, matrix, known, at.middle, inputs, stds)


def _differentiate_curved(
    at: OperatingPoint, priors: EffectPriors, effect: EffectId, amount: float
) -> FloatArray:
    """Differentiate the changes (n,) by a curved effect in the inputs at an `amount` of it.

    The run is driven by its whole change there, so a further step is along the slope.
    """
    step = CURVED_STEP * amount
    near = [_build_curved(at, priors, effect, amount + sign * step) for sign in (1.0, -1.0)]
    changes = observe(at, near)
    return np.asarray((changes[:, 0] - changes[:, 1]) / (2.0 * step))


def _build_curved(
    at: OperatingPoint, priors: EffectPriors, effect: EffectId, amount: float
) -> Disturbance:
    """Build the only disturbance of a curved effect at an `amount` of its stated size; one without
    action where a shift has none."""
    std = priors.get_prior(effect, at.term.plant.driveline).std
    found = EFFECTS[effect].build(at, EFFECTS[effect].scale_amount(amount, std))
    return found[0] if found else Disturbance()


def compute_inputs(
    problem: DualClutchProblem,
    point: ParameterVector,
    priors: EffectPriors,
    first: EffectColumns,
    amounts: FloatArray,
) -> list[dict[str, Signal]] | None:
    """Compute the changes of inputs by name and shift for `amounts` (q,) of the columns `first`.

    A curved effect acts with its whole change at its amount. None where a run does not complete.
    """
    curved = {
        group.effect: k
        for k, group in enumerate(first.groups)
        if group.effect is not None and EFFECTS[group.effect].curved and amounts[k] != 0.0
    }
    linear = amounts.copy()
    linear[list(curved.values())] = 0.0
    found = first.compute_inputs(linear)
    for term, changes in zip(problem.terms, found, strict=True):
        at = evaluate_operating_point(term, point) if curved else None
        if curved and at is None:
            return None
        for effect, k in curved.items():
            assert at is not None, "checked above"
            one = _build_curved(at, priors, effect, float(amounts[k] * first.scale[k]))
            for name, values in one.inputs.items():
                old = changes.get(name, Signal(at.middle, np.zeros_like(values)))
                total = np.interp(at.middle, old.time, old.values) + values
                changes[name] = Signal(at.middle, total)
    return found


def _get_amount(amounts: Mapping[EffectId, float], group: Group) -> float:
    """Return the amount at which the columns of a group are computed, of the stated size."""
    return 1.0 if group.effect is None else amounts.get(group.effect, 1.0)


def _build_random(
    at: OperatingPoint, priors: EffectPriors, again: Relinearization
) -> Iterator[tuple[Group, Disturbance]]:
    """Yield the disturbances of one prior standard deviation with their group."""
    named = None if again.groups is None else {group.effect for group in again.groups}
    for name, effect in EFFECTS.items():
        prior = priors.get_prior(name, at.term.plant.driveline)
        is_off = prior.std == 0.0 or _is_in_plant(at, name)
        if is_off or (named is not None and name not in named):
            continue
        size = effect.scale_amount(again.amounts.get(name, 1.0), prior.std)
        for one in effect.build(at, size):
            if again.has(group := Group(name, one.subject)):
                yield group, one
    for one in build_sensor_columns(at, priors.sensors):
        if again.has(group := Group(None, one.subject)):
            yield group, one


def _is_in_plant(at: OperatingPoint, effect: EffectId) -> bool:
    """Return whether the run itself has an effect, so that a column would count it twice."""
    own = at.term.plant.plant_effect
    return own is not None and own.effect is effect


def _build_known(at: OperatingPoint, priors: EffectPriors) -> Iterator[tuple[Disturbance, float]]:
    """Yield the disturbances of effects with a stated value, of that size."""
    for name, effect in EFFECTS.items():
        value = priors.get_prior(name, at.term.plant.driveline).value
        if value and not _is_in_plant(at, name):
            for one in effect.build(at, abs(value)):
                yield one, float(np.sign(value))


def observe(at: OperatingPoint, disturbances: Sequence[Disturbance]) -> FloatArray:
    """Compute the changes (n, q) of the compared samples by q disturbances."""
    response, count = at.response, len(disturbances)
    if count == 0:
        return np.zeros((at.record.size, 0))
    push = np.zeros((at.middle.size, response.states, count))
    for k, one in enumerate(disturbances):
        for name, values in {**one.inputs, **one.torques}.items():
            push[:, :, k] += response.drive[name] * values[:, None]
    shown = response.show(response.propagate_columns(push))
    for k, one in enumerate(disturbances):
        for name, values in one.outputs.items():
            shown[name][:, k] += values
    return at.record.sample(shown)

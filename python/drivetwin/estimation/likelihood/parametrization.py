# SPDX-License-Identifier: MIT
"""Unknowns of the fit and the simulated model as a function of them.

    J1 = Je/η, J2e = 0 (THEORY section 3: only Je = J1·η + J2e is identifiable)
    load.constant = i_f·(T_v/i_f + d) - aero·mean speed², mu_s = mu_c + mu_drop, v_s = exp(ln_v_s)

On a hilly road the load of each shift deviates from T_v/i_f by d. The deviations add up to zero
over the shifts of a log, so T_v/i_f is the mean: the d of the first is minus the sum of the others.
An element that engages in one of the shifts has its own Stribeck law. An element that only
disengages has the law of its partner, the element that engages when it opens, times a level of its
own, with a rise of its own to zero slip:

    mu_c = level·mu_c', mu_drop = level·mu_drop' + rest, mu_v = level·mu_v', v_s = v_s'

Ratios of gears and final drive are unknowns unless the card states them exactly. So are the effects
that a fit may have in its plant beside the dual clutch: a size that cannot be negative is sought by
its logarithm, another by its value.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import log

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.data.shift_data import KnownDriveline, ShiftElementKinematics
from drivetwin.estimation.direct.load_balance import AERO
from drivetwin.estimation.likelihood.torque_record import TorqueRecord
from drivetwin.likelihood.objective import LikelihoodObjective
from drivetwin.likelihood.point import ParameterVector
from drivetwin.likelihood.term import RecordedPlant, RecordedTerm
from drivetwin.parameters import FINAL_DRIVE, LAW_KEYS, make_ratio_id
from drivetwin.simulation.added_elements import (
    BACKLASH,
    MODE_DAMPING,
    MODE_FREQUENCY,
    MODE_SHARE,
    PROGRESSION,
    REFERENCE,
    TYRE_SLIP,
    AddedElements,
    build_added_elements,
    compute_gap,
)
from drivetwin.simulation.driveline import build_driveline, build_start
from drivetwin.simulation.driveline_run import COMPARED
from drivetwin.simulation.dual_clutch import (
    ENGINE_TORQUE,
    DualClutch,
    LossLaw,
    RoadLoad,
    ShiftElement,
    Signal,
    State,
    Stribeck,
)
from drivetwin.simulation.network_sensitivity import NetworkTask
from drivetwin.simulation.variable import exp
from drivetwin.vehicle.effects import EffectId
from drivetwin.vehicle.spec import PriorValue

Compute = Callable[[DualClutch, float, Sequence[float]], dict[str, float]]
"""Computes parameters by id from the dual clutch, the largest output torque and the values of the
unknowns, the size in place of its logarithm."""


@dataclass(frozen=True)
class PlantRow:
    """Row of the table: how an effect changes the plant.

    `compute` gives the parameters of the added element. `shape` are the priors of its unknowns
    beside the size by name. `starts` are initial values of the first unknown where no column shows
    one, in standard deviations from its prior mean. `spread` is the prior standard deviation of the
    logarithm of the size, None for that of all effects; `signed` sizes have no logarithm.
    """

    compute: Compute
    shape: Mapping[str, PriorValue] = field(default_factory=dict)
    starts: tuple[float, ...] = (0.0,)
    spread: float | None = None
    signed: bool = False

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns, that of the size first."""
        return ("amount" if self.signed else "ln_size", *self.shape)


PLANTS: Mapping[EffectId, PlantRow] = {
    # Share of J1 in front of the shaft: flywheel and crankshaft against pump, converter or primary
    # masses. Damping ratio of the engine on it with the gearbox held: 2 to 13 % hold 95 %. 0.4 to
    # 2.7 times the usual frequency hold 95 %. Q has several minima: a low mode is not found from a
    # usual one, and a high one moves little.
    EffectId.INPUT_SHAFT_MODE: PlantRow(
        lambda _, __, own: {
            MODE_FREQUENCY: own[0],
            MODE_SHARE: own[1],
            MODE_DAMPING: exp(own[2]),
        },
        {"share": PriorValue(0.5, 0.12), "ln_damping": PriorValue(log(0.05), 0.5)},
        starts=(0.0, -1.0),
        spread=0.5,
    ),
    EffectId.BACKLASH: PlantRow(
        lambda model, full, own: {BACKLASH: compute_gap(own[0], full, model.k_o)},
        starts=(-0.2, 0.3),
    ),
    EffectId.TYRE_SLIP: PlantRow(lambda _, full, own: {TYRE_SLIP: own[0], REFERENCE: full}),
    EffectId.PROGRESSIVE_SHAFT: PlantRow(
        lambda _, full, own: {PROGRESSION: own[0], REFERENCE: full}, signed=True
    ),
}
"""Effects that a plant may have. Sizes are in the unit of the effect's entry; that of a mode is the
frequency [Hz] at which the engine's share of J1 swings. Drag and an efficiency by gear are not
among them: they change the engine torque that drives the run of the correction, so that their
columns are as exact as a plant."""


@dataclass(frozen=True)
class PlantEffect:
    """Effect that a plant has beside the dual clutch.

    `output_torque` is the largest magnitude measured [N m].
    """

    effect: EffectId
    output_torque: float

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns of the fit, that of the size first."""
        return tuple(f"{self.effect}.{key}" for key in PLANTS[self.effect].unknowns)

    def get_size(self, first: float) -> float:
        """Return the size, in the unit of the effect, at a value of the first unknown."""
        return first if self.is_signed else exp(first)

    @property
    def is_signed(self) -> bool:
        """True where the size may be negative."""
        return PLANTS[self.effect].signed

    def compute_values(self, model: DualClutch, unknowns: Mapping[str, float]) -> dict[str, float]:
        """Compute the parameters of the added element by id from the `unknowns` by name."""
        first, *shape = (unknowns[name] for name in self.unknowns)
        own = (self.get_size(first), *shape)
        return PLANTS[self.effect].compute(model, self.output_torque, own)


COMMON = ("eta", "J_e", "J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o", "te_delay")
"""Unknowns of the driveline, the same in all shifts."""
SHAFT = ("k_o", "c_o")
"""Unknowns of the output shaft: its stiffness and damping."""
TE_OFFSET = "te_offset"
"""Mean rounding error of the engine torque [N m]: what is read is the truth plus this."""
MAP_POINT = "map_point"
"""Relative error of the torque at a point of a converter's map, with the index of the point:
`map_point.3`."""
LOG_SPECIFIC = ("Tv_over_if", "te_delay", TE_OFFSET)
"""Unknowns that each of several logs has of its own: road, logger and rounding differ."""
LAW = LAW_KEYS
FOLLOWER = ("level", "rest")
"""Unknowns of an element that has its partner's law: factor on the law [-], rise of friction to
zero slip beyond that of the law [-]."""
NO_LAW = (0.1, 0.1, 1.0, 0.0)
"""Any friction law, for an element without pressure."""
START = ("speed", "wheel_speed", "twist")
"""Unknowns of the start of each shift's run: ω_out and ω_w [rad/s], shaft twist [rad]."""
LOAD_DEVIATION = "load"
"""Unknown of each shift but the first of a log on a hilly road: d, its load at the output shaft
less the mean over the shifts of the log [N m]."""
RUN_SPECIFIC = (*START, LOAD_DEVIATION)
"""All unknowns that belong to the run of one shift, by what follows its label and the dot."""


def map_log_names(log: int) -> dict[str, str]:
    """Map the log-specific names `OWN` to their unknowns in one of several logs, numbered from 1.

    Empty for log 0, the only one.
    """
    return {name: f"log{log}.{name}" for name in LOG_SPECIFIC} if log else {}


def read_map_changes(point: ParameterVector) -> dict[int, float]:
    """Read the relative changes of a converter's torque at the points of its map, by index."""
    values = zip(point.names, point.values.tolist(), strict=True)
    found = {name.partition("."): value for name, value in values}
    return {int(key): -value for (stem, _, key), value in found.items() if stem == MAP_POINT}


@dataclass(frozen=True)
class Tie:
    """A known `inertia` J′ [kg m^2] in the gear that `element` makes: Je = J′ - Jo′/i²."""

    inertia: float
    element: ShiftElementKinematics


@dataclass(frozen=True, eq=False)
class DualClutchPlant(RecordedPlant[TorqueRecord]):
    """Fixed description of one shift: its elements and every value that is not estimated.

    `fixed` gives a value to every name that a Point of the fit does not have. `label` marks the
    start unknowns of this shift. `mean_speed` is that of the wheel over the log [rad/s], at which
    T_v/i_f holds where the load grows with the speed. A `tie` takes the place of the unknown J_e.
    `log` is the number of the log among several, 0 where it is the only one. `load_factors` are
    the factors by unknown of the difference of the load of this shift from that of its log; empty
    without one. `plant_effect` is an effect that the plant has beside the dual clutch. `partners`
    are the elements whose law an element without a law of its own follows, by its name.
    `torque_errors` are errors of the engine torque as read per unit of an unknown, by its name.
    """

    outputs = COMPARED
    driveline: KnownDriveline
    loss_law: LossLaw
    label: str
    fixed: Mapping[str, float]
    mean_speed: float
    tie: Tie | None = None
    log: int = 0
    load_factors: Mapping[str, float] = field(default_factory=dict)
    plant_effect: PlantEffect | None = None
    partners: Mapping[str, str] = field(default_factory=dict)
    torque_errors: Mapping[str, Signal] = field(default_factory=dict)

    @property
    def elements(self) -> tuple[ShiftElementKinematics, ShiftElementKinematics]:
        """Off-going and on-coming element."""
        return (self.driveline.offgoing, self.driveline.oncoming)

    @property
    def spinning(self) -> tuple[ShiftElementKinematics, ...]:
        """Elements open throughout whose drums turn with their slip all the same."""
        shifting = [one.name for one in self.elements]
        return tuple(one for one in self.driveline.drums if one.name not in shifting)

    def get_value(self, point: ParameterVector, name: str) -> float:
        """Return the value of an unknown, free, fixed or tied."""
        if name == "J_e" and self.tie is not None:
            ratio = self.place_element(point, self.tie.element).ratio
            return self.tie.inertia - self.get_value(point, "J_out") / ratio**2
        free = self.get_unknown(name) if self.log else name
        return point[free] if free in point.names else self.fixed[name]

    def get_final_drive(self, point: ParameterVector) -> float:
        """Return the final drive at `point`."""
        return self.get_value(point, FINAL_DRIVE)

    def place_element(
        self, point: ParameterVector, one: ShiftElementKinematics
    ) -> ShiftElementKinematics:
        """Return an element of the shift with the ratio that its gear has at `point`."""
        return one.replace_ratio(self.get_value(point, make_ratio_id(one.gear)))

    def compute_ratio_before(self, point: ParameterVector) -> float:
        """Compute the overall ratio of the gear that is left at `point`."""
        return self.place_element(point, self.driveline.offgoing).ratio

    def compute_ratio_after(self, point: ParameterVector) -> float:
        """Compute the overall ratio of the gear that is entered at `point`."""
        return self.place_element(point, self.driveline.oncoming).ratio

    def get_law(self, point: ParameterVector, element: str) -> tuple[float, float, float, float]:
        """Return the coefficients `LAW` of the friction law of an element at `point`."""
        partner = self.partners.get(element, element)
        c, drop, v, ln_v_s = [self.get_value(point, f"{partner}.{key}") for key in LAW]
        if partner == element:
            return c, drop, v, ln_v_s
        level, rest = [self.get_value(point, f"{element}.{key}") for key in FOLLOWER]
        return level * c, level * drop + rest, level * v, ln_v_s

    def get_unknown(self, name: str) -> str:
        """Return the name of the unknown that stands for `name` in this shift's log."""
        return map_log_names(self.log).get(name, name)

    def build_model(self, point: ParameterVector) -> DualClutch:
        """Build the model to be simulated at `point`."""
        eta = self.get_value(point, "eta")
        return DualClutch(
            J1=self.get_value(point, "J_e") / eta,
            J2e=0.0,
            eta=eta,
            loss_law=self.loss_law,
            i_in=1.0,
            J_out=self.get_value(point, "J_out"),
            i_f=self.get_final_drive(point),
            J_v=self.get_value(point, "J_vehicle"),
            k_o=self.get_value(point, "k_o"),
            c_o=self.get_value(point, "c_o"),
            load=self._build_load(point),
            elements=(
                *(self._build_element(point, one) for one in self.elements),
                *(self._build_drum(point, one) for one in self.spinning),
            ),
        )

    def compute_added_element_values(
        self, point: ParameterVector, model: DualClutch
    ) -> dict[str, float]:
        """Compute the parameters of the elements beside `model` by id at `point`."""
        if self.plant_effect is None:
            return {}
        unknowns = {name: point[name] for name in self.plant_effect.unknowns}
        return self.plant_effect.compute_values(model, unknowns)

    def build_added_elements(self, point: ParameterVector, model: DualClutch) -> AddedElements:
        """Build the elements beside `model` at `point`.

        A tyre is linear about the speed at the start: a run then takes a tenth of the time, and in
        a shift the speed changes by a few per cent.
        """
        found = build_added_elements(self.compute_added_element_values(point, model), model)
        if found.tyre is None:
            return found
        speed = float(point[f"{self.label}.{START[1]}"])
        return replace(found, tyre=found.tyre.linearise(speed))

    def _build_load(self, point: ParameterVector) -> RoadLoad:
        aero = self.get_value(point, AERO)
        mean = self.compute_load(point) * self.get_final_drive(point)
        return RoadLoad(constant=mean - aero * self.mean_speed**2, aero=aero)

    def compute_load(self, point: ParameterVector) -> float:
        """Compute the load of this shift at the output shaft [N m], at the mean speed of its
        log."""
        difference = sum(factor * point[name] for name, factor in self.load_factors.items())
        return self.get_value(point, "Tv_over_if") + difference

    def _build_element(self, point: ParameterVector, one: ShiftElementKinematics) -> ShiftElement:
        c, drop, v, ln_v_s = self.get_law(point, one.name)
        v_s = exp(ln_v_s)  # an infinite speed is a constant law
        placed = self.place_element(point, one)
        return ShiftElement(
            name=one.name,
            i_c=1.0 / placed.a,
            i_out=placed.b,
            gain=one.gain,
            P0=self.get_value(point, f"{one.name}.P0"),
            friction=Stribeck(c, c + drop, v_s, v),
            peak=one.peak,
            drum_inertia=self.get_value(point, f"{one.name}.drum"),
        )

    def _build_drum(self, point: ParameterVector, one: ShiftElementKinematics) -> ShiftElement:
        """Build an element of which only the drum acts."""
        drum = self.get_value(point, f"{one.name}.drum")
        law = Stribeck(*NO_LAW)
        return ShiftElement(one.name, 1.0 / one.a, one.b, one.gain, one.P0.value, law, 1.0, drum)

    def build_task(
        self,
        point: ParameterVector,
        inputs: Mapping[str, Signal],
        time: FloatArray,
        added: AddedElements | None = None,
    ) -> NetworkTask:
        """Build the run at `point` over `time` (N,) [s], driven by measured `inputs`.

        `added` take the place of the elements beside the dual clutch. Elements that stay open have
        no pressure. Errors of the engine torque carry no derivatives.
        """
        model = self.build_model(point)
        added = self.build_added_elements(point, model) if added is None else added
        idle = dict.fromkeys((e.name for e in self.spinning), Signal(time[[0, -1]], np.zeros(2)))
        acting = {**idle, **inputs, ENGINE_TORQUE: self.place_torque(point, inputs[ENGINE_TORQUE])}
        begin = self.build_start(point)
        start = build_start(model, added, begin, acting[ENGINE_TORQUE], float(time[0]))
        elements = build_driveline(model, added)
        return NetworkTask(elements, acting, start, time, list(COMPARED.values()))

    def place_torque(self, point: ParameterVector, read: Signal) -> Signal:
        """Return the engine torque as it acts: less its errors, advanced by its delay."""
        values = read.values
        for name, one in self.torque_errors.items():
            values = values - float(point[name]) * np.interp(read.time, one.time, one.values)
        return Signal(read.time, values, -self.get_value(point, "te_delay"))

    def get_delays(self, point: ParameterVector, inputs: Mapping[str, Signal]) -> dict[str, float]:
        """Return the delay [s] of each of `inputs` at `point`."""
        torque = -float(self.get_value(point, "te_delay"))
        return dict.fromkeys(inputs, 0.0) | {ENGINE_TORQUE: torque}

    def list_disturbances(
        self, point: ParameterVector, record: TorqueRecord
    ) -> dict[str, dict[str, FloatArray]]:
        """List the errors of the engine torque that are unknowns."""
        found = {}
        read = 0.5 * (record.time[1:] + record.time[:-1]) + self.get_value(point, "te_delay")
        for name, one in self.torque_errors.items():
            found[name] = {ENGINE_TORQUE: -np.interp(read, one.time, one.values)}
        return found

    def describe_input(self, name: str) -> str:
        """Return the name of a measured input in findings."""
        return name if name == ENGINE_TORQUE else f"pressure of {name}"

    def build_start(self, point: ParameterVector) -> State:
        """Build the initial state of the run at `point`: the off-going element is locked."""
        speed, wheel, twist = (point[f"{self.label}.{key}"] for key in START)
        ratio = self.compute_ratio_before(point)
        return State(ratio * speed, speed, wheel, twist, (self.driveline.offgoing.name,))


def build_load_deviations(loads: Sequence[float]) -> dict[str, float]:
    """Build start values of T_v/i_f and of the load deviations of the shifts of a log [N m]."""
    mean = float(np.mean(loads))
    own = {f"start{k}.{LOAD_DEVIATION}": load - mean for k, load in enumerate(loads)}
    return {"Tv_over_if": mean, **own}


DualClutchTerm = RecordedTerm[DualClutchPlant, TorqueRecord]
DualClutchProblem = LikelihoodObjective[DualClutchTerm]

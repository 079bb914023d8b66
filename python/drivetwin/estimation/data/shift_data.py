# SPDX-License-Identifier: MIT
"""Prepared data of the estimators: sampled signals with their noise, driveline, design data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from drivetwin._util.arrays import FloatArray, Span
from drivetwin.channels.roles import RememberedMapping
from drivetwin.findings import Finding
from drivetwin.likelihood.measured_signal import MeasuredSignal
from drivetwin.parameters import FINAL_DRIVE, OVER_ETA, get_parameter_spec, make_ratio_id
from drivetwin.shifts.shift import RejectedShift, Shift
from drivetwin.simulation.dual_clutch import LossLaw
from drivetwin.vehicle.effects import EffectId, EffectPrior
from drivetwin.vehicle.spec import PriorValue, SensorTolerance, SumPrior, compute_brake_ratios

PLAUSIBLE_ETA = PriorValue(0.9, 0.06)
"""Efficiency of a gearbox if no output torque shows it."""
NO_DRUM = PriorValue(0.0)
"""Inertia of the drum of an element that has none."""


@dataclass(frozen=True, eq=False)
class TorqueOfSpeeds:
    """Sensitivity of an engine torque that is a map of speeds to the noise of the compared one.

    `slope` (n,) [N m s/rad] is its derivative by ω_e at `time` (n,) [s], `rest` (n,) [N m] the
    noise of its samples that is not from ω_e. `points` (n,) [N m] are its derivatives by the
    relative error of the torque at each point of the map, by index, and `point_std` the standard
    deviations of these errors; empty for an exact map.
    """

    time: FloatArray
    slope: FloatArray
    rest: FloatArray
    points: Mapping[int, FloatArray] = field(default_factory=dict)
    point_std: Mapping[int, float] = field(default_factory=dict)


@dataclass(frozen=True)
class ShiftElementKinematics:
    """A shift element in the dual-clutch form: slip = a·ω_e - b·ω_out (eq. 15).

    `a` = 1/(i_in·i_c), `b` = i_out; its torque acts as -a·T on the engine and b·T on the output
    side. `gain` N·D·A·r [m^3] with `gain_std`: the motion depends on μ times the gain alone, so
    that μ is stated for this gain; `gain_assumed` marks one that nobody knows. `drum` [kg m^2] is
    the inertia that turns with the slip; `peak` is the static over the kinetic capacity at zero
    slip. `gear` is the gear that the element makes; `follows_ratio` marks a brake, whose i_c is the
    ratio of the gear less 1.
    """

    name: str
    a: float
    b: float
    gain: float
    P0: PriorValue
    gear: str
    drum: PriorValue = NO_DRUM
    peak: float = 1.0
    gain_std: float = 0.0
    gain_assumed: bool = False
    i_in: float = 1.0
    follows_ratio: bool = False

    @property
    def gain_prior(self) -> PriorValue:
        """Gain [m^3] with its distribution."""
        return PriorValue(self.gain, self.gain_std, self.gain_assumed)

    @property
    def ratio(self) -> float:
        """Overall ratio ω_e/ω_out with this element locked."""
        return self.b / self.a

    @property
    def gear_ratio(self) -> float:
        """Ratio of the gear that the element makes, without the input gear."""
        return self.ratio / self.i_in

    def replace_ratio(self, gear_ratio: float) -> ShiftElementKinematics:
        """Return the element in a gear of another ratio (without the input gear)."""
        if self.follows_ratio:
            i_c, i_out = compute_brake_ratios(gear_ratio)
            return replace(self, a=1.0 / (self.i_in * i_c), b=i_out)
        return replace(self, b=self.a * self.i_in * gear_ratio)


@dataclass(frozen=True)
class KnownDriveline:
    """Known structure during one shift. `couplings` holds every shift element by name.

    `i_f` and the ratios of `couplings` are the nominal values of this log: those of the card, or as
    far as they are roughly known there, those that the speeds show. `final_drive` and `ratios` by
    gear (without the input gear) are the card's distributions.
    `known` is what is known beforehand, by parameter id, beside Jo′, J1, P0, drums and ratios.
    `sums` are priors on sums of these, by parameter id.
    `eta_change` is the known efficiency of the gear that is entered less that of the gear that is
    left, None if unknown.
    """

    i_f: float
    offgoing: ShiftElementKinematics
    oncoming: ShiftElementKinematics
    couplings: Mapping[str, ShiftElementKinematics]
    J_out: PriorValue | None
    loss_law: LossLaw = "paper"
    known: Mapping[str, PriorValue] = field(default_factory=dict)
    J1: PriorValue | None = None
    eta_change: PriorValue | None = None
    final_drive: PriorValue | None = None
    ratios: Mapping[str, PriorValue] = field(default_factory=dict)
    sums: tuple[SumPrior, ...] = ()

    @property
    def ratio_priors(self) -> dict[str, PriorValue]:
        """Card's distributions of the ratios that the shift depends on, by parameter id."""
        gears = (self.offgoing.gear, self.oncoming.gear)
        found = {make_ratio_id(gear): self.ratios[gear] for gear in gears if gear in self.ratios}
        return found if self.final_drive is None else {**found, FINAL_DRIVE: self.final_drive}

    @property
    def ratio_values(self) -> dict[str, float]:
        """Nominal values of these ratios, by parameter id."""
        nominal = {
            make_ratio_id(one.gear): one.gear_ratio for one in (self.offgoing, self.oncoming)
        }
        return {**nominal, FINAL_DRIVE: self.i_f}

    @property
    def by_card(self) -> KnownDriveline:
        """The driveline with the ratios as the card states them."""
        return self.replace_ratios({name: one.value for name, one in self.ratio_priors.items()})

    def replace_ratios(self, values: Mapping[str, float]) -> KnownDriveline:
        """Return the driveline with other nominal ratios, by parameter id; exact ones stay."""
        priors = self.ratio_priors

        def change(one: ShiftElementKinematics) -> ShiftElementKinematics:
            known = priors.get(name := make_ratio_id(one.gear))
            return one if known is None or known.std == 0.0 else one.replace_ratio(values[name])

        own = {one.name: change(one) for one in (self.offgoing, self.oncoming)}
        return replace(
            self,
            i_f=values.get(FINAL_DRIVE, self.i_f),
            offgoing=own[self.offgoing.name],
            oncoming=own[self.oncoming.name],
            couplings={**self.couplings, **own},
        )

    @property
    def i_before(self) -> float:
        """Overall ratio of the gear that is left."""
        return self.offgoing.ratio

    @property
    def i_after(self) -> float:
        """Overall ratio of the gear that is entered."""
        return self.oncoming.ratio

    def find_prior(self, name: str) -> PriorValue | None:
        """Return the prior of a reported parameter by id; None if the card has none."""
        spec = get_parameter_spec(name)
        ending = OVER_ETA if name.endswith(OVER_ETA) else ""
        known = self.known.get(spec.stem + ending if spec.suffix == "log" else name)
        known = self.ratio_priors.get(name, known)
        if known is not None:
            return known
        stem, _, element = name.removesuffix(OVER_ETA).partition(".")
        coupling = self.couplings.get(element)
        if stem == "J_out":
            known = self.J_out
        elif coupling is not None:
            known = {"P0": coupling.P0, "drum": coupling.drum}.get(stem)
        return self.divide_by_eta(known) if known is not None and ending else known

    def divide_by_eta(self, quantity: PriorValue) -> PriorValue:
        """Divide a torque-like design value by the efficiency, known from design or typical."""
        eta = self.known.get("eta", PLAUSIBLE_ETA)
        value = quantity.value / eta.value
        spread = value * eta.std / eta.value
        return PriorValue(value, float(np.hypot(quantity.std / eta.value, spread)))

    @property
    def drums(self) -> tuple[ShiftElementKinematics, ...]:
        """Elements whose drum inertia is not zero."""
        return tuple(c for c in self.couplings.values() if c.drum.value > 0 or c.drum.std > 0)


@dataclass(frozen=True, eq=False)
class ShiftSignals:
    """The measured signals of a log, engine side referred to ω_e, and the shift they show.

    `engine_torque` holds fresh values only, at their own raster. `wheel_speed` is None where the
    log has none; `output_torque` is empty where it has none. Positive directions as in THEORY
    section 3.
    """

    engine_torque: MeasuredSignal
    output_torque: MeasuredSignal
    engine_speed: MeasuredSignal
    output_speed: MeasuredSignal
    wheel_speed: MeasuredSignal | None
    pressures: Mapping[str, MeasuredSignal]
    shift: Shift
    torque_resolution: float = field(default=0.0)
    """Rounding step of the engine torque [N m]; 0 where none shows."""
    log: int = 0
    """Number of the log, from 1, where several are fitted together; 0: there is one only."""
    torque_of_speeds: TorqueOfSpeeds | None = None
    """Source of a turbine torque computed from speeds; None for a measured engine torque."""
    output_torque_shift: float = 0.0
    """Time [s] added to the stamps of the output torque; negative for a sensor that is late."""

    @property
    def output_gaps(self) -> tuple[Span, ...]:
        """Spans [s] without output torque or a speed of the gearbox, which the fit compares."""
        compared = (self.output_torque, self.engine_speed, self.output_speed)
        return tuple(gap for signal in compared for gap in signal.unrecorded)

    @property
    def scale_known(self) -> bool:
        """True if an output torque gives all torque-like quantities their common scale."""
        return self.output_torque.time.size > 0


@dataclass(frozen=True, eq=False)
class ShiftData:
    """Measured signals of one shift and the known structure of its driveline."""

    signals: ShiftSignals
    driveline: KnownDriveline


@dataclass(frozen=True)
class DesignData:
    """Design data of the vehicle that hold for all shifts of a log; SI.

    `J_prime_range` [kg m^2] is the design range of J' at the engine, `J_vehicle_range` [kg m^2]
    that of J3 at the wheel. `sensors` are the tolerances by role, those of the speed sensor that
    ω_e is from under `engine_speed`; `known` are the priors by parameter id, `effects` those of
    effects that the model leaves out.
    """

    loss_law: LossLaw
    final_drive: float
    J_prime_range: tuple[float, float]
    J_vehicle_range: tuple[float, float]
    J_out: PriorValue | None = None
    sensors: Mapping[str, SensorTolerance] = field(default_factory=dict)
    known: Mapping[str, PriorValue] = field(default_factory=dict)
    effects: Mapping[EffectId, EffectPrior] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class PreparedLog:
    """Data of one log and one vehicle for the estimators.

    `candidates` are the shifts that were detected, `shifts` the data of those to be fitted and
    `rejected` all others with the reason. `inputs` is the SHA-256 by name of every file, `mapping`
    the channel mapping by which the log was read. `oil_temperature` [K] is the range over the
    shifts to be fitted; None without a sensor.
    """

    shifts: tuple[ShiftData, ...]
    candidates: tuple[Shift, ...]
    rejected: tuple[RejectedShift, ...]
    design: DesignData
    source: str
    sha256: str
    inputs: Mapping[str, str]
    findings: tuple[Finding, ...] = ()
    mapping: RememberedMapping = field(default_factory=RememberedMapping)
    oil_temperature: tuple[float, float] | None = None

    @property
    def signals(self) -> tuple[ShiftSignals, ...]:
        """Signals of the shifts to be fitted."""
        return tuple(shift.signals for shift in self.shifts)

    @property
    def drivelines(self) -> tuple[KnownDriveline, ...]:
        """Structure of the driveline in the shifts to be fitted."""
        return tuple(shift.driveline for shift in self.shifts)

    @property
    def turbine_driven(self) -> bool:
        """True if the converter is open: its turbine takes the place of the engine."""
        return any(s.torque_of_speeds is not None for s in self.signals)

    @property
    def scale_known(self) -> bool:
        """True if all shifts have an output torque."""
        return all(s.scale_known for s in self.signals)


@dataclass(frozen=True, eq=False)
class GearData:
    """Engine torque [N m] and output speed [rad/s] while a gear of overall `ratio` is engaged
    over `span` [s], with the converter closed; the span may be empty."""

    gear: str
    ratio: float
    span: Span
    engine_torque: MeasuredSignal
    output_speed: MeasuredSignal

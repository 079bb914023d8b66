# SPDX-License-Identifier: MIT
"""The twin: an identified driveline model with its uncertainty, validity range and provenance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import DisplayMixin
from drivetwin.actuator.model import IdentifiedActuator
from drivetwin.channels.roles import RememberedMapping
from drivetwin.errors import InputError, MissingParameterError, Where
from drivetwin.estimation.result.estimate import Estimate, FrictionCurve, LoadLaw, Verdict
from drivetwin.estimation.result.method import Method
from drivetwin.parameters import FINAL_DRIVE, OVER_ETA, make_ratio_id
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.added_elements import (
    ADDED_ELEMENT_IDS,
    AddedElements,
    Converter,
    build_added_elements,
    select_added_elements,
)
from drivetwin.simulation.dual_clutch import (
    DualClutch,
    FrictionTable,
    LossLaw,
    RoadLoad,
    ShiftElement,
    Stribeck,
)
from drivetwin.simulation.shift_control import SpeedSensor
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.spec import (
    ElementKind,
    ElementSpec,
    Gear,
    PriorValue,
    ShiftKind,
    move_clutch_ratios,
)

COMMON = ("eta", "J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o")
"""Parameters that every model of a twin needs, besides a J′."""
OF_ELEMENT = ("P0", "drum")
"""Stems of the element parameters that replace the design value if identified."""
PRESSURE_DELAY = "p_delay"
"""Id of the delay of the acting pressures behind the logged ones."""
SIMULATED = (
    *(*COMMON, "J_prime", *OF_ELEMENT, "ratio", FINAL_DRIVE, "te_delay", PRESSURE_DELAY),
    *ADDED_ELEMENT_IDS,
)
"""Stems of the parameters that a simulation depends on; the others follow from them."""


@dataclass(frozen=True)
class TwinGear:
    """A gear: overall ratio i_in·i_c·i_out and the shift element that holds it."""

    ratio: Annotated[float, Field(gt=0)]
    element: str


def _reject_zero(ratio: float) -> float:
    if ratio == 0.0:
        raise ValueError("a ratio must not be 0")
    return ratio


ClutchRatio = Annotated[float, AfterValidator(_reject_zero)]


@dataclass(frozen=True)
class TwinElement:
    """Design data of one shift element: ratios of eq. 15, gain [m^3], P0 [Pa], drum [kg m^2].

    `P0` and `drum` are the card's values; identified parameters of the same name replace them.
    `gain_std` [m^3] is the standard deviation of the gain. It acts where the log does not determine
    the element's μ times gain.
    """

    kind: ElementKind
    i_c: ClutchRatio
    i_out: ClutchRatio
    gain: Annotated[float, Field(gt=0, alias="gain_m3")]
    P0: Annotated[float, Field(alias="P0_Pa")]
    peak: Annotated[float, Field(ge=1)]
    drum: Annotated[float, Field(ge=0, alias="drum_inertia_kgm2")]
    gain_std: Annotated[float, Field(ge=0, alias="gain_std_m3")] = 0.0

    @property
    def gain_prior(self) -> PriorValue:
        """Gain [m^3] with its distribution."""
        return PriorValue(self.gain, self.gain_std)

    def to_spec(self, name: str) -> ElementSpec:
        """Return the element as on a vehicle card, with all values known but the gain."""
        P0, drum, i_c, i_out = (
            PriorValue(one) for one in (self.P0, self.drum, self.i_c, self.i_out)
        )
        return ElementSpec(name, self.kind, self.gain_prior, P0, self.peak, drum, i_c, i_out)

    def replace_ratio(self, gear_ratio: float) -> TwinElement:
        """Return the element in a gear of another ratio (without the input gear)."""
        i_c, i_out = move_clutch_ratios(self.kind, self.i_c, self.i_out, gear_ratio)
        return replace(self, i_c=i_c, i_out=i_out)


@dataclass(frozen=True, eq=False, repr=False)
class Twin(DisplayMixin):
    """Identified model of one driveline; immutable, SI.

    `parameters` by id (see parameters.py), also the not identifiable ones; `friction` by
    element; `covariance` (n, n) over `covariance_ids`, total; `validity` the ranges of slip,
    pressure, torque and speed that the log covered; `inputs` file name -> SHA-256. The design
    ranges [kg m^2] are those of the vehicle card; `mapping` is the channel mapping of the log.
    `load_law` is the growth of the load torque with speed; None where it is constant. `converter`
    is the card's map of the torque converter, None where it has none. `actuators` are those of the
    elements, from commands in the log or from the card. `wheel_radius` [m] is that of the card.
    `sensors` are those of `engine_speed` and `output_speed` in the log, without their delay.
    """

    name: str
    method: Method
    loss_law: LossLaw
    i_in: float
    final_drive: float
    gears: Mapping[str, TwinGear]
    elements: Mapping[str, TwinElement]
    J_prime_range: tuple[float, float]
    J_vehicle_range: tuple[float, float]
    parameters: Mapping[str, Estimate]
    friction: Mapping[str, FrictionCurve]
    validity: Mapping[str, tuple[float, float]]
    inputs: Mapping[str, str]
    settings: Mapping[str, Any]
    assumptions: tuple[str, ...]
    version: str
    covariance_ids: tuple[str, ...] = ()
    covariance: FloatArray | None = None
    mapping: RememberedMapping = field(default_factory=RememberedMapping)
    load_law: LoadLaw | None = None
    converter: Converter | None = None
    actuators: Mapping[str, IdentifiedActuator] = field(default_factory=dict)
    wheel_radius: float | None = None
    sensors: Mapping[str, SpeedSensor] = field(default_factory=dict)

    def __repr__(self) -> str:
        gears = ", ".join(self.gears)
        return f"<Twin {self.name!r}: gears {gears}, {len(self.parameters)} parameters>"

    def build_dual_clutch(
        self,
        shift: Shift,
        *,
        overrides: Mapping[str, float] | None = None,
        loss_law: LossLaw | None = None,
        load: float | None = None,
    ) -> DualClutch:
        """Model for the simulation of one shift (eqs. 2-9).

        Only Je = J1·η + J2e is identifiable: J′ = Je + Jo′/i_g² gives it, and it is carried as
        J2e = 0, J1 = Je/η. `overrides` sets parameters by id, in place of identified ones: any of
        `list_model_ids`, of the two J′ one.
        Values identified over η are multiplied by the twin's own η, else by that of the overrides.
        Without either (`divide_by_eta`) η is 1: the speeds are the same, all torques are then over
        η. `load` [N m] is T_v/i_f on the road of this shift, over η if the twin's own is.
        Raises MissingParameterError naming every parameter that neither source gives, and
        InputError for a gear or element that the twin lacks and for an override without effect.
        """
        given = dict(overrides or {})
        self._refuse_idle(shift, given)
        gear = self.select_inertia_gear(shift, given)
        inertia_id = f"J_prime_{gear}"
        scale = self.get_value("eta", given.get("eta", 1.0))
        if load is not None:
            given = {"Tv_over_if": scale * load if self.over_eta else load, **given}
        values = self._get_values((*COMMON, inertia_id), given, scale)
        ratio = given.get(make_ratio_id(gear), self.get_gear(gear).ratio / self.i_in) * self.i_in
        final_drive = given.get(FINAL_DRIVE, self.final_drive)
        J_e = values[inertia_id] - values["J_out"] / ratio**2
        if J_e <= 0.0:
            raise InputError(
                f"{inertia_id} = {values[inertia_id]:.4g} kg·m² contains J_out / ratio² = "
                f"{values['J_out'] / ratio**2:.4g} kg·m²: no inertia remains for the engine",
                "correct J_out_kgm2 or the ratios on the vehicle card",
            )
        return DualClutch(
            J1=J_e / values["eta"],
            J2e=0.0,
            eta=values["eta"],
            loss_law=loss_law or self.loss_law,
            i_in=self.i_in,
            J_out=values["J_out"],
            i_f=final_drive,
            J_v=values["J_vehicle"],
            k_o=values["k_o"],
            c_o=values["c_o"],
            load=self._build_load(values["Tv_over_if"], scale, final_drive),
            elements=tuple(
                self._build_element(name, partner, given, scale)
                for name, partner in (
                    (shift.offgoing, shift.oncoming),
                    (shift.oncoming, shift.offgoing),
                )
            ),
        )

    @property
    def added_element_values(self) -> dict[str, float]:
        """Parameters of the elements beside the dual clutch by id; empty where there are none."""
        known = {name: self._is_known(name) for name in ADDED_ELEMENT_IDS}
        return select_added_elements(
            {name: value for name, value in known.items() if value is not None}
        )

    def build_added_elements(
        self, model: DualClutch, overrides: Mapping[str, float] | None = None
    ) -> AddedElements:
        """Build the elements beside the `model` of a shift.

        `overrides` sets parameters of its added elements by id; other ids have no effect.
        """
        given = overrides or {}
        own = {name: given.get(name, value) for name, value in self.added_element_values.items()}
        return build_added_elements(own, model)

    def drop_added_elements(self) -> Twin:
        """Return the twin with the dual clutch alone as its plant."""
        kept = {name: one for name, one in self.parameters.items() if name not in ADDED_ELEMENT_IDS}
        return replace(self, parameters=kept)

    def list_model_ids(self, shift: Shift) -> tuple[str, ...]:
        """Ids of the parameters that the model of a shift is made from."""
        inertias = (f"J_prime_{gear}" for gear in (shift.start_gear, shift.end_gear))
        elements = (shift.offgoing, shift.oncoming)
        own = (f"{stem}.{element}" for stem in OF_ELEMENT for element in elements)
        ratios = (make_ratio_id(gear) for gear in (shift.start_gear, shift.end_gear))
        return (*COMMON, *inertias, *own, *ratios, FINAL_DRIVE)

    def build_card(self) -> VehicleCard:
        """The vehicle card, as far as it takes to read another log and find its shifts."""
        return VehicleCard(
            name=self.name,
            loss_law=self.loss_law,
            i_in=PriorValue(self.i_in),
            final_drive=self._describe(FINAL_DRIVE, self.final_drive),
            gears=tuple(
                Gear(
                    name,
                    self._describe(make_ratio_id(name), gear.ratio / self.i_in),
                    (gear.element,),
                )
                for name, gear in self.gears.items()
            ),
            elements={name: one.to_spec(name) for name, one in self.elements.items()},
            J_prime_range=self.J_prime_range,
            J_vehicle_range=self.J_vehicle_range,
            converter=self.converter,
            remembered=self.mapping,
            wheel_radius=None if self.wheel_radius is None else PriorValue(self.wheel_radius),
        )

    def _build_load(self, Tv_over_if: float, scale: float, final_drive: float) -> RoadLoad:
        """Load at the wheel: constant, or with the part that grows with speed."""
        law = self.load_law or LoadLaw(aero=0.0, std=0.0, mean_speed=0.0)
        return (law.scale_by_eta(scale) if law.over_eta else law).to_road_load(
            Tv_over_if, final_drive
        )

    def get_gear(self, name: str) -> TwinGear:
        """Gear by its name on the card. Raises InputError where the twin has none such."""
        try:
            return self.gears[name]
        except KeyError:
            raise InputError(
                f"the twin {self.name!r} has no gear {name!r}",
                f"use one of {', '.join(self.gears)}",
            ) from None

    def get_value(self, parameter_id: str, default: float) -> float:
        """Identified value, or `default` if the parameter is not identifiable."""
        estimate = self.parameters.get(parameter_id)
        return default if estimate is None or estimate.value is None else estimate.value

    @property
    def over_eta(self) -> bool:
        """True if torque-like quantities are known over η only (no measured output torque)."""
        return (
            self._is_known("J_vehicle") is None
            and self._is_known("J_vehicle" + OVER_ETA) is not None
        )

    def _describe(self, parameter_id: str, value: float) -> PriorValue:
        """Distribution of a ratio; without an estimate it is exact."""
        estimate = self.parameters.get(parameter_id)
        return PriorValue(value, 0.0 if estimate is None else estimate.std_total or 0.0)

    def _is_known(self, parameter_id: str) -> float | None:
        estimate = self.parameters.get(parameter_id)
        return None if estimate is None else estimate.value

    def _refuse_idle(self, shift: Shift, given: Mapping[str, float]) -> None:
        """Raise InputError for what the model of a shift does not depend on."""
        ids = self.list_model_ids(shift)
        label = f"the model of shift {shift.start_gear}-{shift.end_gear}"
        if idle := [name for name in given if name not in ids]:
            raise InputError(
                f"{label} does not depend on {', '.join(idle)}", f"override {', '.join(ids)}"
            )
        inertias = [name for name in given if name.startswith("J_prime_")]
        if len(inertias) > 1:
            raise InputError(
                f"{label} takes one of {' and '.join(inertias)}, from which the other follows",
                "override one of them",
            )

    def select_inertia_gear(
        self, shift: Shift, overrides: Mapping[str, float] | None = None
    ) -> str:
        """Select the gear whose J′ gives the engine-side inertia in the model of a shift.

        Order of preference: overridden, exact design value, least relative standard deviation.
        """
        given = overrides or {}

        def rank(gear: str) -> float:
            if f"J_prime_{gear}" in given:
                return -2.0
            ending = OVER_ETA if self.over_eta else ""
            estimate = self.parameters.get(f"J_prime_{gear}{ending}")
            if estimate is None or estimate.value is None:
                return np.inf
            if estimate.std_total is None:
                return -1.0 if estimate.verdict is Verdict.DESIGN else 1e9
            return estimate.std_total / estimate.value

        return min((shift.start_gear, shift.end_gear), key=rank)

    def _get_values(
        self, ids: tuple[str, ...], given: Mapping[str, float], scale: float
    ) -> dict[str, float]:
        """Values of `ids`, all of which a model needs."""
        values, missing = {"eta": scale} if self.over_eta else {}, []
        for parameter_id in ids:
            value = self._get_value(parameter_id, given, scale)
            if value is not None:
                values[parameter_id] = value
            elif parameter_id not in values:
                missing.append(f"{parameter_id} ({self._describe_unknown(parameter_id)})")
        if missing:
            raise MissingParameterError(
                f"the twin cannot be simulated without {'; '.join(missing)}",
                "give these values as overrides, or identify from a log that determines them",
                Where(file=self.name),
            )
        return values

    def _get_value(
        self, parameter_id: str, given: Mapping[str, float], scale: float
    ) -> float | None:
        """Value of one parameter: given, identified, or identified over η and times `scale`."""
        value = given.get(parameter_id, self._is_known(parameter_id))
        ratio = self._is_known(parameter_id + OVER_ETA)
        if value is None and ratio is not None:
            value = scale * ratio
        return None if value is None else float(value)

    def _describe_unknown(self, parameter_id: str) -> str:
        estimate = self.parameters.get(parameter_id)
        if estimate is None:
            return "not part of the identification"
        return estimate.reason or estimate.verdict.value

    def _place_element(self, name: str, given: Mapping[str, float]) -> TwinElement:
        """Design data of an element with an overridden ratio of its gear. Raises KeyError."""
        element = self.elements[name]
        ids = [make_ratio_id(gear) for gear, one in self.gears.items() if one.element == name]
        changed = [given[one] for one in ids if one in given]
        return element.replace_ratio(changed[0]) if changed else element

    def _build_element(
        self, name: str, partner: str, given: Mapping[str, float], scale: float
    ) -> ShiftElement:
        try:
            design = self._place_element(name, given)
        except KeyError:
            raise InputError(
                f"the twin {self.name!r} has no shift element {name!r}",
                f"use one of {', '.join(self.elements)}",
            ) from None
        curve = self.friction.get(name, self.friction.get(partner))
        if curve is None:
            raise MissingParameterError(
                f"no friction curve of {name} or {partner} was identified",
                "identify from a log where one of them slips under load",
                Where(file=self.name),
            )
        P0, drum = (self._get_value(f"{stem}.{name}", given, scale) for stem in OF_ELEMENT)
        return ShiftElement(
            name=name,
            i_c=design.i_c,
            i_out=design.i_out,
            gain=design.gain,
            P0=design.P0 if P0 is None else P0,
            friction=build_friction_law(curve.scale_by_eta(scale) if curve.over_eta else curve),
            peak=design.peak,
            drum_inertia=design.drum if drum is None else drum,
        )


def build_friction_law(curve: FrictionCurve) -> Stribeck | FrictionTable:
    """Fitted Stribeck law, or the smoothed curve continued flat to zero slip."""
    if curve.stribeck is not None:
        return curve.stribeck
    slip, mu = curve.slip.tolist(), curve.mu.tolist()
    if slip[0] > 0.0:
        slip, mu = [0.0, *slip], [mu[0], *mu]
    return FrictionTable(tuple(slip), tuple(mu))


def build_nominal_shift(twin: Twin, gears: tuple[str, str] | None) -> Shift:
    """The shift between two gears without times, as far as a model needs it."""
    start, end = gears or find_first_shift(twin)
    elements = twin.get_gear(start).element, twin.get_gear(end).element
    if elements[0] == elements[1]:
        raise InputError(
            f"gears {start!r} and {end!r} of {twin.name!r} are held by the same element",
            "choose two neighbouring gears",
        )
    never = (0.0, 0.0)
    kind = ShiftKind.POWER_ON_UP
    return Shift(start, end, *elements, kind, never, never, never, never, 0.0)


def find_first_shift(twin: Twin) -> tuple[str, str]:
    """First pair of neighbouring gears with a friction curve."""
    for old, new in pairwise(twin.gears):
        held = (twin.gears[old].element, twin.gears[new].element)
        if held[0] != held[1] and any(name in twin.friction for name in held):
            return old, new
    raise InputError(
        f"the twin {twin.name!r} has no neighbouring gears with an identified friction curve",
        "name the shift with --shift, such as --shift 2-3",
    )

# SPDX-License-Identifier: MIT
"""The vehicle card file: pydantic models of its tables, keys with unit suffix."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Literal, TypeVar

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    Tag,
    model_validator,
)

from drivetwin._util.toml import FromTable, StrictModel
from drivetwin.actuator.model import ActuatorModel
from drivetwin.channels.mapping_file import ByRole, ChannelTable
from drivetwin.channels.units import BAR, IN_BAR, IN_RPM
from drivetwin.simulation.dual_clutch import LossLaw
from drivetwin.vehicle.effects import EffectPrior
from drivetwin.vehicle.spec import (
    MOST_INERTIA,
    ClutchGeometry,
    ConverterTable,
    ElementSpec,
    Gear,
    PriorValue,
    SensorTolerance,
    describe_assumed_gain,
    describe_fill_pressure,
    describe_gain,
    describe_inertia,
    describe_ratio,
    parse_teeth,
)

_Table = TypeVar("_Table", bound=StrictModel)
CONTROLLER_KEY = "changes"
"""Table of gear changes, which only the card of a gearbox control has."""
MOST_PRESSURE = 1e6
"""Largest fill pressure of a card [bar]; a usual one entered in Pa is left to `card check`."""
MOST_GAIN = 1e3
"""Largest gain of a card [m^3]: a thousand of the largest clutches of ships."""
MOST_PEAK = 1e3
"""Largest ratio of static to kinetic capacity of a card [-]."""


class PriorTable(StrictModel):
    """A design value with its standard deviation in the same unit; 0 means exact.

    Without `std` the standard deviation is the usual one of the quantity.
    """

    value: float = Field(ge=0)
    std: float | None = Field(default=None, ge=0)

    def to_prior(
        self, describe: Callable[[float], PriorValue] = PriorValue, factor: float = 1.0
    ) -> PriorValue:
        """Return the value in SI.

        Parameters
        ----------
        describe
            Distribution of a number in SI without a stated standard deviation.
        factor
            Size of the file's unit in SI.
        """
        if self.std is None:
            return describe(factor * self.value)
        return PriorValue(factor * self.value, factor * self.std)


def _parse_bare_value(value: object) -> object:
    """Read a bare number as a value without a stated standard deviation."""
    if isinstance(value, dict | StrictModel):
        return value
    if not (isinstance(value, int | float) and not isinstance(value, bool)):
        raise ValueError("should be a valid number, or a table such as { value = 0.8, std = 0.1 }")
    return {"value": value}


PriorEntry = Annotated[
    PriorTable, BeforeValidator(_parse_bare_value, json_schema_input_type=PriorTable | float)
]


def _limit_prior(most: float) -> AfterValidator:
    """Return a validator of a value and its standard deviation, both `most` at most."""

    def check(table: _Table) -> _Table:
        for name in ("value", "std"):
            number = getattr(table, name)
            if number is not None and number > most:
                raise ValueError(f"{name} = {number:g} is beyond 0 to {most:g}")
        return table

    return AfterValidator(check)


PressurePrior = Annotated[PriorEntry, _limit_prior(MOST_PRESSURE)]
InertiaPrior = Annotated[PriorEntry, _limit_prior(MOST_INERTIA)]


class RadiusTable(PriorTable):
    """A wheel radius [m] with its standard deviation."""

    value: float = Field(ge=0.1, le=2.0)


RadiusEntry = Annotated[
    RadiusTable, BeforeValidator(_parse_bare_value, json_schema_input_type=RadiusTable | float)
]


class RatioTable(PriorTable):
    """A ratio and its standard deviation; 0 means exact."""

    value: float
    std: float = Field(ge=0)


def _parse_ratio(value: object) -> object:
    """Read a bare ratio by its digits and a text as tooth counts."""
    if isinstance(value, str):
        return {"value": parse_teeth(value), "std": 0.0}
    if isinstance(value, dict | StrictModel):
        return value
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        raise ValueError(
            "should be a valid number, tooth counts such as '49/33', or a table such as "
            "{ value = 1.4848, std = 0.0001 }"
        )
    prior = describe_ratio(value)
    return {"value": prior.value, "std": prior.std}


def _require_positive(table: RatioTable) -> RatioTable:
    if table.value <= 0.0:
        raise ValueError(f"should be greater than 0, not {table.value:g}")
    return table


SignedRatioEntry = Annotated[
    RatioTable, BeforeValidator(_parse_ratio, json_schema_input_type=RatioTable | float | str)
]
"""Ratio of either sign: a number whose digits state its precision, tooth counts such as `49/33`, or
a table with its standard deviation."""
RatioEntry = Annotated[SignedRatioEntry, AfterValidator(_require_positive)]
NO_INPUT_GEAR = RatioTable(value=1.0, std=0.0)


class GainTable(StrictModel):
    """Gain N·D·A·r [m^3] with its standard deviation; 0: the gain is exact.

    `assumed` marks a gain that nobody knows.
    """

    value: float = Field(gt=0)
    std: float | None = Field(default=None, ge=0)
    assumed: bool = False

    def to_prior(self) -> PriorValue:
        """Return the gain in SI."""
        if self.std is not None:
            return PriorValue(self.value, self.std, self.assumed)
        return (describe_assumed_gain if self.assumed else describe_gain)(self.value)


GainEntry = Annotated[
    GainTable,
    BeforeValidator(_parse_bare_value, json_schema_input_type=GainTable | float),
    _limit_prior(MOST_GAIN),
]


def _require_increasing(limits: list[float]) -> list[float]:
    if not 0 <= limits[0] < limits[1]:
        raise ValueError(f"a range is [low, high] with 0 <= low < high, not {limits}")
    if limits[1] > MOST_INERTIA:
        raise ValueError(f"{limits[1]:g} kg·m² is beyond 0 to {MOST_INERTIA:g}")
    return limits


RangeEntry = Annotated[
    list[float], Field(min_length=2, max_length=2), AfterValidator(_require_increasing)
]


class MeasuredTable(PriorTable):
    """An inertia known from a measurement or a data sheet, with its standard deviation."""

    value: float = Field(gt=0, le=MOST_INERTIA)
    std: float = Field(gt=0, le=MOST_INERTIA)

    def to_range(self) -> tuple[float, float]:
        """Return the design range: four standard deviations to either side, above zero."""
        return max(self.value - 4.0 * self.std, 0.0), self.value + 4.0 * self.std


def _get_inertia_form(entry: object) -> str:
    return "measured" if isinstance(entry, dict | MeasuredTable) else "range"


InertiaEntry = Annotated[
    Annotated[RangeEntry, Tag("range")] | Annotated[MeasuredTable, Tag("measured")],
    Discriminator(_get_inertia_form),
]


class GearTable(StrictModel):
    """`[[gears]]`: one gear, its ratio without the input gear, the shift elements that make it."""

    name: str = Field(min_length=1)
    ratio: RatioEntry
    elements: list[str] = Field(min_length=1)
    eta: MeasuredTable | None = None

    def to_spec(self) -> Gear:
        """Return the gear."""
        eta = None if self.eta is None else self.eta.to_prior()
        return Gear(self.name, self.ratio.to_prior(), tuple(self.elements), eta)


class ElementTable(StrictModel):
    """`[elements.<name>]`: a brake or clutch; its gain as one number or from its geometry."""

    kind: Literal["brake", "clutch"]
    gain_m3: GainEntry | None = None
    surfaces: int | None = Field(default=None, ge=1)
    derating: float | None = Field(default=None, gt=0, le=1)
    area_m2: float | None = Field(default=None, gt=0)
    radius_m: float | None = Field(default=None, gt=0)
    P0_bar: PressurePrior
    peak: float = Field(default=1.0, ge=1, le=MOST_PEAK)
    drum_inertia_kgm2: InertiaPrior = PriorTable(value=0.0)
    i_c: SignedRatioEntry | None = None
    i_out: SignedRatioEntry | None = None
    actuator: Annotated[ActuatorModel, FromTable] | None = None

    @model_validator(mode="after")
    def _check_complete(self) -> ElementTable:
        geometry = (self.surfaces, self.derating, self.area_m2, self.radius_m)
        given = sum(part is not None for part in geometry)
        if (self.gain_m3 is None) == (given == 0) or given not in (0, len(geometry)):
            raise ValueError(
                "give the gain either as gain_m3 or as all of surfaces, derating, area_m2, radius_m"
            )
        if (self.i_c is None) != (self.i_out is None):
            raise ValueError("i_c and i_out belong together: give both or none")
        if any(one is not None and one.value == 0.0 for one in (self.i_c, self.i_out)):
            raise ValueError("i_c and i_out must not be zero")
        if self.kind == "clutch" and self.i_c is None:
            raise ValueError("a rotating clutch needs i_c and i_out (eq. 15)")
        return self

    @property
    def geometry(self) -> ClutchGeometry | None:
        """Geometry of the clutch; None if the gain is stated as one number."""
        if self.gain_m3 is not None:
            return None
        return ClutchGeometry(
            self.surfaces or 0, self.derating or 0.0, self.area_m2 or 0.0, self.radius_m or 0.0
        )

    @property
    def gain(self) -> PriorValue:
        """N·D·A·r [m^3]."""
        if self.gain_m3 is not None:
            return self.gain_m3.to_prior()
        return describe_gain(0.0 if self.geometry is None else self.geometry.gain)

    def to_spec(self, name: str) -> ElementSpec:
        """Return the element in SI."""
        return ElementSpec(
            name=name,
            kind=self.kind,
            gain=self.gain,
            P0=self.P0_bar.to_prior(describe_fill_pressure, BAR),
            peak=self.peak,
            drum_inertia=self.drum_inertia_kgm2.to_prior(describe_inertia),
            i_c=None if self.i_c is None else self.i_c.to_prior(),
            i_out=None if self.i_out is None else self.i_out.to_prior(),
            geometry=self.geometry,
            actuator=self.actuator,
        )


class InertiaTable(StrictModel):
    """`[inertia]`: plausible ranges and known inertias, all in kg m^2."""

    J_prime_kgm2: RangeEntry
    J_vehicle_kgm2: InertiaEntry
    J_out_kgm2: InertiaPrior | None = None
    J1_kgm2: MeasuredTable | None = None

    @property
    def vehicle_range(self) -> tuple[float, float]:
        """Design range of J3 at the wheel [kg m^2]."""
        entry = self.J_vehicle_kgm2
        return entry.to_range() if isinstance(entry, MeasuredTable) else (entry[0], entry[1])

    @property
    def vehicle_prior(self) -> PriorValue | None:
        """J3 at the wheel [kg m^2] where a value is stated, None for a range."""
        entry = self.J_vehicle_kgm2
        return entry.to_prior() if isinstance(entry, MeasuredTable) else None


def _refuse_percent(tolerance: float) -> float:
    if tolerance >= 1.0:
        raise ValueError(
            f"a gain tolerance is relative and below 1: {tolerance:g} % is {tolerance / 100:g}"
        )
    return tolerance


class SensorTable(StrictModel):
    """`[sensors.<role>]`: standard deviations of a sensor's constant gain and offset errors, and of
    the delay of its values."""

    gain_tolerance: Annotated[float, Field(ge=0), AfterValidator(_refuse_percent)] = 0.0

    def to_tolerance(self) -> SensorTolerance:
        """Return the tolerances in SI."""
        return SensorTolerance(**{key.removesuffix("_tolerance"): one for key, one in self})


Delay = Annotated[float, Field(alias="delay_tolerance_ms", ge=0), AfterValidator((1e-3).__mul__)]


class EngineTorqueSensor(SensorTable):
    """Tolerances of the engine torque message; how old it is, is a parameter (te_delay)."""

    offset_tolerance: Annotated[float, Field(alias="offset_tolerance_Nm", ge=0)] = 0.0


class TorqueSensor(EngineTorqueSensor):
    """Tolerances of a torque sensor."""

    delay_tolerance: Delay = 0.0


class SpeedSensor(SensorTable):
    """Tolerances of a speed sensor."""

    delay_tolerance: Delay = 0.0
    offset_tolerance: Annotated[float, Field(alias="offset_tolerance_rpm", ge=0), IN_RPM] = 0.0


class PressureSensor(SensorTable):
    """Tolerances of a pressure sensor."""

    delay_tolerance: Delay = 0.0
    offset_tolerance: Annotated[float, Field(alias="offset_tolerance_bar", ge=0), IN_BAR] = 0.0


class SensorsTable(StrictModel):
    """`[sensors]`: tolerances by channel role; a torque without one has the usual gain error."""

    engine_torque: EngineTorqueSensor | None = None
    output_torque: TorqueSensor | None = None
    input_speed: SpeedSensor | None = None
    engine_speed: SpeedSensor | None = None
    output_speed: SpeedSensor | None = None
    wheel_speed: SpeedSensor | None = None
    pressure: dict[str, PressureSensor] = Field(default_factory=dict)


class EffectTable(StrictModel):
    """Prior of an effect: its standard deviation, and its value where it is known."""

    value: float = 0.0
    std: float = Field(ge=0)

    def to_prior(self) -> EffectPrior:
        """Return the prior in the unit of the effect."""
        return EffectPrior(self.std, self.value)


def _parse_effect(entry: object) -> object:
    """Read a bare number as a standard deviation about zero, and `false` as no effect."""
    if entry is False:
        return {"std": 0.0}
    is_number = isinstance(entry, int | float) and not isinstance(entry, bool)
    return {"std": entry} if is_number else entry


EffectEntry = Annotated[
    EffectTable, BeforeValidator(_parse_effect, json_schema_input_type=EffectTable | float | bool)
]


class CardFile(StrictModel):
    """A vehicle card."""

    name: str = Field(min_length=1)
    loss_law: LossLaw = "paper"
    i_in: RatioEntry = NO_INPUT_GEAR
    final_drive: RatioEntry
    wheel_radius_m: RadiusEntry | None = None
    eta: PriorEntry | None = None
    gears: list[GearTable] = Field(min_length=2)
    elements: dict[str, ElementTable] = Field(min_length=1)
    inertia: InertiaTable
    converter: ConverterTable | None = None
    sensors: SensorsTable = SensorsTable()
    effects: dict[str, EffectEntry] = Field(default_factory=dict)
    channels: ByRole[ChannelTable] = ByRole[ChannelTable]()

# SPDX-License-Identifier: MIT
"""Gearbox cards: from a TOML file or a built-in name to a Gearbox in SI, with all faults.

The tables of the file are pydantic models, keys with unit suffix.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from drivetwin._util.toml import (
    Fault,
    FromTable,
    StrictModel,
    raise_faults,
    read_toml,
    validate_schema,
)
from drivetwin.channels.units import BAR
from drivetwin.errors import CardError, suggest_spelling
from drivetwin.gearbox.spec import (
    CONVERTER,
    POWER_SPLIT_REMEDY,
    Capacity,
    ConverterStage,
    Drive,
    ElementKind,
    Gearbox,
    GearEntry,
    GearPair,
    PlanetarySet,
    ShiftMember,
)
from drivetwin.simulation.dual_clutch import Stribeck
from drivetwin.simulation.element_schema import GROUND
from drivetwin.vehicle.spec import MOST_INERTIA, ConverterTable

Name = Annotated[str, Field(min_length=1)]
Teeth = Annotated[int, Field(ge=1)]
Inertia = Annotated[float, Field(ge=0, le=MOST_INERTIA)]


class SetTable(StrictModel):
    """`[sets.<name>]`: a planetary set; z itself, or the tooth counts of sun and ring."""

    sun: Name
    ring: Name
    carrier: Name
    z: float | None = None
    sun_teeth: Teeth | None = None
    ring_teeth: Teeth | None = None
    dual_pinion: bool = False
    planet_inertia_kgm2: Inertia = 0.0

    @model_validator(mode="after")
    def _one_ratio(self) -> SetTable:
        teeth = (self.sun_teeth, self.ring_teeth)
        if teeth.count(None) == 1 or (self.z is None) == (None in teeth):
            raise ValueError("give either z or both sun_teeth and ring_teeth")
        if self.z is not None and self.dual_pinion:
            raise ValueError("dual_pinion goes with tooth counts; write a negative z instead")
        if self.ratio in (0.0, -1.0):
            raise ValueError("z must be neither 0 nor -1")
        if self.planet_inertia_kgm2 > 0 and self.ratio <= 1:
            raise ValueError("planet_inertia_kgm2 is for single pinions (z > 1)")
        return self

    @property
    def ratio(self) -> float:
        """Ring over sun teeth, negative for dual pinions."""
        if self.z is not None:
            return self.z
        size = (self.ring_teeth or 0) / (self.sun_teeth or 1)
        return -size if self.dual_pinion else size

    def to_spec(self, name: str) -> PlanetarySet:
        """Return the set in SI."""
        inertia = self.planet_inertia_kgm2
        return PlanetarySet(name, self.sun, self.ring, self.carrier, self.ratio, inertia)


class PairTable(StrictModel):
    """`[pairs.<name>]`: gear wheels in mesh from member `a` to member `b`.

    `teeth` lists the wheels in order, idlers between the first and the last; a list of lists is a
    train of such meshes on stepped idlers. Or `ratio`, ω_a/ω_b with its sign.
    """

    a: Name
    b: Name
    teeth: list[Teeth] | list[list[Teeth]] | None = None
    ratio: float | None = None

    @model_validator(mode="after")
    def _one_ratio(self) -> PairTable:
        if (self.teeth is None) == (self.ratio is None):
            raise ValueError("give either teeth or ratio")
        if any(len(mesh) < 2 for mesh in self._count_meshes()):
            raise ValueError("a mesh has at least two wheels")
        if self.ratio == 0.0:
            raise ValueError("the ratio must not be 0")
        return self

    def _count_meshes(self) -> list[list[int]]:
        wheels = self.teeth or []
        flat = [count for count in wheels if isinstance(count, int)]
        return [flat] if flat else [mesh for mesh in wheels if isinstance(mesh, list)]

    def to_spec(self, name: str) -> GearPair:
        """Return the pair; every external mesh turns the sense of rotation."""
        ratio = self.ratio
        if ratio is None:
            ratio = 1.0
            for mesh in self._count_meshes():
                ratio *= (-1.0) ** (len(mesh) - 1) * mesh[-1] / mesh[0]
        return GearPair(name, self.a, self.b, ratio)


class FrictionEntry(StrictModel):
    """`[friction]`: μ over slip, μ = mu_c + (mu_s - mu_c)·exp(-|s|/v_s) + mu_v·|s|."""

    mu_c: float = Field(ge=0)
    mu_s: float = Field(ge=0)
    v_s_rad_s: float = Field(gt=0)
    mu_v_s: float = 0.0

    def to_law(self) -> Stribeck:
        """Return the law in SI."""
        return Stribeck(self.mu_c, self.mu_s, self.v_s_rad_s, self.mu_v_s)


class ElementTable(StrictModel):
    """`[elements.<name>]`: a clutch or dog between two members, a brake on one, a freewheel.

    The first member of a freewheel drives the second forward; a single one cannot turn backwards.
    """

    kind: Literal["clutch", "brake", "dog", "freewheel"]
    members: list[Name] = Field(min_length=1, max_length=2)
    surfaces: int | None = Field(default=None, ge=1)
    derating: float = Field(default=1.0, gt=0, le=1)
    area_m2: float | None = Field(default=None, gt=0)
    radius_m: float | None = Field(default=None, gt=0)
    P0_bar: float = 0.0
    peak: float = Field(default=1.0, ge=1)
    friction: FrictionEntry | None = None

    @model_validator(mode="after")
    def _fits(self) -> ElementTable:
        if self.kind == "brake" and len(self.members) != 1:
            raise ValueError("a brake holds one member")
        if self.kind == "clutch" and len(self.members) != 2:
            raise ValueError("a clutch joins two members")
        geometry = (self.surfaces, self.area_m2, self.radius_m)
        if self.kind == "dog" and any(part is not None for part in geometry):
            raise ValueError("a dog never slips under load and has no surfaces, area or radius")
        if self.kind == "freewheel" and any(part is not None for part in geometry):
            raise ValueError(
                "a freewheel has no surfaces, area or radius; a clutch beside it is an element of "
                "its own"
            )
        if None in geometry and any(part is not None for part in geometry):
            raise ValueError("surfaces, area_m2 and radius_m belong together")
        return self

    def to_spec(self, name: str, friction: FrictionEntry | None) -> ShiftMember:
        """Return the element in SI; `friction` is the card's common law."""
        members = [*self.members, GROUND]
        if self.kind == "freewheel" and len(self.members) == 1:
            members.reverse()
        law = self.friction or friction
        capacity = None
        if self.surfaces and self.area_m2 and self.radius_m and law is not None:
            gain = self.surfaces * self.derating * self.area_m2 * self.radius_m
            capacity = Capacity(gain, self.P0_bar * BAR, self.peak, law.to_law())
        return ShiftMember(name, ElementKind(self.kind), members[0], members[1], capacity)


class GearTable(StrictModel):
    """`[[gears]]`: a gear, what is engaged in it, and its published ratio.

    `decimals` says how the ratio was rounded; `final_drive` is a published factor on it.
    """

    name: Name
    elements: list[Name] = Field(min_length=1)
    ratio: float
    decimals: int = Field(default=2, ge=0)
    final_drive: float = Field(default=1.0, gt=0)
    tolerance: float | None = Field(default=None, gt=0, lt=1)

    @model_validator(mode="after")
    def _turns(self) -> GearTable:
        if self.ratio == 0.0:
            raise ValueError("the ratio must not be 0")
        return self

    def to_spec(self) -> GearEntry:
        """Return the gear; the rounding errors of ratio and final drive add up."""
        half = 0.5 * 10.0**-self.decimals
        overall = self.ratio * self.final_drive
        rounding = half * self.final_drive
        if self.final_drive != 1.0:
            rounding += half * abs(self.ratio)
        if self.tolerance is not None:
            rounding = self.tolerance * abs(overall)
        return GearEntry(self.name, tuple(self.elements), overall, rounding)


class ConverterStageTable(ConverterTable):
    """`[converter]`: the map of a torque converter and its members; the turbine is the input."""

    pump: Name
    turbine: Name

    def to_stage(self) -> ConverterStage:
        """Return the converter in SI."""
        return ConverterStage(self.pump, self.to_spec())


class GearboxFile(StrictModel):
    """A gearbox card."""

    name: Name
    source: Name
    input: Name
    output: Name
    sets: dict[str, SetTable] = Field(default_factory=dict)
    pairs: dict[str, PairTable] = Field(default_factory=dict)
    elements: dict[str, ElementTable] = Field(min_length=1)
    gears: list[GearTable] = Field(min_length=1)
    inertia_kgm2: dict[str, Inertia] = Field(default_factory=dict)
    friction: FrictionEntry | None = None
    drive: Annotated[Drive, FromTable] | None = None
    converter: ConverterStageTable | None = None

    @field_validator("input", "output", mode="before")
    @classmethod
    def _refuse_power_split(cls, member: object) -> object:
        if isinstance(member, list):
            raise ValueError(f"a card has one input and one output; {POWER_SPLIT_REMEDY}")
        return member


def find_gearbox_faults(document: Mapping[str, Any]) -> list[Fault]:
    """Return all faults of a card file: those of the schema, or else those between tables."""
    faults = validate_schema(document, GearboxFile)
    if faults:
        return faults
    file = GearboxFile.model_validate(document)
    return [*_check_names(file), *_check_ends(file), *_check_members(file), *_check_gears(file)]


def _check_names(file: GearboxFile) -> Iterator[Fault]:
    """Sets, pairs and elements share one name space: torques are reported by these names."""
    seen: dict[str, str] = {}
    tables = (("sets", file.sets), ("pairs", file.pairs), ("elements", file.elements))
    for table, names in tables:
        for name in names:
            if name in seen:
                yield Fault(f"{table}.{name}", f"the name is already that of {seen[name]}.{name}")
            elif name == CONVERTER and file.converter is not None:
                yield Fault(f"{table}.{name}", "the name is that of the torque converter")
            seen[name] = table


def _check_ends(file: GearboxFile) -> Iterator[Fault]:
    """Input and output are two shafts; shafts that one set or pair joins are different ones."""
    if file.input == file.output:
        yield Fault("output", "input and output are the same member")
    for key, member in (("input", file.input), ("output", file.output)):
        if member == GROUND:
            yield Fault(key, "the ground does not turn; name a shaft")
    yield from _check_converter(file)
    for name, each in file.sets.items():
        if len({each.sun, each.ring, each.carrier}) < 3:
            yield Fault(f"sets.{name}", "sun, ring and carrier must be three members, or it locks")
    for name, pair in file.pairs.items():
        if pair.a == pair.b:
            yield Fault(f"pairs.{name}", "both wheels are on the same member")


def _check_converter(file: GearboxFile) -> Iterator[Fault]:
    """The turbine is the input, the pump a member of its own."""
    if file.converter is None:
        return
    if file.converter.turbine != file.input:
        text = (
            f"the turbine must be the input, {file.input!r}, from which ratios are counted; build "
            "a gearbox with a converter elsewhere as a network with drivetwin.Model"
        )
        yield Fault("converter.turbine", text)
    if file.converter.pump in (file.input, file.output, GROUND):
        yield Fault("converter.pump", "the pump must be a member of its own, that of the engine")


def _check_members(file: GearboxFile) -> Iterator[Fault]:
    """Every member of an end, an element or an inertia must belong to a set or a gear pair."""
    geared = {m for each in file.sets.values() for m in (each.sun, each.ring, each.carrier)}
    geared |= {m for pair in file.pairs.values() for m in (pair.a, pair.b)}
    joined = {m for element in file.elements.values() for m in element.members}
    ends = {file.input, file.output, GROUND}
    ends |= set() if file.converter is None else {file.converter.pump}
    known = geared | joined | (ends - {file.input, file.output, GROUND})
    for key, member in (("input", file.input), ("output", file.output)):
        if member not in known:
            yield Fault(key, f"no set, pair or element has a member {member!r}"
                        f"{suggest_spelling(member, known)}")  # fmt: skip
    for member in file.inertia_kgm2:
        if member == GROUND:
            yield Fault(f"inertia_kgm2.{member}", "the ground does not turn; name a shaft")
        elif member not in known:
            text = f"no set, pair or element has this member{suggest_spelling(member, known)}"
            yield Fault(f"inertia_kgm2.{member}", text)
    for name, element in file.elements.items():
        if element.members[0] == element.members[-1] and len(element.members) == 2:
            yield Fault(f"elements.{name}.members", "both sides are the same member")
        for member in element.members:
            if member not in geared | ends and (
                sum(member in other.members for other in file.elements.values()) < 2
            ):
                text = f"{member!r} belongs to nothing else{suggest_spelling(member, geared)}"
                yield Fault(f"elements.{name}.members", text)


def _check_gears(file: GearboxFile) -> Iterator[Fault]:
    """Gears have different names and engage elements of the card, each once."""
    seen: set[str] = set()
    for index, gear in enumerate(file.gears):
        if gear.name in seen:
            yield Fault(f"gears[{index}].name", f"gear {gear.name!r} is given twice")
        seen.add(gear.name)
        if len(set(gear.elements)) < len(gear.elements):
            yield Fault(f"gears[{index}].elements", "an element is given twice")
        for name in gear.elements:
            if name not in file.elements:
                text = f"no [elements.{name}]{suggest_spelling(name, file.elements)}"
                yield Fault(f"gears[{index}].elements", text)


_CARDS = Path(__file__).parent / "cards"


def list_builtin_gearboxes() -> tuple[str, ...]:
    """Names of the built-in cards, in alphabetical order."""
    return tuple(sorted(path.stem for path in _CARDS.glob("*.toml")))


def load_gearbox(card: Path | str) -> Gearbox:
    """Read a gearbox card: a path, or the name of a built-in one.

    Raises CardError that lists all faults by key path, or the built-in names where the card is
    neither.
    """
    path = _find(card)
    document = read_toml(path, CardError)
    raise_faults(
        find_gearbox_faults(document),
        CardError,
        str(card),
        "correct these keys of the gearbox card; docs/reference/gearbox-card.md describes them",
    )
    return build_gearbox(document)


def _find(card: Path | str) -> Path:
    builtin = _CARDS / f"{card}.toml"
    if str(card) in list_builtin_gearboxes():
        return builtin
    path = Path(card)
    if path.suffix or path.exists():
        return path
    raise CardError(
        f"no built-in gearbox {str(card)!r}{suggest_spelling(str(card), list_builtin_gearboxes())}",
        f"give a path to a card, or one of {', '.join(list_builtin_gearboxes())}",
    )


def build_gearbox(document: Mapping[str, Any]) -> Gearbox:
    """Return the gearbox of a document that has no faults (see `find_gearbox_faults`)."""
    file = GearboxFile.model_validate(document)
    return Gearbox(
        name=file.name,
        input=file.input,
        output=file.output,
        sets=tuple(table.to_spec(name) for name, table in file.sets.items()),
        pairs=tuple(table.to_spec(name) for name, table in file.pairs.items()),
        elements={name: e.to_spec(name, file.friction) for name, e in file.elements.items()},
        gears=tuple(gear.to_spec() for gear in file.gears),
        inertias=dict(file.inertia_kgm2),
        source=file.source,
        drive=file.drive,
        converter=None if file.converter is None else file.converter.to_stage(),
    )

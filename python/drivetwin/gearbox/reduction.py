# SPDX-License-Identifier: MIT
"""A gearbox as a network, and a shift of it as a dual clutch (THEORY section 2).

The reduced shift gives the dual-clutch driveline of THEORY section 3.
"""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from drivetwin._native import reduce_shift as native_reduce_shift
from drivetwin.errors import ReductionError
from drivetwin.gearbox.spec import CONVERTER, Capacity, Drive, ElementKind, Gearbox, ShiftMember
from drivetwin.simulation.driveline import build_clutch
from drivetwin.simulation.dual_clutch import DualClutch, FrictionTable, RoadLoad, ShiftElement
from drivetwin.simulation.network import Element, build_element

if TYPE_CHECKING:
    from drivetwin.gearbox.spec import Gearbox


_NO_CAPACITY = Capacity(gain=0.0, P0=0.0, peak=1.0, friction=FrictionTable((0.0,), (0.0,)))
_DOG = Capacity(gain=1.0, P0=0.0, peak=1.0, friction=FrictionTable((0.0,), (1.0,)))
"""Unit friction and gain: the input of a dog is its torque capacity [N m]."""


def build_network_elements(
    gearbox: Gearbox, engaged_dogs: Collection[str] | None = None
) -> tuple[Element, ...]:
    """Return the gearbox as elements of the core, its members as nodes.

    Every clutch and brake has a pressure input [Pa] of its own name, freewheels have none. Dogs
    that are in `engaged_dogs` become rigid and the others are left out. Without it, all stay as
    friction elements whose inputs are their torque capacities [N m].
    """
    return (
        *_build_gearing(gearbox),
        *_build_converter(gearbox),
        *(
            build_element("inertia", f"J {member}", node=member, inertia=inertia)
            for member, inertia in gearbox.inertias.items()
            if inertia > 0.0
        ),
        *_build_shift_elements(gearbox, engaged_dogs),
    )


def as_json(gearbox: Gearbox) -> str:
    """Return the gearbox as the driveline that the core reads, dogs as friction elements."""
    return json.dumps({"elements": build_network_elements(gearbox)})


def _build_gearing(gearbox: Gearbox) -> Iterator[Element]:
    for each in gearbox.sets:
        fields = {"sun": each.sun, "ring": each.ring, "carrier": each.carrier, "z": each.z}
        if each.planet_inertia > 0.0:
            fields["planet_inertia"] = each.planet_inertia
        yield build_element("planetary", each.name, **fields)
    for pair in gearbox.pairs:
        yield build_element("gear", pair.name, a=pair.a, b=pair.b, ratio=pair.ratio)


def _build_converter(gearbox: Gearbox) -> list[Element]:
    stage = gearbox.converter
    if stage is None:
        return []
    ends = {"pump": stage.pump, "turbine": gearbox.input}
    return [build_element("torque_converter", CONVERTER, **ends, map=asdict(stage.map))]


def _build_shift_elements(
    gearbox: Gearbox, engaged_dogs: Collection[str] | None
) -> Iterator[Element]:
    for element in gearbox.elements.values():
        if element.kind is ElementKind.FREEWHEEL:
            yield build_element("one_way_clutch", element.name, a=element.a, b=element.b)
        elif engaged_dogs is None or element.kind is not ElementKind.DOG:
            yield _build_friction(element)
        elif element.name in engaged_dogs:
            yield build_element("gear", element.name, a=element.a, b=element.b, ratio=1.0)


def _build_friction(element: ShiftMember) -> Element:
    bare = _DOG if element.kind is ElementKind.DOG else _NO_CAPACITY
    capacity = element.capacity or bare
    nodes, law = (element.a, element.b), capacity.friction
    return build_clutch(element.name, nodes, law, capacity.gain, capacity.P0, capacity.peak)


def build_dual_clutch(reduction: Reduction, drive: Drive, *, keep_coupling: bool) -> DualClutch:
    """Return the dual-clutch driveline; see `Reduction.dual_clutch`."""
    pair = (reduction.off_going, reduction.on_coming)
    drums = _compute_drum_inertias(reduction, drive) if keep_coupling else (0.0, 0.0)
    drums_in = sum(drum / each.i_c**2 for drum, each in zip(drums, pair, strict=True))
    drums_out = sum(drum * each.i_out**2 for drum, each in zip(drums, pair, strict=True))
    return DualClutch(
        J1=drive.engine_inertia + reduction.M11 - drums_in,
        J2e=0.0,
        eta=1.0,
        loss_law="dissipative",
        i_in=1.0,
        J_out=reduction.M22 - drums_out,
        **vars(drive.build_output_side(RoadLoad(constant=drive.load_torque))),
        elements=(
            build_shift_element(reduction.gearbox, pair[0], drums[0]),
            build_shift_element(reduction.gearbox, pair[1], drums[1]),
        ),
    )


def build_shift_element(gearbox: Gearbox, ratios: ElementRatios, drum: float) -> ShiftElement:
    """Return a shift element of the form, with a drum of inertia `drum` [kg m^2]."""
    capacity = gearbox.get_capacity(ratios.element)
    return ShiftElement(
        name=ratios.element,
        i_c=ratios.i_c,
        i_out=ratios.i_out,
        gain=capacity.gain,
        P0=capacity.P0,
        friction=capacity.friction,
        peak=capacity.peak,
        drum_inertia=drum,
    )


def _compute_drum_inertias(reduction: Reduction, drive: Drive) -> tuple[float, float]:
    """Drum inertias (off-going, on-coming) that carry M12 together.

    A drum I on element k couples by -I·i_out/i_c and takes I/i_c², I·i_out² from the two sides,
    which must keep something. The drum goes where the output side keeps more.
    """
    if reduction.exact:
        return 0.0, 0.0
    M12 = reduction.M12
    best = (0.0, 0.0)
    room = 0.0
    for index, each in enumerate((reduction.off_going, reduction.on_coming)):
        drum = -M12 * each.i_c / each.i_out
        left_in = drive.engine_inertia + reduction.M11 - drum / each.i_c**2
        left_out = reduction.M22 - drum * each.i_out**2
        if drum > 0.0 and left_in > 0.0 and left_out > room:
            room = left_out
            best = (drum, 0.0) if index == 0 else (0.0, drum)
    if best == (0.0, 0.0):
        raise ReductionError(
            f"no drum inertia of {reduction.off_going.element} or {reduction.on_coming.element} "
            f"can carry M12 = {M12:.4g} kg·m² of shift {reduction.from_gear}-{reduction.to_gear}",
            "leave the coupling out (keep_coupling=False) and read its simulated error, or "
            "simulate the whole gearbox",
        )
    return best


_NO_COUPLING = 1e-9
"""|M12| over √(M11·M22) up to which it is round-off."""


@dataclass(frozen=True)
class ElementRatios:
    """slip = ω_in/i_c - i_out·ω_out (eq. 15) with i_c > 0.

    `sense` is 1 where that is the element's own slip ω_a - ω_b, -1 where it is the negative.
    """

    element: str
    i_c: float
    i_out: float
    sense: float

    @property
    def ratio(self) -> float:
        """ω_in/ω_out with this element locked."""
        return self.i_c * self.i_out


@dataclass(frozen=True)
class MemberInertia:
    """A member of `inertia` [kg m^2] that runs at ω = a·ω_in - b·ω_out."""

    member: str
    inertia: float
    a: float
    b: float

    @property
    def coupling(self) -> float:
        """Contribution -I·a·b to M12 [kg m^2]."""
        return -self.inertia * self.a * self.b


@dataclass(frozen=True)
class Reduction:
    """The dual-clutch form of one shift; inertias [kg m^2] of the gearbox alone.

    `common` stays engaged throughout; `members` are all inertias that move.
    """

    gearbox: Gearbox
    from_gear: str
    to_gear: str
    off_going: ElementRatios
    on_coming: ElementRatios
    common: tuple[str, ...]
    members: tuple[MemberInertia, ...]

    @property
    def M11(self) -> float:
        """Inertia at the input, kg m^2."""
        return sum(each.inertia * each.a**2 for each in self.members)

    @property
    def M12(self) -> float:
        """Coupling of input and output, kg m^2."""
        return sum(each.coupling for each in self.members)

    @property
    def M22(self) -> float:
        """Inertia at the output, kg m^2."""
        return sum(each.inertia * each.b**2 for each in self.members)

    @property
    def coupling_ratio(self) -> float:
        """|M12|/√(M11·M22); 0 where nothing couples."""
        scale = math.sqrt(self.M11 * self.M22)
        return abs(self.M12) / scale if scale > 0.0 else 0.0

    @property
    def violations(self) -> tuple[MemberInertia, ...]:
        """Members that run with both shafts, by the size of their coupling."""
        floor = _NO_COUPLING * math.sqrt(self.M11 * self.M22)
        coupled = [each for each in self.members if abs(each.coupling) > floor]
        return tuple(sorted(coupled, key=lambda each: -abs(each.coupling)))

    @property
    def exact(self) -> bool:
        """True if the dual-clutch form is exact, i.e. M12 is zero."""
        return self.coupling_ratio <= _NO_COUPLING

    def describe_condition(self) -> str:
        """Condition (1) of the paper in words, for this shift."""
        if not self.violations:
            return (
                "Condition (1) holds: no member that turns with both shafts has an inertia, so the "
                "dual-clutch form is exact."
            )
        names = ", ".join(f"{each.member} ({each.coupling:+.4g} kg·m²)" for each in self.violations)
        if self.exact:
            return (
                "The dual-clutch form is exact although members turn with both shafts: their "
                f"couplings cancel: {names}."
            )
        return (
            "Condition (1) is violated: these members turn with both shafts and couple input and "
            f"output: {names}. Together M12 = {self.M12:.4g} kg·m², "
            f"{100 * self.coupling_ratio:.3g} % of √(M11·M22)."
        )

    def build_dual_clutch(
        self, drive: Drive | None = None, *, keep_coupling: bool = True
    ) -> DualClutch:
        """Return the dual-clutch driveline of this shift in the given drive (the card's, if None).

        With `keep_coupling`, M12 is carried by drum inertias of the two elements, as -I·a·b, I·a²,
        I·b² of a member that rotates at slip speed; without, it is left out and the diagonal kept.
        Raises ReductionError where an element states no capacity, or no drum can carry M12.
        """
        return build_dual_clutch(
            self, drive or self.gearbox.require_drive(), keep_coupling=keep_coupling
        )


def reduce(gearbox: Gearbox, from_gear: str, to_gear: str) -> Reduction:
    """Reduce the shift between two gears of a gearbox to the dual-clutch form.

    Raises ReductionError, with the reason, where the shift is not one element off and one on, or
    where more or fewer than the two speeds of input and output remain in its middle.
    """
    old, new = gearbox.get_gear(from_gear), gearbox.get_gear(to_gear)
    try:
        off_going, on_coming, common, members = native_reduce_shift(
            as_json(gearbox),
            list(old.elements),
            list(new.elements),
            list(gearbox.dogs),
            (gearbox.input, gearbox.output),
        )
    except ValueError as error:
        raise ReductionError(
            f"shift {from_gear}-{to_gear} of {gearbox.name} has no dual-clutch form: {error}",
            "choose a shift that releases one element and applies one, such as between "
            "neighbouring gears, or simulate the whole gearbox",
        ) from error
    return Reduction(
        gearbox=gearbox,
        from_gear=from_gear,
        to_gear=to_gear,
        off_going=ElementRatios(*off_going),
        on_coming=ElementRatios(*on_coming),
        common=tuple(common),
        members=tuple(
            MemberInertia(_format_label(gearbox, name), inertia, a, b)
            for name, inertia, a, b in members
        ),
    )


def _format_label(gearbox: Gearbox, name: str) -> str:
    """Name the spin of planets, which the core gives as `carrier + sun`, after their set."""
    for each in gearbox.sets:
        if name == f"{each.carrier} + {each.sun}":
            return f"planets of {each.name}"
    return name

# SPDX-License-Identifier: MIT
"""From a reduced shift to the dual-clutch driveline of THEORY section 3."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drivetwin.errors import ReductionError
from drivetwin.gearbox.drive import Drive
from drivetwin.simulation.dual_clutch import DualClutch, RoadLoad, ShiftElement

if TYPE_CHECKING:
    from drivetwin.gearbox.reduction import ElementRatios, Reduction
    from drivetwin.gearbox.spec import Gearbox


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
            "leave the coupling out (keep_coupling=False) and read the estimate of its error, or "
            "simulate the whole gearbox",
        )
    return best

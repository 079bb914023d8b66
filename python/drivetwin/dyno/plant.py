# SPDX-License-Identifier: MIT
"""The whole gearbox on the virtual dynamometer, and the dual-clutch form that it has."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from drivetwin.gearbox import Gearbox, build_network_elements, reduce, solve_gear
from drivetwin.gearbox.reduction import ElementRatios, build_shift_element
from drivetwin.simulation.driveline import (
    ENGINE,
    SHAFT,
    WHEEL,
    OutputSide,
    build_engine_side,
    build_shaft,
    build_vehicle,
    require_own_nodes,
)
from drivetwin.simulation.driveline_run import build_trajectory, list_motion_outputs
from drivetwin.simulation.dual_clutch import (
    ENGINE_TORQUE,
    DualClutch,
    FloatArray,
    Signal,
    State,
    Trajectory,
)
from drivetwin.simulation.element_schema import GROUND
from drivetwin.simulation.network import Element, Start, build_element, simulate

_MAIN = 2e6
"""Pressure of an element that stays closed throughout, Pa."""


@dataclass(frozen=True)
class Plant:
    """A gearbox with all its members between engine and output shaft.

    `gears` are shifted through; `losses` of the model act before the gearbox. The `ratios` of each
    shift element are those of eq. 15; `common` elements stay closed.
    """

    gearbox: Gearbox
    gears: tuple[str, ...]
    ratios: Mapping[str, ElementRatios]
    common: tuple[str, ...]

    @property
    def name(self) -> str:
        """Name of the gearbox."""
        return self.gearbox.name

    def simulate(
        self,
        model: DualClutch,
        engine_torque: Signal,
        pressures: Mapping[str, Signal],
        start: State,
        time: FloatArray,
    ) -> Trajectory:
        """Run the gearbox in the driveline of `model`, as `driveline.simulate` runs its form.

        Slip and torque of the shift elements are those of the form (eq. 15).
        Raises InputError where the description is inconsistent; a failed run returns its status.
        """
        end = np.array([0.0, float(time[-1])])
        idle = {name: Signal(end, np.zeros(2)) for name in self.gearbox.elements}
        closed = {name: Signal(end, np.full(2, _MAIN)) for name in self.common}
        names, output = list(self.ratios), self.gearbox.output
        run = simulate(
            self._build_elements(model),
            {**idle, **closed, **pressures, ENGINE_TORQUE: engine_torque},
            self._start(start),
            time,
            list_motion_outputs(names, output),
        )
        found = build_trajectory(run, names, output)
        sense = {name: each.sense for name, each in self.ratios.items()}
        return replace(
            found,
            clutch_torque={n: sense[n] * found.clutch_torque[n] for n in sense},
            slip={n: sense[n] * found.slip[n] for n in sense},
        )

    def _build_elements(self, model: DualClutch) -> list[Element]:
        loss = {"law": model.loss_law, "eta": model.eta}
        box, side = self.gearbox, OutputSide.from_model(model)
        gearing = build_network_elements(box)
        require_own_nodes(gearing)
        return [
            *build_engine_side(model.J1),
            build_element("gear", "losses", a=ENGINE, b=box.input, ratio=1.0, loss=loss),
            *gearing,
            *build_shaft(side, box.output),
            *build_vehicle(side),
        ]

    def _start(self, start: State) -> Start:
        """The state in the gear that `start` holds; the members turn as that gear makes them."""
        gear = next(
            name for name in self.gears if start.locked[0] in self.gearbox.get_gear(name).elements
        )
        members = solve_gear(self.gearbox, gear).speeds
        speeds = {name: start.engine_speed * (each or 0.0) for name, each in members.items()}
        return Start(
            {**speeds, ENGINE: start.engine_speed, WHEEL: start.wheel_speed},
            {SHAFT: start.twist},
            (*start.locked, *self.common),
        )


def build_plant(gearbox: Gearbox, gears: tuple[str, ...]) -> Plant:
    """Prepare a gearbox for up-shifts through `gears`, all with the same elements in common.

    Raises ReductionError for a shift that is not one element off and one on, InputError for a card
    with a converter or freewheels.
    """
    gearbox.require_pressed_alone("the dynamometer")
    shifts = [reduce(gearbox, old, new) for old, new in pairwise(gears)]
    ratios = {each.element: each for s in shifts for each in (s.off_going, s.on_coming)}
    return Plant(gearbox, gears, ratios, shifts[0].common)


def build_form(plant: Plant, J1: float, eta: float, side: OutputSide) -> DualClutch:
    """Return the dual-clutch form of a gearbox behind an engine and before its output side.

    `J1` [kg m^2] and `eta` are as in `DualClutch`.

    A member that is the drum of a shift element runs with its slip and becomes its drum inertia.
    All others count with their parts on the diagonal; where one of them turns with both shafts the
    form is not exact (THEORY section 2).
    """
    box = plant.gearbox
    shift = reduce(box, *plant.gears[:2])
    drums = {box.elements[name].a: name for name in plant.ratios if _is_brake(box, name)}
    others = [each for each in shift.members if each.member not in drums]
    return DualClutch(
        J1=J1,
        J2e=sum(each.inertia * each.a**2 for each in others),
        eta=eta,
        loss_law="paper",
        i_in=1.0,
        J_out=sum(each.inertia * each.b**2 for each in others),
        **vars(side),
        elements=tuple(
            build_shift_element(box, each, _get_drum_inertia(box, each.element))
            for each in plant.ratios.values()
        ),
    )


def _is_brake(gearbox: Gearbox, element: str) -> bool:
    return gearbox.elements[element].b == GROUND


def _get_drum_inertia(gearbox: Gearbox, element: str) -> float:
    """Inertia of the member that a brake holds; 0 for a clutch."""
    member = gearbox.elements[element].a
    drum = gearbox.inertias.get(member, 0.0)
    return drum if _is_brake(gearbox, element) else 0.0

# SPDX-License-Identifier: MIT
"""Scenarios on the whole gearbox: a three-set six-speed with drums that have inertia.

`gearbox` shifts from 2nd to 3rd gear after throttle steps, `gearbox_chain` goes on to 4th. The
pressures come from hydraulic actuators that fill first.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from drivetwin.dyno.actuators import Actuator, Fill, Program, Vibration
from drivetwin.dyno.dual_scenarios import can_torque, log_sensors, torque_steps
from drivetwin.dyno.names import ScenarioName
from drivetwin.dyno.plant import Surroundings, form_of, plant_of
from drivetwin.dyno.scenario import HeldGear, Scenario, TorqueReduction
from drivetwin.gearbox import Gearbox, load_gearbox
from drivetwin.simulation.dual_clutch import RoadLoad

DRUM = 0.05
"""Inertia of each brake drum, kg m^2: usual for a heavy-duty gearbox."""
_CARD = "three-set-4000cr"
_STEPS = (1545.0, 2000.0, 900.0, 1800.0, 600.0, 1900.0, 1100.0, 1545.0)
"""Levels of the throttle steps, N m."""
_MAIN = 1.6e6
_KISS = 7.6e4
"""Pressure just below the end of the fill, Pa."""
_FILL = Fill(spring=7.0e4, boost=4.0e5, time=0.06)
_DEAD_TIME, _LAG = 0.012, 0.020
_SWITCH = 0.002
"""Time in which the valve is switched to boost and back, s."""
_RELEASE = 0.06
"""Time in which the off-going element falls to its holding pressure, s."""
_FINAL = 0.9
"""Time from the torque phase to the rise to main pressure, s: the element has locked."""


@dataclass(frozen=True)
class _Shift:
    """One up-shift: torque phase from `at` [s] within `handover` [s], levels in Pa.

    The off-going element waits at `holding`; the on-coming one rises to `level`, which falls by
    `relief` until the final rise.
    """

    at: float
    handover: float
    holding: float
    level: float
    relief: float

    def leaving(self) -> tuple[tuple[float, float], ...]:
        """Command of the off-going element."""
        return (
            (self.at - _RELEASE, _MAIN),
            (self.at, self.holding),
            (self.at + self.handover, 0.0),
        )

    def coming(self) -> tuple[tuple[float, float], ...]:
        """Command of the on-coming element: fill with boost, wait, torque phase, inertia phase."""
        filled = self.at - _RELEASE
        start = filled - _FILL.time
        return (
            (start, 0.0),
            (start + _SWITCH, _FILL.boost),
            (filled - _SWITCH, _FILL.boost),
            (filled, _KISS),
            (self.at, _KISS),
            (self.at + self.handover, self.level),
            (self.at + _FINAL, self.level - self.relief),
            (self.at + _FINAL + 0.08, _MAIN),
        )

    def vibration(self) -> Vibration:
        """Pressure oscillation of the valve in the inertia phase, as in Fig. 4."""
        return Vibration(2.0e4, 18.0, self.at + self.handover, self.at + 0.7)

    def reduction(self) -> TorqueReduction:
        """Window of the TCU's torque intervention: the inertia phase."""
        return TorqueReduction(0.0, self.at + self.handover, self.at + 0.4)


_TWO_THREE = _Shift(at=2.20, handover=0.16, holding=4.2e5, level=5.4e5, relief=0.2e5)
_THREE_FOUR = _Shift(at=5.20, handover=0.16, holding=3.4e5, level=6.0e5, relief=0.4e5)


def _gearbox(drum: float) -> Gearbox:
    """The card with these brake drums, and without what the dual-clutch form cannot carry.

    C2 = R3, the drum of an open brake, turns with both shafts.
    """
    box = load_gearbox(_CARD)
    return replace(box, inertias={**box.inertias, "R1": drum, "R2-C1": drum, "R3-C2": 0.0})


def gearbox(drum: float = DRUM) -> Scenario:
    """Throttle steps in 2nd gear and a shift to 3rd, surroundings as in the scenario `paper`."""
    demand = torque_steps(0.3, 0.24, _STEPS)
    return _scenario(ScenarioName.GEARBOX, (_TWO_THREE,), drum, (172.0, 2300.0), demand)


def gearbox_chain(drum: float = DRUM) -> Scenario:
    """Scenario `gearbox` with a lighter load, and a shift to 4th gear after steps in 3rd."""
    first, second = torque_steps(0.3, 0.24, _STEPS), torque_steps(3.7, 0.2, _STEPS)
    demand = Program((*first.knots, *second.knots[1:]))
    shifts = (_TWO_THREE, _THREE_FOUR)
    return _scenario(ScenarioName.GEARBOX_CHAIN, shifts, drum, (190.0, 1200.0), demand)


def _scenario(
    name: ScenarioName,
    shifts: tuple[_Shift, ...],
    drum: float,
    start: tuple[float, float],
    demand: Program,
) -> Scenario:
    """`start` holds the engine speed [rad/s] and the load at the output [N m]."""
    box = _gearbox(drum)
    gears = ("2", "3", "4")[: len(shifts) + 1]
    plant = plant_of(box, gears)
    drive = box.require_drive()
    speed, load = start
    around = Surroundings(
        J1=drive.engine_inertia,
        eta=0.85,
        i_f=drive.i_f,
        J_v=drive.vehicle_inertia,
        k_o=drive.k_o,
        c_o=drive.c_o,
        load=RoadLoad(constant=load * drive.i_f),
    )
    held = tuple(HeldGear(gear, element) for gear, element in zip(gears, plant.ratios, strict=True))
    sensors = log_sensors(
        can_torque(resolution=12.5, delay=0.010),
        {gear.element: f"Prs{gear.element}" for gear in held},
        30.0,
        (0.05, 0.03, 0.0065),
        7.0e3,
    )
    return Scenario(
        name=name,
        model=form_of(plant, around),
        gears=held,
        duration=shifts[-1].at + 2.8,
        engine_speed=speed,
        engine_torque=demand,
        actuators=_actuators(held, shifts),
        sensors=sensors,
        J_prime_range=(5.0, 40.0),
        J_vehicle_range=(5000.0, 9000.0),
        reductions=tuple(shift.reduction() for shift in shifts),
        plant=plant,
    )


def _actuators(gears: tuple[HeldGear, ...], shifts: tuple[_Shift, ...]) -> dict[str, Actuator]:
    """Each element comes with the shift into its gear and leaves with the one out of it."""
    found = {}
    for index, gear in enumerate(gears):
        coming = shifts[index - 1] if index > 0 else None
        leaving = shifts[index] if index < len(shifts) else None
        knots = (
            *(coming.coming() if coming else ()),
            *(leaving.leaving() if leaving else ()),
        )
        vibration = coming.vibration() if coming else None
        found[gear.element] = Actuator(Program(knots), _DEAD_TIME, _LAG, vibration, _FILL)
    return found

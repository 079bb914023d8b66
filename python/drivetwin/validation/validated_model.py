# SPDX-License-Identifier: MIT
"""Identification with the simulation over the measurement, in one call."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from drivetwin._util.arrays import FloatArray
from drivetwin._util.check_arguments import check_arguments
from drivetwin._util.progress import TimedStages
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Estimate, EstimatesMixin
from drivetwin.estimation.result.method import DEFAULT_METHOD, Method
from drivetwin.estimation.result.validation import Validation
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import FoundShifts, detect_shifts
from drivetwin.twin.build import build_twin
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import attach_validation, simulate_shift
from drivetwin.vehicle.vehicle_card import VehicleCard

_STAGES = TimedStages("validated model", ("identification", "simulation"))


@dataclass(frozen=True, eq=False, repr=False)
class ValidatedModel(EstimatesMixin):
    """A `result` with the verdict on the model, and the `twin` with its values and verdicts."""

    result: Identification
    twin: Twin

    @property
    def estimates(self) -> Mapping[str, Estimate]:  # type: ignore[override] # read-only
        """Estimates of the result by parameter id."""
        return self.result.estimates

    def draw(self, count: int, *, seed: int = 0) -> dict[str, FloatArray]:
        """Draw values of the parameters, as `Identification.draw`."""
        return self.result.draw(count, seed=seed)

    def simulate(self, log: ShiftLog, **changed: float) -> tuple[Validation, ...]:
        """Simulate the shifts of a log, driven by its measured inputs.

        Parameters
        ----------
        log
            The log of the identification, or another one of the same vehicle.
        changed
            Values that replace those of the twin, by parameter id, SI: `J_vehicle=7000.0`.

        Returns
        -------
        tuple of Validation
            Simulation beside measurement of each shift in the order of time.

        Raises
        ------
        DrivetwinError
            As `simulate_shift`, and InputError for a value on which no shift depends.
        """
        found = detect_shifts(log, self.twin.build_card()).shifts
        models = (self.twin.build_dual_clutch(shift, overrides=changed) for shift in found)
        pairs = zip(found, models, strict=True)
        return tuple(simulate_shift(self.twin, log, shift, model) for shift, model in pairs)

    def __repr__(self) -> str:
        return f"<ValidatedModel: {self.result!r}>"


@check_arguments
def identify_validated(
    log: ShiftLog,
    card: VehicleCard,
    shifts: FoundShifts | None = None,
    method: Method = DEFAULT_METHOD,
    *,
    fixed: Mapping[str, float] = MappingProxyType({}),
    priors: Mapping[str, tuple[float, float]] = MappingProxyType({}),
    bounds: Mapping[str, tuple[float, float]] = MappingProxyType({}),
) -> ValidatedModel:
    """Identify a log, simulate its shifts, and set the verdict, as the command `identify` does.

    Parameters
    ----------
    log, card : the channels of a recording and the design data of its vehicle
    shifts : result of `detect_shifts`; None: they are detected
    method, fixed, priors, bounds : as in `identify`

    Returns
    -------
    ValidatedModel
        The validated result and its twin.

    Raises
    ------
    DrivetwinError
        As `identify`, and MissingParameterError where the model cannot be simulated.
    """
    found = detect_shifts(log, card) if shifts is None else shifts
    with _STAGES.enter("identification"):
        result = identify(log, card, found, method, fixed=fixed, priors=priors, bounds=bounds)
    with _STAGES.enter("simulation", "simulating the shifts"):
        result = attach_validation(result, build_twin(result, card), log)
    return ValidatedModel(result, build_twin(result, card))  # with the verdicts of the gate

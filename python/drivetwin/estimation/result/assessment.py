# SPDX-License-Identifier: MIT
"""Builder of estimates and verdicts from the normal distribution of fitted parameters."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.data.shift_data import KnownDriveline
from drivetwin.estimation.result.estimate import Estimate
from drivetwin.estimation.result.prior_conflict import (
    Contradiction,
    apply_contradictions,
    find_contradictions,
)
from drivetwin.estimation.result.verdict import assess, assess_with_prior, from_prior
from drivetwin.findings import Code, Finding
from drivetwin.vehicle.spec import PriorValue


@dataclass(frozen=True, eq=False)
class FittedParameters:
    """Parameters of a fit: `values` (q,) by id with `covariance` (q, q) and `std` (q,) from noise.

    `systematic` are the standard deviations from sensor tolerances and effects by id, `notes`
    findings by id. `method` names the estimator, `prior_method` that of parameters whose design
    value took part. `total` (q, q) is the covariance with tolerances and effects; None where only
    their standard deviations are known.
    """

    ids: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    std: FloatArray
    driveline: KnownDriveline
    systematic: Mapping[str, float]
    notes: Mapping[str, Finding]
    method: str
    prior_method: str
    total: FloatArray | None = None

    @cached_property
    def priors(self) -> dict[str, PriorValue]:
        """Design values of the parameters by id."""
        found = {name: self.driveline.find_prior(name) for name in self.ids}
        return {name: prior for name, prior in found.items() if prior is not None}

    @cached_property
    def conflicts(self) -> tuple[Contradiction, ...]:
        """Design values that the log contradicts, by all that is uncertain."""
        if self.total is not None:
            return find_contradictions(self.ids, self.values, self.total, self.priors, {})
        return find_contradictions(
            self.ids, self.values, self.covariance, self.priors, self.systematic
        )

    def assess(self) -> dict[str, Estimate]:
        """Return the estimates by id with the verdict of their intervals."""
        rows = zip(self.ids, self.values.tolist(), self.std.tolist(), strict=True)
        return {name: self._assess_parameter(name, value, std) for name, value, std in rows}

    def list_conflicts(self, withdrawn: Collection[str]) -> tuple[Contradiction, ...]:
        """List the contradicted design values whose own estimates are not `withdrawn`.

        An empty id withdraws all: a model that does not explain the log accuses no entry.
        """
        kept = () if "" in withdrawn else self.conflicts
        return tuple(one for one in kept if one.id not in withdrawn)

    def downgrade_conflicts(
        self, estimates: Mapping[str, Estimate], conflicts: Sequence[Contradiction]
    ) -> dict[str, Estimate]:
        """Return the estimates, none identified that a contradicted design value decides."""
        return apply_contradictions(estimates, conflicts, self.prior_method)

    def _assess_parameter(self, name: str, value: float, std: float) -> Estimate:
        prior, systematic = self.priors.get(name), self.systematic.get(name)
        note = self.notes[name].reason if name in self.notes else ""
        if prior is None:
            return assess(name, value, std, self.method, systematic, note)
        computed = name, value, std
        return assess_with_prior(computed, prior, self.prior_method, systematic, note)


def collect_fill_pressures(drivelines: Sequence[KnownDriveline], code: Code) -> dict[str, Estimate]:
    """Return the card's P0 of the elements of all shifts, with the reason `code`."""
    elements = (element for one in drivelines for element in (one.offgoing, one.oncoming))
    fills = {f"P0.{element.name}": element.P0 for element in elements}
    return {name: from_prior(name, prior, code) for name, prior in fills.items()}

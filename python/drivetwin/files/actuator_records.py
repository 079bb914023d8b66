# SPDX-License-Identifier: MIT
"""Records of an actuator in `twin.toml` and `result.json`."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from pydantic import Field, FiniteFloat, model_validator

from drivetwin.actuator.identify import ActuatorSource, IdentifiedActuator
from drivetwin.actuator.model import QUANTITIES, ActuatorModel
from drivetwin.files.records import CovarianceRecord, Record


class ActuatorValueRecord(Record):
    """A parameter of an actuator, SI; without `std` where the log does not determine it."""

    value: FiniteFloat
    unit: str
    std: FiniteFloat | None = Field(default=None, ge=0)


class ActuatorRecord(Record):
    """Actuator of an element: parameters by name, covariance, root mean square residual.

    `source` is what it is identified from beside the command. The residual of a pressure is
    `rms_Pa`, that of a torque balance `rms_over_noise`. `samples` is 0 for design values of the
    vehicle card, which have a `std` of 0, and for the assumed values of another element.
    """

    parameters: dict[str, ActuatorValueRecord]
    covariance: CovarianceRecord
    rms_Pa: FiniteFloat = Field(default=0.0, ge=0)
    rms_over_noise: FiniteFloat = Field(default=0.0, ge=0)
    samples: int = Field(default=0, ge=0)
    source: ActuatorSource = ActuatorSource.PRESSURE

    @model_validator(mode="before")
    @classmethod
    def _read_actuator(cls, source: Any) -> Any:
        if not isinstance(source, IdentifiedActuator):
            return source
        known = np.isfinite(source.std)
        names, values, stds = list(QUANTITIES), source.model.values.tolist(), source.std.tolist()
        return {
            "parameters": {
                name: {
                    "value": value,
                    "unit": QUANTITIES[name].unit,
                    "std": std if np.isfinite(std) else None,
                }
                for name, value, std in zip(names, values, stds, strict=True)
            },
            "covariance": {
                "ids": [name for name, one in zip(names, known, strict=True) if one],
                "matrix": source.covariance[np.ix_(known, known)].tolist(),
            },
            "rms_over_noise" if source.source is ActuatorSource.TORQUE else "rms_Pa": source.rms,
            "samples": source.samples,
            "source": source.source,
        }

    @model_validator(mode="after")
    def _check_parameters(self) -> Self:
        if set(self.parameters) != set(QUANTITIES):
            raise ValueError(f"parameters must be {', '.join(QUANTITIES)}")
        for name, one in self.parameters.items():
            spec = QUANTITIES[name]
            if one.unit != spec.unit:
                raise ValueError(f"{name} is in {one.unit!r}, but is read in {spec.unit!r}")
            if not spec.lower <= one.value <= spec.upper:
                raise ValueError(f"{name} must be from {spec.lower:g} to {spec.upper:g}")
        if unknown := [name for name in self.covariance.ids if name not in QUANTITIES]:
            raise ValueError(f"covariance has no parameter {', '.join(unknown)}")
        return self

    def to_actuator(self) -> IdentifiedActuator:
        """Return the actuator."""
        names = list(QUANTITIES)
        covariance = np.zeros((len(names), len(names)))
        index = [names.index(name) for name in self.covariance.ids]
        covariance[np.ix_(index, index)] = np.reshape(
            self.covariance.matrix, (len(index), len(index))
        )
        for k in set(range(len(names))) - set(index):
            covariance[k, k] = np.inf
        rms = self.rms_over_noise if self.source is ActuatorSource.TORQUE else self.rms_Pa
        model = ActuatorModel(**{name: one.value for name, one in self.parameters.items()})
        return IdentifiedActuator(model, covariance, rms, self.samples, self.source)

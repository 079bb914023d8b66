# SPDX-License-Identifier: MIT
"""Records shared by `result.json` and `twin.toml`, and reading of their files.

Every error of a file names the faulty key.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar

import numpy as np
import tomlkit
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    ValidationInfo,
    model_validator,
)

from drivetwin._util.arrays import FloatArray, convert_nonfinite, format_json
from drivetwin._util.atomic import LARGEST_RECORD, measure_regular_file, write_text
from drivetwin._util.toml import raise_faults, validate_schema
from drivetwin.actuator.model import QUANTITIES, ActuatorModel, ActuatorSource, IdentifiedActuator
from drivetwin.errors import ResultFileError, Where
from drivetwin.estimation.result.estimate import (
    OF_RATIO,
    CardNumber,
    Estimate,
    Experiment,
    ExperimentRanking,
    FrictionCurve,
    Verdict,
)
from drivetwin.findings import Code, Finding, Number, Row, Severity, list_fields
from drivetwin.parameters import get_parameter_spec
from drivetwin.simulation.dual_clutch import Stribeck
from drivetwin.vehicle.spec import PriorValue

READING = {"reads": True}
"""Context of a validation that reads a file: a number beyond its range is a fault of the file.

A record of a result is written as computed, so that a damaged result can still be looked at.
"""


def _convert_missing(value: object, info: ValidationInfo) -> object:
    """Return None for NaN, and for an infinity that was computed; a file may not state one."""
    is_stated = info.context == READING and value in (math.inf, -math.inf)
    return value if is_stated else convert_nonfinite(value)


def _check_friction(mu: float, info: ValidationInfo) -> float:
    """Refuse a negative friction coefficient of a file."""
    if info.context == READING and mu < 0.0:
        raise ValueError(f"{mu:g} is no friction coefficient; the range is 0 and above")
    return mu


OptionalFloat = Annotated[FiniteFloat | None, BeforeValidator(_convert_missing)]
Deviation = Annotated[Annotated[FiniteFloat, Field(ge=0)] | None, BeforeValidator(_convert_missing)]
"""A standard deviation; None where it is unknown."""
FrictionCoefficient = Annotated[FiniteFloat, AfterValidator(_check_friction)]
Interval = tuple[FiniteFloat, FiniteFloat]


def _close_interval(value: object) -> object:
    """Return None for an interval of an estimate that is open on a side."""
    return None if isinstance(value, tuple) and not np.isfinite(value).all() else value


OptionalInterval = Annotated[Interval | None, BeforeValidator(_close_interval)]


class Record(BaseModel):
    """Base of all records: closed key set, immutable.

    A dataclass whose fields are the keys is its own record; this configuration holds for it too.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @classmethod
    def from_result(cls, result: object) -> Self:
        """Build the record and those of its parts from the attributes of the fields' names."""
        return cls.model_validate(result, from_attributes=True, by_alias=True, by_name=True)

    def to_document(self) -> dict[str, Any]:
        """Return the record as JSON values, keys as in the published schema."""
        return self.model_dump(mode="json", by_alias=True)

    def to_json(self) -> str:
        """Return strict JSON text: no NaN, keys as in the published schema."""
        return format_json(self.to_document())


class FrictionRecord(Record):
    """μ over |slip| [rad/s] of one element with its 95 % band, over the slip range seen."""

    slip: list[FiniteFloat]
    mu: list[FrictionCoefficient]
    mu_lo: list[OptionalFloat]
    mu_hi: list[OptionalFloat]
    stribeck: Stribeck | None = None
    stribeck_covariance: list[list[FiniteFloat]] | None = None
    method: str
    gain_m3: OptionalFloat = None
    gain_std_m3: Deviation = None
    gain_assumed: bool = False
    verdict: Verdict = Verdict.IDENTIFIED
    reason: str = ""

    @model_validator(mode="after")
    def _check_curve(self, info: ValidationInfo) -> Self:
        lengths = {len(self.slip), len(self.mu), len(self.mu_lo), len(self.mu_hi)}
        if len(lengths) != 1 or not self.slip:
            raise ValueError("slip, mu, mu_lo and mu_hi must be of one length, at least 1")
        bands = zip(self.slip, self.mu_lo, self.mu, self.mu_hi, strict=True)
        for slip, low, mu, high in bands if info.context == READING else ():
            below, above = mu if low is None else low, mu if high is None else high
            if not below <= mu <= above:
                raise ValueError(
                    f"mu = {mu:g} at {slip:g} rad/s is outside its band, mu_lo = {below:g} to "
                    f"mu_hi = {above:g}"
                )
        return self

    @model_validator(mode="before")
    @classmethod
    def _read_curve(cls, source: Any) -> Any:
        """Return the fields of a curve; its raw points stay in the report."""
        if not isinstance(source, FrictionCurve):
            return source
        arrays = ("slip", "mu", "mu_lo", "mu_hi")
        return {name: getattr(source, name).tolist() for name in arrays} | {
            "stribeck": source.stribeck,
            "stribeck_covariance": _convert_rows(source.stribeck_covariance),
            "method": source.method_text,
            "gain_m3": None if source.gain is None else source.gain.value,
            "gain_std_m3": None if source.gain is None else source.gain.std,
            "gain_assumed": source.has_assumed_gain,
            "verdict": source.verdict,
            "reason": source.reason,
        }

    def to_curve(self) -> FrictionCurve:
        """Back to the curve, without raw points."""
        return FrictionCurve(
            slip=np.asarray(self.slip),
            mu=np.asarray(self.mu),
            mu_lo=_build_array(self.mu_lo),
            mu_hi=_build_array(self.mu_hi),
            points_slip=np.empty(0),
            points_mu=np.empty(0),
            stribeck=self.stribeck,
            method=self.method.removesuffix(OF_RATIO),
            stribeck_covariance=None
            if self.stribeck_covariance is None
            else np.asarray(self.stribeck_covariance),
            over_eta=self.method.endswith(OF_RATIO),
            gain=None
            if self.gain_m3 is None
            else PriorValue(self.gain_m3, self.gain_std_m3 or 0.0, self.gain_assumed),
            verdict=self.verdict,
            reason=self.reason,
        )


class CovarianceRecord(Record):
    """Covariance of the parameters `ids` (total), row by row, in products of their SI units."""

    ids: list[str]
    matrix: list[list[FiniteFloat]]

    @model_validator(mode="after")
    def _check_square(self) -> Self:
        size = len(self.ids)
        if len(self.matrix) != size or any(len(row) != size for row in self.matrix):
            raise ValueError(f"matrix must be {size} by {size}, as ids")
        for place, name in enumerate(self.ids):
            if self.matrix[place][place] < 0.0:
                raise ValueError(f"the variance of {name} is negative; the range is 0 and above")
        return self


def _convert_rows(matrix: FloatArray | None) -> list[list[float]] | None:
    """Nested lists of a finite matrix; None where it is unknown."""
    if matrix is None or not np.isfinite(matrix).all():
        return None
    return matrix.tolist()  # type: ignore[no-any-return]


def _build_array(values: list[OptionalFloat]) -> FloatArray:
    return np.array([np.nan if value is None else value for value in values])


class ParameterRecord(Record):
    """One parameter, SI. `value` is null exactly where the verdict is `not identifiable`."""

    value: OptionalFloat
    unit: str
    std_noise: Deviation = None
    ci95: OptionalInterval = None
    std_total: Deviation = None
    ci95_total: OptionalInterval = None
    verdict: Verdict
    method: str
    reason: str = ""

    @model_validator(mode="after")
    def _check_identified_numbers(self) -> Self:
        if (self.value is None) != (self.verdict is Verdict.NOT_IDENTIFIABLE):
            raise ValueError("value must be null exactly where the verdict is 'not identifiable'")
        return self

    def to_estimate(self, parameter_id: str) -> Estimate:
        """Back to the estimate of that id."""
        systematic = None
        if self.std_total is not None and self.std_noise is not None:
            systematic = math.sqrt(max(0.0, self.std_total**2 - self.std_noise**2))
        return Estimate(
            id=parameter_id,
            value=self.value,
            std_noise=self.std_noise,
            verdict=self.verdict,
            method=self.method,
            std_systematic=systematic,
            reason=self.reason,
        )


class FitRecord(Record):
    """Agreement of simulation and measurement; null where the phase has no samples."""

    rmse: OptionalFloat
    fit_percent: OptionalFloat


class NumberRecord(Record):
    """A number of a finding in its SI unit, with the half width of its interval."""

    value: OptionalFloat
    unit: str
    half_width: OptionalFloat = None


class RowRecord(Record):
    """Row of the table of a finding."""

    names: dict[str, str]
    numbers: dict[str, NumberRecord]


class FindingRecord(Record):
    """A finding: its `text` follows from code, subject, place, numbers and names; `rows` are its
    table."""

    code: Code
    severity: Severity
    subject: str
    place: Where
    numbers: dict[str, NumberRecord]
    names: dict[str, str]
    rows: list[RowRecord] = Field(default_factory=list)
    remedy: str
    text: str

    def to_finding(self) -> Finding:
        """Back to the finding; what an older version did not record is named as such."""
        names, numbers = dict(self.names), _build_numbers(self.numbers)
        for key, spec in list_fields(self.code).items():
            if key in names or key in numbers:
                continue
            if spec:
                numbers[key] = Number(math.nan)
            else:
                names[key] = "not recorded by the older version"
        rows = tuple(Row(one.names, _build_numbers(one.numbers)) for one in self.rows)
        return Finding(self.code, self.subject, self.place, numbers, names, rows)


def _build_numbers(records: Mapping[str, NumberRecord]) -> dict[str, Number]:
    return {
        key: Number(math.nan if one.value is None else one.value, one.unit, one.half_width)
        for key, one in records.items()
    }


def dump_findings(findings: Iterable[Finding]) -> list[dict[str, Any]]:
    """Return findings as JSON values."""
    return [FindingRecord.from_result(one).model_dump(mode="json") for one in findings]


SchemaName = Annotated[str, Field(alias="schema")]


class ProspectRecord(Record):
    """Expected 95 % half width after repeating an experiment a given number of times.

    `shift` is the shift of the log on which the experiment is based, by its gears. It is empty if
    all shifts give the same.
    """

    experiment: Experiment
    repeats: int
    half_width: OptionalFloat
    verdict: Verdict
    shift: str = ""


class SuggestionRecord(Record):
    """A parameter, its 95 % half width now (null where open), and all experiments by their worth.

    `text` names the best one, or the reason why none helps. `number` is the number of the card that
    would narrow it most.
    """

    parameter: str
    unit: str
    verdict: Verdict
    half_width: OptionalFloat
    text: str
    experiments: list[ProspectRecord]
    number: CardNumber | None = None

    @model_validator(mode="before")
    @classmethod
    def _read_suggestion(cls, source: Any) -> Any:
        if not isinstance(source, ExperimentRanking):
            return source
        fields = {name: getattr(source, name) for name in ("parameter", "verdict", "half_width")}
        unit = get_parameter_spec(source.parameter).unit
        return fields | {
            "unit": unit,
            "text": source.text,
            "experiments": source.prospects,
            "number": source.number,
        }


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


R = TypeVar("R", bound=Record)

_AGAIN = "write it again with 'drivetwin identify'"


def read_record(path: Path | str, parse: Callable[[str], Any], schema: str, model: type[R]) -> R:
    """Read a file of `schema` as `model`; `parse` makes the document of its text.

    Raises ResultFileError where the file is missing, damaged or of a newer schema.
    """
    where = Where(file=str(path))
    remedy = "check the path, or write it with 'drivetwin identify'"
    measure_regular_file(Path(path), ResultFileError, remedy, LARGEST_RECORD)
    try:
        tree = parse(Path(path).read_text(encoding="utf-8"))
    except OSError as fault:
        what = f"cannot read the file: {fault.strerror}"
        raise ResultFileError(what, remedy, where) from None
    except (ValueError, RecursionError) as fault:
        raise ResultFileError(f"cannot be read: {fault}", _AGAIN, where) from None
    if not isinstance(tree, dict):
        raise ResultFileError("cannot be read: it is no table", _AGAIN, where)
    _check_schema(tree.get("schema"), schema, str(path))
    raise_faults(validate_schema(tree, model, READING), ResultFileError, str(path), _AGAIN)
    return model.model_validate(tree, context=READING)


def _check_schema(found: object, known: str, file: str) -> None:
    """Raise ResultFileError unless `found` names the family of `known` in a version not newer.

    `known` reads like `drivetwin/twin-1`: family, dash, version. Older versions stay readable.
    """
    family, _, version = known.rpartition("-")
    match = (
        re.fullmatch(rf"{re.escape(family)}-(\d{{1,9}})", found) if isinstance(found, str) else None
    )
    where = Where(file=file, key="schema")
    if match is None:
        raise ResultFileError(
            f"schema is {repr(found)[:80]}, expected {known!r}",
            "give a file written by drivetwin",
            where,
        )
    if int(match[1]) > int(version):
        raise ResultFileError(
            f"schema {found!r} is newer than this program's {known!r}",
            "update drivetwin, or write the file again with this version",
            where,
        )


def write_toml(path: Path | str, comments: Iterable[str], content: Record) -> None:
    """Write a record as TOML below comments; the file appears whole or not at all."""
    document = tomlkit.document()
    for line in comments:
        document.add(tomlkit.comment(line))
    for key, value in _drop_null(content.to_document()).items():
        document.add(key, tomlkit.item(value))
    write_text(path, tomlkit.dumps(document))


def _drop_null(value: Any) -> Any:
    """Drop null table entries, as TOML has no null; null in an array becomes NaN."""
    if isinstance(value, dict):
        return {k: _drop_null(item) for k, item in value.items() if item is not None}
    if isinstance(value, list):
        return [float("nan") if item is None else _drop_null(item) for item in value]
    return value

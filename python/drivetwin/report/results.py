# SPDX-License-Identifier: MIT
"""Results on disk, of every command that identifies: one loader for those who go on with them."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.toml import parse_toml
from drivetwin.errors import ResultFileError, Where
from drivetwin.estimation.result.estimate import Estimate
from drivetwin.files.bus_file import BUS_SCHEMA, TCU_SCHEMA, BusFile, TcuFile
from drivetwin.files.fit_file import FIT_SCHEMA, FitFile
from drivetwin.files.records import FitRecord, ParameterRecord, Record, read_record
from drivetwin.files.result_file import RESULT_SCHEMA, ResultFile
from drivetwin.files.twin_file import load_twin
from drivetwin.fit.network_model import NetworkModel
from drivetwin.likelihood.output import SignalFit
from drivetwin.parameters import ParameterSpec
from drivetwin.report.blocks import VerdictBlock
from drivetwin.report.bus import explain_bus, explain_tcu
from drivetwin.report.comparison import Candidate
from drivetwin.report.fit import build_fit_verdict
from drivetwin.report.model_verdict import build_verdict_block, explain_result
from drivetwin.twin.twin import Twin

REPORT, TWIN = "report.html", "twin.toml"
"""Files beside a result."""
_SCHEMAS: dict[str, tuple[str, type[Record]]] = {
    "result.json": (RESULT_SCHEMA, ResultFile),
    "bus.json": (BUS_SCHEMA, BusFile),
    "fit.json": (FIT_SCHEMA, FitFile),
    "tcu.json": (TCU_SCHEMA, TcuFile),
}
"""Schema and record of each result by the name of its file."""
_NO_TWIN = {
    BusFile: (
        "bus logs have neither pressures nor output torque, so they give no model of a shift",
        "identify a log with both by a whole vehicle card; 'drivetwin export RESULT --to csv', or "
        "ssv, cdfx, dcm, m, writes the values of this result",
    ),
    FitFile: (
        "a fit has the model of its own driveline, model.toml, and no twin of a gear shift",
        "'drivetwin simulate' runs the fitted model over a log; 'drivetwin export RESULT --to csv'"
        ", or ssv, cdfx, dcm, m, writes its values",
    ),
    TcuFile: (
        "the twin from the log of a gearbox control is of all shifts, with a converter",
        "give the file shift_GEAR-GEAR.toml in its folder, the twin of one kind of shift; "
        "'drivetwin export RESULT --to csv', or ssv, cdfx, dcm, m, writes the values",
    ),
}
"""Reason and remedy where a result cannot have a twin."""


_ORIGINS: dict[type, str] = {
    BusFile: "bus logs",
    FitFile: "fit",
    TcuFile: "log of a gearbox control",
}


@dataclass(frozen=True, eq=False)
class MadeResult:
    """A result in `file`: the content of its file, or a twin."""

    file: Path
    content: ResultFile | BusFile | FitFile | TcuFile | Twin

    @property
    def estimates(self) -> Mapping[str, Estimate]:
        """Estimates by id."""
        match self.content:
            case Twin() as twin:
                return twin.parameters
            case FitFile() as fit:
                return {name: _restore_unknown(name, one) for name, one in fit.unknowns.items()}
            case TcuFile() as tcu:
                return {name: _restore_unknown(name, one) for name, one in tcu.parameters.items()}
            case content:
                return {name: one.to_estimate(name) for name, one in content.parameters.items()}

    @property
    def can_have_twin(self) -> bool:
        """False for a result of which no twin of a gear shift can be made."""
        return type(self.content) not in _NO_TWIN

    def describe_origin(self) -> str:
        """Return program and logs of a result of bus logs or of a fit, for a comment."""
        assert isinstance(self.content, BusFile | FitFile | TcuFile)
        return f"drivetwin {self.content.version}, from {', '.join(self.content.logs)}"

    @property
    def is_fit(self) -> bool:
        """True for the fit of a network."""
        return isinstance(self.content, FitFile)

    def list_spreads(self, network: NetworkModel) -> FloatArray:
        """Return the standard deviations (n,) of the unknowns of a fit in their coordinates.

        The coordinate of a positive number is its logarithm.
        """
        assert isinstance(self.content, FitFile)
        known = self.content.unknowns
        return np.array(
            [
                (known[one.name].std_noise or 0.0)
                / (known[one.name].minimum if one.is_positive else 1.0)
                for one in network.resolve(network.list_places()).sought
            ]
        )

    def build_verdict(self) -> VerdictBlock | None:
        """Build the verdict that the result opens with; a twin alone has none."""
        match self.content:
            case Twin():
                return None
            case FitFile() as fit:
                return build_fit_verdict(fit.status, fit.chi2)
            case TcuFile() as tcu:
                return explain_tcu(tcu.status, tcu.reason)
            case BusFile() as bus:
                findings = [one.to_finding() for one in bus.findings]
                return explain_bus(self.estimates, findings, bus.predictions)
            case content:
                return build_verdict_block(explain_result(content))

    def find_page(self) -> Path:
        """Return the path of the report beside the result; raises ResultFileError without one."""
        page = self.file.with_name(REPORT)
        if not page.is_file():
            raise ResultFileError(
                f"{REPORT} is not in the folder of {self.file.name}",
                "run the command that wrote the result again with -o: it writes all files",
                Where(file=str(page)),
            )
        return page

    def load_twin(self) -> Twin:
        """Load the twin; raises ResultFileError with the reason where there is none."""
        if isinstance(self.content, Twin):
            return self.content
        reason = _NO_TWIN.get(type(self.content))
        if reason is not None:
            raise ResultFileError(*reason, Where(file=str(self.file)))
        path = self.file.with_name(TWIN)
        if not path.is_file():
            raise ResultFileError(
                f"there is no {TWIN} in {path.parent}",
                "give the folder that 'drivetwin identify LOG --vehicle CARD -o DIR' wrote, or its "
                f"{TWIN}",
                Where(file=str(self.file)),
            )
        return load_twin(path)

    def to_candidate(self, name: str) -> Candidate:
        """Return the result as one of a comparison."""
        content, friction, fit = self.content, {}, {}
        if isinstance(content, Twin):
            return Candidate.from_twin(name, content)
        if isinstance(content, ResultFile):
            friction = {element: one.to_curve() for element, one in content.friction.items()}
            fit = {signal: _to_fits(phases) for signal, phases in content.fit.items()}
            method, inputs = str(content.method), content.inputs
        else:
            method, inputs = _ORIGINS[type(content)], dict.fromkeys(content.logs, "")
        if isinstance(content, FitFile):
            fit = {output: {"all": one} for output, one in _to_fits(content.fit[0]).items()}
        return Candidate(name, method, self.estimates, friction, fit, inputs, content.version)


def _restore_unknown(name: str, record: ParameterRecord) -> Estimate:
    """Return an estimate with its own declaration."""
    spec = ParameterSpec(name, name, name, record.unit, "unknown of a fit", -np.inf, np.inf)
    return replace(record.to_estimate(name), spec=spec)


def _to_fits(records: Mapping[str, FitRecord]) -> dict[str, SignalFit]:
    nan = float("nan")
    return {
        name: SignalFit(
            nan if one.rmse is None else one.rmse,
            nan if one.fit_percent is None else one.fit_percent,
        )
        for name, one in records.items()
    }


def open_result(source: Path) -> MadeResult:
    """Open a result by its folder or file, whatever command wrote it.

    Raises
    ------
    ResultFileError
        If there is none, or it is damaged or of a newer schema.
    """
    file = _find_file(source) if source.is_dir() else source
    family = _read_family(file)
    for name, (schema, record) in _SCHEMAS.items():
        if file.name == name or family == schema.rpartition("-")[0]:
            content: Any = read_record(file, json.loads, schema, record)
            return MadeResult(file, content)
    return MadeResult(file, load_twin(file))


def _find_file(folder: Path) -> Path:
    """Find the result in a folder; raises ResultFileError if it has none."""
    for name in (*_SCHEMAS, TWIN):
        if (folder / name).is_file():
            return folder / name
    if (folder / "index.sqlite").is_file():
        raise ResultFileError(
            "this is the store of a fleet, with a result for each of its logs",
            f"'drivetwin fleet report {folder}' writes its report, 'drivetwin fleet query' selects "
            "values",
            Where(file=str(folder)),
        )
    raise ResultFileError(
        f"there is no {', '.join(_SCHEMAS)} or {TWIN} in {folder}",
        "give the folder that 'drivetwin identify -o DIR', examine or fit wrote",
        Where(file=str(folder)),
    )


def _read_family(file: Path) -> str:
    """Return the schema of a file without its version; empty where the file cannot be read."""
    parse: Callable[[str], Any] = json.loads if file.suffix == ".json" else parse_toml
    try:
        tree = parse(file.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError, OSError):
        return ""
    return str(tree.get("schema", "")).rpartition("-")[0] if isinstance(tree, dict) else ""

# SPDX-License-Identifier: MIT
"""Files exported by a session: twin for other programs, result, report, channel mapping."""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from drivetwin.errors import InputError
from drivetwin.estimation.identification import Identification
from drivetwin.export.targets import Target
from drivetwin.export.write import ExportedModel, ExportOptions, write_export
from drivetwin.files.twin_file import save_twin
from drivetwin.report.bus import BusOutcome
from drivetwin.workbench import jobs, what_if
from drivetwin.workbench.identifying import render_bus_report, render_log_report
from drivetwin.workbench.session_state import SessionState

REPORT_LIMIT = 120.0
"""Time limit [s] for writing a report."""


class Record(StrEnum):
    """Files of drivetwin itself."""

    TWIN = "twin.toml"
    RESULT = "result.json"
    REPORT = "report.html"
    MAPPING = "channels.toml"
    SIGNALS = "signals.csv"


_BUS_NAMES = {Record.RESULT: "bus.json", Record.REPORT: "report.html"}
"""Files of a result of bus logs."""


@dataclass(frozen=True)
class Product:
    """Exported file."""

    name: str
    content: bytes


def make_product(work: SessionState, wanted: ExportOptions | Record, scratch: Path) -> Product:
    """Make one file from what is shown; `scratch` is a folder of our own.

    Raises InputError where the session has nothing of the kind, and the errors of the writers.
    """
    stem = Path(work.log.name).stem if work.log is not None else "twin"
    if isinstance(wanted, Record):
        if work.bus is not None and wanted in _BUS_NAMES:
            content = _make_bus_record(work.bus, wanted)
            return Product(f"{stem}.{_BUS_NAMES[wanted]}", content)
        return Product(f"{stem}.{wanted.value}", _make_record(work, wanted, scratch))
    path = scratch / f"{stem}.{wanted.to.ending}"
    write_export(work.require_twin(), wanted, path, lambda: _load_model(work))
    if wanted.to is Target.C:
        return Product(f"{path.name}.zip", _pack_folder(path))
    return Product(path.name, _read_file(path))


def _load_model(work: SessionState) -> ExportedModel:
    """Load the model of the shift that is shown, started as it was measured."""
    from drivetwin.export.fmu.measured import build_measured_subject

    twin, shift = work.require_twin(), work.require_shift()
    gears = shift.start_gear, shift.end_gear
    return ExportedModel(*build_measured_subject(twin, work.require_log(), gears))


def _make_bus_record(outcome: BusOutcome, wanted: Record) -> bytes:
    if wanted is Record.RESULT:
        return outcome.build_file().to_json().encode()
    text: str = jobs.call(render_bus_report, outcome, limit=REPORT_LIMIT)
    return text.encode()


def _make_record(work: SessionState, wanted: Record, scratch: Path) -> bytes:
    path = scratch / wanted.value
    match wanted:
        case Record.TWIN:
            save_twin(path, work.require_twin())
        case Record.RESULT:
            from drivetwin.files.result_file import save_result

            save_result(path, _get_evidence(work))
        case Record.REPORT:
            found, logs = _get_evidence(work), work.get_fitted_logs()
            text: str = jobs.call(render_log_report, found, logs, limit=REPORT_LIMIT)
            return text.encode()
        case Record.SIGNALS:
            return _format_signals(work).encode()
        case Record.MAPPING:
            from drivetwin.channels.mapping_text import format_mapping

            survey = work.require_opened().survey
            return format_mapping(survey.mapping, survey.options, survey.names).encode()
    return _read_file(path)


def _format_signals(work: SessionState) -> str:
    """Format the shift that is shown, simulated with the sliders as they are."""
    from drivetwin.validation.simulate_log import format_signals

    twin, log = work.require_twin(), work.require_log()
    run = what_if.simulate_identified(twin, log, work.require_shift())
    if work.changes:
        run = what_if.simulate_changes(run, twin, log, work.changes)
    return format_signals([run], log)


def _get_evidence(work: SessionState) -> Identification:
    """The result that is shown. Raises InputError for one from a workspace."""
    found = work.require_outcome().found
    if found is None:
        raise InputError(
            "a reopened workspace holds the twin, not the evidence behind it",
            "identify again, then export result and report",
        )
    return found


def _pack_folder(folder: Path) -> bytes:
    """Pack the C sources as one archive and remove them; equal twins give equal bytes."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(folder.iterdir()):
            archive.writestr(zipfile.ZipInfo(path.name), _read_file(path))
    return packed.getvalue()


def _read_file(path: Path) -> bytes:
    content = path.read_bytes()
    path.unlink()
    return content

# SPDX-License-Identifier: MIT
"""Export: a button for every format that a twin has, and for drivetwin's own files."""

from __future__ import annotations

import base64
import io
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from enum import Enum, StrEnum
from pathlib import Path
from typing import Any, get_type_hints

from dash import ALL, Input, Output, State, ctx, dcc, html, no_update
from dash.development.base_component import Component

from drivetwin._util.request import Request, get_arguments
from drivetwin.errors import InputError, RefusedError
from drivetwin.estimation.identification import Identification
from drivetwin.export.targets import ExportOptions, Target
from drivetwin.export.write import ExportedModel, write_export
from drivetwin.files.twin_file import save_twin
from drivetwin.report.bus import BusOutcome
from drivetwin.workbench import jobs, what_if
from drivetwin.workbench.identifying import emit_report
from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import SessionState
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.fields import ControlId, get_triggered_part

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
    from drivetwin.export.fmu.build import build_measured_subject

    twin, shift = work.require_twin(), work.require_shift()
    gears = shift.start_gear, shift.end_gear
    return ExportedModel(*build_measured_subject(twin, work.require_log(), gears))


def _make_bus_record(outcome: BusOutcome, wanted: Record) -> bytes:
    if wanted is Record.RESULT:
        return outcome.build_file().to_json().encode()
    text: str = jobs.call(emit_report, outcome, limit=REPORT_LIMIT)
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
            text: str = jobs.call(emit_report, found, logs, limit=REPORT_LIMIT)
            return text.encode()
        case Record.SIGNALS:
            return _format_signals(work).encode()
        case Record.MAPPING:
            from drivetwin.channels.mapping_file import format_mapping

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


def build_choices(request: type[Request]) -> list[Component]:
    """Build the choices of a request, labelled with the help texts of its options."""
    hints, arguments = get_type_hints(request), get_arguments(request)
    return [
        ui.make_choice(
            {"request": request.__name__, "id": one.name},
            arguments[one.name].help,
            {each.value: each.value for each in hints[one.name]},
            one.default.value,
        )
        for one in fields(request)
        if isinstance(one.default, Enum)
    ]


def parse_choices(
    request: type[Request], values: Sequence[str], ids: Sequence[ControlId]
) -> dict[str, Any]:
    """Return the chosen values by argument. Raises RefusedError for a value that is no choice."""
    hints = get_type_hints(request)
    try:
        return {one.id: hints[one.id](value) for one, value in zip(ids, values, strict=True)}
    except (KeyError, TypeError, ValueError):
        raise RefusedError("there is no such choice", "use the controls of the page") from None


RECORDS = {
    Record.REPORT: ("Report", "one offline page with all evidence"),
    Record.TWIN: ("Twin", "twin.toml, for simulate, report and export"),
    Record.RESULT: ("Result", "result.json, or bus.json of bus logs, for other programs"),
    Record.SIGNALS: ("Signals", "measured and simulated, of the shift and sliders in Model (CSV)"),
    Record.MAPPING: ("Channel mapping", "channels.toml, for logs of the same logger"),
}


def layout() -> list[Component]:
    """Two groups of buttons."""
    return [
        ui.make_hint(
            "The result that is shown in the step Model, as identified: sliders do not change it."
        ),
        html.H3("The twin for other programs"),
        ui.make_row(*build_choices(ExportOptions)),
        _build_group({one.value: (one.label, one.text) for one in Target}),
        html.H3("Files of drivetwin"),
        _build_group({record.value: text for record, text in RECORDS.items()}),
        dcc.Download(id="download"),
    ]


def _build_group(entries: dict[str, tuple[str, str]]) -> Component:
    return html.Div(
        [
            html.Button(
                [html.Strong(title), html.Small(text)],
                id={"export": name, "at": "export"},
                type="button",
                className="tall",
            )
            for name, (title, text) in entries.items()
        ],
        className="exports",
    )


def register(page: ui.Page) -> None:
    """Register the callback of the buttons."""
    pattern = {"request": ExportOptions.__name__, "id": ALL}

    @page.callback(
        Output("download", "data"),
        Input({"export": ALL, "at": ALL}, "n_clicks"),
        State(pattern, "data-value"),
        State(pattern, "id"),
    )
    def hand_over(
        session: Session,
        clicks: list[int | None],
        values: tuple[str, ...],
        ids: tuple[ControlId, ...],
    ) -> Any:
        """Write the file and send it to the browser."""
        if not ctx.triggered_id or not any(clicks):
            return no_update
        choices = parse_choices(ExportOptions, values, ids)
        wanted = _parse_choice(get_triggered_part("export"), choices)
        product = make_product(session.work, wanted, session.scratch)
        if wanted is not Record.MAPPING:
            session.update(lambda work: replace(work, has_exported=True))
            ui.notify_topic(ui.Topic.STEPS)
        ui.notify(f"{product.name}: {len(product.content) / 1e3:.0f} kB")
        content = base64.b64encode(product.content).decode()
        return {"content": content, "filename": product.name, "base64": True}


def _parse_choice(name: str, choices: Mapping[str, Any]) -> ExportOptions | Record:
    if name in set(Record):
        return Record(name)
    if name in set(Target):
        return ExportOptions(**{**choices, "to": Target(name)})
    raise RefusedError("there is no such export", "press one of the buttons")

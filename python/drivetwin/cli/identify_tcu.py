# SPDX-License-Identifier: MIT
"""`drivetwin identify` and `simulate` on logs of a gearbox control."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin.cli.arguments import REPORT, TWIN
from drivetwin.cli.output import show_step
from drivetwin.errors import InputError, Where
from drivetwin.report.blocks import Outcome

if TYPE_CHECKING:
    from drivetwin.cli.identify import Identify
    from drivetwin.cli.simulate import Simulate
    from drivetwin.tcu.outcome import TcuIdentification
    from drivetwin.tcu.predict import PredictedShift

TCU_RESULT = "tcu.json"
"""Result that `identify -o` writes for logs of a gearbox control."""


def is_of_controller(request: Identify) -> bool:
    """Return True if the card is one for the log of a gearbox control."""
    from drivetwin.tcu.card import is_controller_card

    return request.vehicle is not None and is_controller_card(request.vehicle)


def identify_controller_logs(request: Identify) -> Outcome:
    """Identify the plant from all logs of one vehicle.

    Raises InputError for options of other logs, and the typed errors of reader and fit.
    """
    from drivetwin.files.tcu_twin_file import build_tcu_file
    from drivetwin.report.tcu import build_tcu_blocks
    from drivetwin.tcu.card import load_controller_card
    from drivetwin.tcu.outcome import identify_controller

    _refuse(
        {"--bus": request.bus, "--quick": request.quick, "--effect": request.effects},
        "the log of a gearbox control has one method",
    )
    assert request.vehicle is not None
    card, held = load_controller_card(request.vehicle), _read_numbers(request.hold_out)
    with show_step(f"identifying {len(request.logs)} logs of a gearbox control"):
        found = identify_controller(request.logs, card, request.channels, held)
    file = build_tcu_file(found, request.describe_settings())
    files: Sequence[Path] = ()
    if request.output is not None:
        files = _write(found, request.output, file.to_json())
    document = file.model_dump(mode="json", by_alias=True)
    return Outcome(build_tcu_blocks(found), document, files, found.status.is_confirmed)


def _refuse(unused: Mapping[str, object], what: str) -> None:
    """Raise InputError for the first option that is given."""
    for name, given in unused.items():
        if given:
            raise InputError(what, f"leave out {name}", Where(key=name))


def _read_numbers(wanted: Sequence[str]) -> list[int] | None:
    """Return the numbers of held-out shifts, None without any. Raises InputError for others."""
    for text in wanted:
        if not text.isdecimal():
            raise InputError(
                f"{text!r} is no number of a shift",
                "give the number of a shift, counted over all logs",
                Where(key="--hold-out"),
            )
    return [int(text) for text in wanted] or None


def _write(found: TcuIdentification, folder: Path, result: str) -> tuple[Path, ...]:
    """Write result, twin and report into `folder`, all or none; return their paths."""
    from drivetwin.cli.output import write_atomically
    from drivetwin.files.tcu_twin_file import save_tcu_twin
    from drivetwin.files.twin_file import save_twin
    from drivetwin.report.tcu import render_tcu
    from drivetwin.twin.of_controller import build_shift_twin

    kinds = found.twin.kinds if found.status.is_confirmed else ()
    twins = {f"shift_{kind}.toml": build_shift_twin(found.found, kind) for kind in kinds}
    with write_atomically(folder) as beside:
        save_tcu_twin(beside / TWIN, found.twin)
        for name, twin in twins.items():
            save_twin(beside / name, twin)
        for name, text in {TCU_RESULT: result, REPORT: render_tcu(found)}.items():
            (beside / name).write_text(text, encoding="utf-8", newline="\n")
    return tuple(folder / name for name in (TCU_RESULT, TWIN, REPORT, *twins))


def find_controller_twin(source: Path) -> Path | None:
    """Return the twin of a gearbox control's log by its folder, its file or the result beside it;
    None for another result."""
    from drivetwin.files.tcu_twin_file import is_tcu_twin

    files = (source / TWIN,) if source.is_dir() else (source, source.with_name(TWIN))
    if not source.is_dir() and source.name not in (TWIN, TCU_RESULT):
        files = (source,)
    return next((one for one in files if is_tcu_twin(one)), None)


def simulate_controller(twin: Path, request: Simulate) -> Outcome:
    """Predict the shifts of a log with a twin, and compare.

    Raises InputError for options of other twins, and the typed errors of the reader.
    """
    from drivetwin._util.atomic import write_text
    from drivetwin._util.outputs import PAGE, select_outputs
    from drivetwin.files.tcu_twin_file import load_tcu_twin, record_prediction
    from drivetwin.report.blocks import Tone, make_notes
    from drivetwin.report.tcu import build_prediction_table, render_predictions
    from drivetwin.tcu.log import read_controller_log
    from drivetwin.tcu.outcome import list_unfitted_kinds, predict

    given = {name: getattr(request, name) for name in _UNUSED}
    options = {f"--{name.replace('_', '-')}": value for name, value in given.items()}
    _refuse(options, "the twin of a gearbox control's log is driven by its commands")
    model, log = load_tcu_twin(twin), request.log
    with show_step(f"simulating {log.name}"):
        shifts = read_controller_log(log, model.card, request.channels).shifts
        predictions = predict(model, shifts)
    for table in select_outputs(request.output, ".csv"):
        write_text(table, _format_rows(predictions))
    for page in select_outputs(request.output, *PAGE):
        write_text(page, render_predictions(predictions, log.name))
    kinds = [
        f"{kind}: no shift of this kind was fitted; its error may be larger than the band."
        for kind in list_unfitted_kinds(model, shifts)
    ]
    blocks = [build_prediction_table(predictions), *make_notes("Warnings", kinds, Tone.DOUBTFUL)]
    document = {"shifts": [record_prediction(one).model_dump() for one in predictions]}
    return Outcome(blocks, document, request.output)


_UNUSED = ("vehicle", "step", "parameters", "from_command", "template")
"""Options of `simulate` that such a twin does not take."""


def _format_rows(predictions: Sequence[PredictedShift]) -> str:
    """Write measured and predicted speeds of all rows as a table (SI)."""
    names = ("engine_speed", "input_speed", "output_speed")
    head = ["time", "shift"]
    head += [f"{name}{part}" for name in names for part in ("", ".predicted", ".band")]
    lines = [",".join(head)]
    for one in predictions:
        for k, time in enumerate((one.shift.begin + one.shift.time).tolist()):
            cells = [f"{time:.4f}", str(one.shift.number)]
            for i in range(len(names)):
                triple = (one.shift.speeds[k, i], one.speeds[k, i], one.band[k, i])
                cells += [f"{value:.6g}" for value in triple]
            lines.append(",".join(cells))
    return "\n".join(lines) + "\n"

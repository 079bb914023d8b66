# SPDX-License-Identifier: MIT
"""`drivetwin identify` on logs of a gearbox control."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin.cli.arguments import REPORT, TCU_RESULT, TWIN
from drivetwin.cli.identify_run import Identify
from drivetwin.cli.output import show_step
from drivetwin.errors import InputError, Where
from drivetwin.report.blocks import Outcome

if TYPE_CHECKING:
    from drivetwin.tcu.outcome import TcuIdentification


def identify_controller_logs(request: Identify, vehicle: Path) -> Outcome:
    """Identify the plant from all logs of one vehicle.

    Raises InputError for options of other logs, and the typed errors of reader and fit.
    """
    from drivetwin.files.tcu_twin_file import build_tcu_file
    from drivetwin.report.bus import build_tcu_blocks
    from drivetwin.tcu.card import load_controller_card
    from drivetwin.tcu.outcome import identify_controller

    unused = ("bus", "quick", "effects")
    request.refuse_stated(unused, "the log of a gearbox control has one method")
    card, held = load_controller_card(vehicle), _read_numbers(request.hold_out)
    with show_step(f"identifying {len(request.logs)} logs of a gearbox control"):
        found = identify_controller(request.logs, card, request.channels, held)
    file = build_tcu_file(found, request.describe_settings())
    files: Sequence[Path] = ()
    if request.output is not None:
        files = _write(found, request.output, file.to_json())
    document = file.model_dump(mode="json", by_alias=True)
    return Outcome(build_tcu_blocks(found), document, files, found.status.is_confirmed)


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
    from drivetwin.report.bus import build_tcu_page
    from drivetwin.report.html import save_page
    from drivetwin.twin.of_controller import build_shift_twin

    kinds = found.twin.kinds if found.status.is_confirmed else ()
    twins = {f"shift_{kind}.toml": build_shift_twin(found.found, kind) for kind in kinds}
    with write_atomically(folder) as beside:
        save_tcu_twin(beside / TWIN, found.twin)
        for name, twin in twins.items():
            save_twin(beside / name, twin)
        (beside / TCU_RESULT).write_text(result, encoding="utf-8", newline="\n")
        save_page(beside / REPORT, build_tcu_page(found))
    return tuple(folder / name for name in (TCU_RESULT, TWIN, REPORT, *twins))

# SPDX-License-Identifier: MIT
"""Requests of the commands on gearboxes, vehicle cards, many logs, schemas, and the workbench.

The text of a request is the help of its command.
"""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin._util.request import (
    MEBIBYTE,
    PAGE,
    REQUIRED,
    SECOND,
    FileRole,
    Request,
    argument,
    flag,
    input_file,
    option,
    output_file,
    output_folder,
)
from drivetwin.cli.options import GEARBOX_HELP, mapping_option, strict_flag
from drivetwin.files.schemas import FileKind
from drivetwin.fleet.options import FleetOptions
from drivetwin.vehicle.card_fields import list_single_options


class ShowGearbox(
    Request,
    command="gearbox",
    runs="gearbox:gearbox",
    examples=(
        "gearbox",
        "gearbox zf-8hp70 --gear 3",
    ),
):
    """List the gears of a gearbox with computed and published ratio.

    Without CARD, list the built-in gearboxes. With --gear, print the speed of every member per
    input speed, the torque of every element on every member per input torque, and the power flow.
    """

    card: str | None = argument(GEARBOX_HELP, "CARD", default=None)
    gear: str | None = option("Show one gear in full.", metavar="GEAR")
    output: Path | None = output_file(
        "Write the gearbox as a Modelica package.", "FILE.mo", {".mo": "Modelica package"}
    )


class Reduce(
    Request, command="reduce", runs="gearbox:reduce", examples=("reduce zf-8hp70 --shift 2-3",)
):
    """Reduce a shift to the dual-clutch form and compute the error of the reduction.

    Print the ratios of both elements, the mass matrix, and condition (1) with the members that
    violate it. Simulate a reference shift and print the error of neglecting their coupling.
    """

    card: str = argument(GEARBOX_HELP, "CARD")
    shift: str = option("The two gears, such as 2-3.", metavar="OLD-NEW", default=REQUIRED)


class Course(StrEnum):
    """Built-in plans of a drive."""

    LAUNCH = "launch"
    ALL_KINDS = "all_kinds"


class Drive(
    Request,
    command="drive",
    runs="gearbox:drive",
    examples=("drive three-set-4000cr --course launch -o drive",),
):
    """Simulate a drive from standstill with converter, lock-up and all kinds of shift.

    Print a table of all shifts: start, duration of slip at the input, friction work and peak power
    of the off-going and the on-coming element, lowest and highest torque of the output shaft. Print
    the energy balance.
    """

    card: str = argument(GEARBOX_HELP, "CARD", default="three-set-4000cr")
    course: Course = option(
        "launch: standstill to the highest gear under power; all_kinds: the same, then kick-down, "
        "up-shift with closed pedal, coast-down to first gear.",
        default=Course.ALL_KINDS,
    )
    powertrain: str | None = option(
        "Powertrain file (TOML), or name of a built-in one.", metavar="FILE"
    )
    output: Path | None = output_folder("Folder for drive.html and drive.csv.")


class PrintSchema(
    Request,
    command="schema",
    runs="schema:schema",
    examples=(
        "schema vehicle-card",
        "schema --command identify",
    ),
):
    """Print the JSON Schema of a kind of file, for editors; without KIND, list the kinds."""

    kind: FileKind | None = argument(
        "Kind of file; default: list the kinds.", "KIND", default=None, shows_default=False
    )
    command: str | None = option(
        "Print the schema of the arguments of a command, such as calibrate.", metavar="COMMAND"
    )


class OpenWorkbench(
    Request, command="app", has_document=False, runs="workbench:workbench", examples=("app logs",)
):
    """Open the workbench in the browser: from a log to a validated model.

    No network is needed. Access requires the printed link. Other machines cannot connect.
    """

    log: Path | None = argument("Log to open, inside the folder.", "[LOG]", default=None)
    vehicle: Path | None = input_file("Vehicle card (TOML).", "CARD")
    channels: Path | None = input_file("Channel mapping file (TOML).", "MAP")
    folder: Path = option(
        "Folder for all files that are opened or saved.", metavar="DIR", default=Path()
    )
    port: int = option("Port; 0: any free port.", default=8050)
    browser: bool = option("Open the page in a browser.", "--browser/--no-browser", default=True)


class FleetFiles(Request):
    """Logs, rules and store of a fleet run."""

    logs: tuple[str, ...] = argument("Files, folders and quoted globs.", "LOGS...", default=())
    vehicle: Path = option("Vehicle card, or rules (TOML).", metavar="CARD|RULES", default=REQUIRED)
    output: Path = output_folder("Folder of the store.", "STORE", REQUIRED)
    listed: Path | None = option(
        "CSV with a column 'path', or text with one path per line.", "--list", metavar="FILE"
    )


class RunFleet(
    FleetOptions,
    FleetFiles,
    command="fleet run",
    runs="fleet:run",
    examples=(
        "fleet logs --vehicle truck.card.toml -o store",
        "fleet run 'logs/*.mf4' --vehicle rules.toml -o store --workers 4",
    ),
):
    """Identify all logs that are not yet in the store.

    The same command continues an interrupted run; finished logs are not computed again.
    """

    as_json: bool = flag("Print one JSON event per line on stdout.", "--json")
    strict: bool = strict_flag("every log is identified")


class StoreInput(Request):
    """The store of a fleet."""

    store: Path = argument("Folder of 'fleet -o'.", "STORE")


class ReportFleet(
    StoreInput,
    command="fleet report",
    runs="fleet:report",
    examples=("fleet report store -o fleet.html",),
):
    """Write the report of a store: shared values, ageing, units, outliers, failures."""

    output: Path | None = output_file(
        "Page to write; default: report.html in the store.", "FILE.html", PAGE
    )


class EstimateFleet(
    StoreInput,
    command="fleet estimate",
    runs="fleet:estimate",
    examples=("fleet estimate store --parameter eta",),
):
    """Estimate over all logs: shared values, spread over units, ageing, outliers."""

    parameter: tuple[str, ...] = option(
        "Parameter to estimate; repeatable; default: all.", metavar="ID", default=()
    )


class QueryFleet(
    StoreInput,
    command="fleet query",
    runs="fleet:query",
    examples=('fleet query store "SELECT name, value FROM parameters"',),
):
    """Query a store in SQL (DuckDB).

    Tables: parameters, frictions, fits, qualities, warnings, rows, files, logs, shifts, settings.
    """

    sql: str = argument("SELECT over parameters, files, …", "SQL")
    output: Path | None = output_file(
        "Write the answer as .csv or .parquet.",
        "FILE",
        {".csv": "text table", ".parquet": "binary table"},
    )
    time_limit: float = option("Time limit of the query.", unit=SECOND, minimum=0.1, default=60.0)
    memory_limit: int = option(
        "Memory limit of the query.", unit=MEBIBYTE, minimum=64, default=2 * 2**30
    )


class NewCardFiles(Request):
    """Files of `card new`."""

    output: Path = output_file("File of the new card.", "CARD.toml", default=REQUIRED)
    from_log: Path | None = option(
        "Log of the vehicle; its data fill in entries.", "--from", metavar="LOG"
    )
    channels: Path | None = mapping_option()
    draft: bool = flag("Ask no questions: mark guesses, leave open entries as comments.")
    force: bool = flag("Replace an existing card.")


def _declare_entries() -> type[Request]:
    """Declare an option for each question of a card that has one of its own."""
    options = {
        name.removeprefix("--").replace("-", "_"): option(
            field.option_help, metavar=field.option.split(" ")[1]
        )
        for name, field in list_single_options().items()
    }
    described = {"__doc__": "Entries of a card as texts."}
    types = {"__annotations__": dict.fromkeys(options, str | None)}
    return type("CardEntries", (Request,), {**described, **types, **options})


if TYPE_CHECKING:

    class CardEntries(Request):
        """Entries of a card as texts."""
else:
    CardEntries = _declare_entries()


class NewCard(
    CardEntries,
    NewCardFiles,
    command="card new",
    runs="card:new",
    examples=(
        "card new -o truck.card.toml --from shift.csv",
        "card new -o truck.card.toml --draft",
    ),
):
    """Write a vehicle card by questions in a terminal, or from options.

    With --from LOG, entries are estimated from the log. Without a terminal, or with --draft, the
    card is a draft: guesses are marked, and open entries are comments. A gain is never guessed.
    With --json no questions are asked.
    """

    element: tuple[str, ...] = option(
        "Data of a shift element, or of all without NAME; repeatable. Keys: kind, P0_bar, "
        "P0_std_bar, gain_m3 or surfaces, derating, area_m2 (or piston_outer_mm, "
        "piston_inner_mm), radius_m (or outer_mm, inner_mm), of a clutch i_c, i_out; "
        "drum_inertia_kgm2, peak.",
        metavar="[NAME:]KEY=VALUE,...",
        default=(),
    )
    sensor: tuple[str, ...] = option(
        "Sensor class of a channel role, or of 'pressure'; repeatable.",
        metavar="ROLE=CLASS[:RANGE]",
        default=(),
    )
    as_json: bool = flag("Print only the result, as JSON on stdout.", "--json")


class CheckCard(
    Request,
    command="card check",
    runs="card:check",
    examples=("card check truck.card.toml shift.csv --strict",),
):
    """Report implausible entries of a vehicle card, before an identification.

    Each finding names the entry, its value, the value or range expected, the reason and the remedy.
    With LOG, the entries are also compared with the speeds, pressures and torques of the log.
    The exit code is 0. With --strict it is 3 if an entry is implausible. It is 2 if card or log
    cannot be read.
    """

    card_file: Path = argument("Vehicle card (TOML).", "CARD", role=FileRole.OTHER)
    log: Path | None = argument(
        "Log of the vehicle: CSV, MDF, MAT, Parquet, bus log.", "LOG", default=None
    )
    channels: Path | None = mapping_option()
    strict: bool = strict_flag("every entry is plausible")

# SPDX-License-Identifier: MIT
"""Command line of a request: files that several commands read, options, and their protection."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import MISSING, fields, replace
from functools import cache, update_wrapper
from inspect import Parameter, Signature, signature
from pathlib import Path
from types import GenericAlias
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin, get_type_hints

import typer

from drivetwin._util.atomic import protect_files, remove_unfinished
from drivetwin._util.request import (
    REQUIRED,
    Argument,
    FileRole,
    Output,
    Request,
    argument,
    flag,
    get_arguments,
    input_file,
    lock_outputs,
    option,
    spell_option,
)
from drivetwin.cli.output import deliver
from drivetwin.errors import CardError, FileFormatError, InputError, ResultFileError, Where
from drivetwin.estimation.result.method import DEFAULT_METHOD
from drivetwin.report.blocks import Outcome

if TYPE_CHECKING:
    from drivetwin.channels.mapping import Mapped
    from drivetwin.channels.shiftlog import ShiftLog
    from drivetwin.twin.twin import Twin
    from drivetwin.vehicle.card import VehicleCard


RESULT, TWIN, REPORT = "result.json", "twin.toml", "report.html"
"""Files that `identify -o` writes."""
BUS_RESULT, TCU_RESULT = "bus.json", "tcu.json"
"""Results that `identify -o` writes for bus logs, and for logs of a gearbox control."""
FIT_RESULT, MODEL = "fit.json", "model.toml"
"""Files that `fit -o` writes beside the report."""
GEARBOX_HELP = "Gearbox card (TOML), or name of a built-in gearbox."


def log_argument(help: str = "Shift log: CSV, MDF, MAT, Parquet, bus log.") -> Any:
    """Declare a log."""
    return argument(help, "LOG", role=FileRole.LOG)


def logs_argument(help: str) -> Any:
    """Declare one or more logs."""
    return argument(help, "LOG...", role=FileRole.LOG)


def card_option(default: Any = None) -> Any:
    """Declare the card of a vehicle."""
    help = "Vehicle card (TOML), as 'drivetwin card new' writes it."
    return input_file(help, "CARD", FileRole.CARD, default)


def mapping_option(**described: Any) -> Any:
    """Declare the channel mapping of a log."""
    help = (
        "Channel mapping file (TOML); without it channels.toml beside the log and the mapping of "
        "the twin, if any."
    )
    return input_file(help, "MAP", FileRole.MAPPING, **described)


def method_option() -> Any:
    """Declare the method of an identification."""
    return option("likelihood or paper.", metavar="METHOD", default=DEFAULT_METHOD)


def quick_option() -> Any:
    """Declare the identification by one model."""
    return flag("Fit one model, and try no other sampling modes, minima and elements.")


def strict_flag(condition: str) -> Any:
    """Declare `--strict`."""
    return flag(f"Exit with code 3 unless {condition}.", decides=False)


def result_argument() -> Any:
    """Declare the result of identify, examine or fit."""
    help = "Result: folder of identify, examine or fit, its result file, or twin.toml."
    return argument(help, "RESULT", role=FileRole.RESULT)


class TwinInput(Request):
    """A twin."""

    twin: Path = argument(
        "Identified model: twin.toml, or the folder of 'identify -o'.", "TWIN", role=FileRole.TWIN
    )


class CardInput(Request):
    """The card of a vehicle, and the channel mapping of its logs."""

    vehicle: Path = card_option(REQUIRED)
    channels: Path | None = mapping_option()


class LogInput(CardInput):
    """A log with card and channel mapping."""

    log: Path = log_argument()


class TwinLogInput(TwinInput):
    """A twin, and a log for use with it."""

    log: Path = log_argument()
    vehicle: Path | None = input_file(
        "Vehicle card, in place of that of the twin.", "CARD", FileRole.CARD
    )
    channels: Path | None = mapping_option()


def find_mapping(channels: Path | None, log: Path) -> Mapped:
    """Read the mapping file that was given, else `channels.toml` beside the log, if any."""
    from drivetwin.channels.mapping_file import read_mapping, read_project_mapping

    return read_project_mapping(log) if channels is None else read_mapping(channels)


def _load_twin_card(twin: Twin, vehicle: Path | None) -> VehicleCard:
    """Return the card in the file `vehicle`, without one the twin's own.

    Both remember the channel mapping of the twin.
    """
    from drivetwin.vehicle.card import load_card

    if vehicle is None:
        return twin.build_card()
    return replace(load_card(vehicle), remembered=twin.mapping)


def read_twin_log(
    twin: Twin, log: Path, vehicle: Path | None = None, channels: Path | None = None
) -> tuple[ShiftLog, VehicleCard]:
    """Read a log for use with a twin, and the card in the file `vehicle` or the twin's own.

    Units and options that come from the twin are shown. Raises the typed errors of the readers.
    """
    from drivetwin.channels.mapping import RECALLED
    from drivetwin.cli.output import show_findings, show_step
    from drivetwin.logs.read import read_log

    card = _load_twin_card(twin, vehicle)
    with show_step(f"reading {log.name}"):
        recording = read_log(log, card, find_mapping(channels, log))
    show_findings(one for one in recording.findings if one.code in RECALLED)
    return recording, card


_TOML_LINE = re.compile(r"""^\s*(?:[\w."'-]+\s*=|\[+[\w."' -]+\]+\s*(?:#.*)?$)""")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_MAKE_TWIN = "'drivetwin identify LOG --vehicle CARD -o DIR' writes the twin, DIR/twin.toml"
_REMEDIES: dict[FileRole, dict[FileRole, str]] = {
    FileRole.TWIN: {
        FileRole.LOG: f"give the twin first, then the log; {_MAKE_TWIN}",
        FileRole.CARD: f"identify with this card first: {_MAKE_TWIN}",
        FileRole.MAPPING: f"give the mapping with --channels; {_MAKE_TWIN}",
    },
    FileRole.LOG: {
        FileRole.TWIN: "give a log here; where a command takes both, the twin comes first",
        FileRole.RESULT: "give the log that was identified, or another one",
        FileRole.CARD: "give the card with --vehicle, and a log here",
        FileRole.MAPPING: "give the mapping with --channels, and a log here",
    },
    FileRole.CARD: {
        FileRole.LOG: "give the log as an argument, and the card with --vehicle",
        FileRole.TWIN: "give the card of the vehicle; commands that take a twin need no card",
        FileRole.RESULT: "give the card of the vehicle; commands that take a twin need no card",
        FileRole.MAPPING: "give the mapping with --channels, and the card with --vehicle",
    },
}
_FAMILIES = {
    **dict.fromkeys(("twin", "tcu-twin"), FileRole.TWIN),
    **dict.fromkeys(("result", "bus", "fit", "tcu"), FileRole.RESULT),
}
"""Roles of the files that commands wrote, by the family of their schema."""
_ERRORS: dict[FileRole, type[InputError]] = {
    FileRole.TWIN: ResultFileError,
    FileRole.LOG: FileFormatError,
    FileRole.CARD: CardError,
}


def resolve_file(path: Path, role: FileRole) -> Path:
    """Return the path of a file that is read; a twin may be named by its folder or its result.

    Raises InputError if the content of the file shows that it has another role.
    """
    if role is FileRole.TWIN:
        return find_twin(path)
    if role is FileRole.RESULT and path.is_file():
        return path if recognise_file(path) is FileRole.RESULT else find_twin(path)
    if role in _REMEDIES:
        require_kind(path, role)
    return path


def find_twin(source: Path) -> Path:
    """Return the twin file of a source: the file itself, or that of an output folder or result.

    Raises ResultFileError if the source is another kind of file, or has no twin.
    """
    if source.is_dir():
        path = source / TWIN
    elif recognise_file(source) is FileRole.RESULT:
        path = source.with_name(TWIN)
    else:
        require_kind(source, FileRole.TWIN)
        return source
    if not path.is_file():
        from drivetwin.report.results import open_result

        open_result(source).load_twin()  # raises with the reason
    return path


def require_kind(path: Path, wanted: FileRole) -> None:
    """Raise an InputError if the content of a file shows that it is of another kind.

    A file that is missing, damaged or not recognised passes: its reader names the fault.
    """
    found = recognise_file(path)
    remedy = _REMEDIES[wanted].get(found)
    if remedy is not None:
        raise _ERRORS[wanted](f"this is {found}, not {wanted}", remedy, Where(file=str(path)))


def recognise_file(path: Path) -> FileRole:
    """Recognise the kind of a file from its content; its name does not matter."""
    from drivetwin._util.toml import parse_toml
    from drivetwin.logs.formats.detect import is_binary_log
    from drivetwin.logs.raw import HEAD_BYTES

    if not path.is_file():
        return FileRole.OTHER
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    if is_binary_log(head):
        return FileRole.LOG
    text = head.decode("utf-8-sig", errors="replace")
    if text.lstrip().startswith("{"):
        return _recognise_document(path, json.loads)
    lines = text.splitlines()
    if any(_TOML_LINE.match(line) for line in lines):
        return _recognise_document(path, parse_toml)
    return FileRole.LOG if any(map(_is_data_row, lines)) else FileRole.OTHER


def _recognise_document(path: Path, parse: Any) -> FileRole:
    """Recognise a TOML or JSON file by its keys; one that cannot be parsed is unknown."""
    from drivetwin._util.toml import MAX_SIZE

    if path.stat().st_size > MAX_SIZE:
        return FileRole.OTHER
    try:
        tree = parse(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError):
        return FileRole.OTHER
    if not isinstance(tree, dict):
        return FileRole.OTHER
    schema = str(tree.get("schema", ""))
    family = schema.removeprefix("drivetwin/").rpartition("-")[0]
    if family in _FAMILIES:
        return _FAMILIES[family]
    if {"gears", "elements"} <= tree.keys() and not schema:
        return FileRole.CARD
    is_mapping = "channels" in tree and tree.keys() <= {"channels", "time", "bus"}
    return FileRole.MAPPING if is_mapping else FileRole.OTHER


def _is_data_row(line: str) -> bool:
    """Return whether a line holds two numbers or more and nothing else."""
    fields = [field for field in re.split(r"[;,\t ]+", line.strip()) if field]
    return len(fields) > 1 and all(_NUMBER.fullmatch(field) for field in fields)


Command = Callable[..., Any]
"""Function of a request that returns an `Outcome` or yields several. One that prints by itself
takes the flag `as_json` beside."""
_AS_JSON = "as_json"
_JSON_HELP = "Print only the result, as JSON on stdout."


@cache
def get_request(command: Command) -> type[Request]:
    """Return the class of the request of a command."""
    found: type[Request] = get_type_hints(command)["request"]
    return found


def find_outputs(command: Command) -> dict[str, Output]:
    """Return the outputs of a command by argument."""
    arguments = get_arguments(get_request(command))
    return {name: one.output for name, one in arguments.items() if one.output is not None}


def bind_command(command: Command) -> Command:
    """Return a command as a function of the values of the command line, for typer.

    It raises InputError instead of overwriting a file that the command reads. Files that arguments
    other than outputs name are read. Outputs are checked before the computation. A command is also
    refused while another one writes to the same place.
    """
    outputs, request = find_outputs(command), get_request(command)
    arguments = get_arguments(request)
    flags = [name for name in signature(command).parameters if name != "request"]
    is_runner = get_type_hints(command)["return"] is not type(None)

    def bound(context: typer.Context, **given: Any) -> None:
        stated = {
            name
            for name in given
            if (source := context.get_parameter_source(name)) and source.name == "COMMANDLINE"
        }
        read = (value for name, value in given.items() if name not in outputs)
        with protect_files(path for value in read for path in _collect_paths(value)):
            written = [
                (path, marker)
                for name, marker in outputs.items()
                for path in _collect_paths(given.get(name))
            ]
            for path, marker in written:
                marker.check(path)
            with lock_outputs(path for path, _ in written):
                remove_unfinished(path for path, _ in written)
                as_json = is_runner and given.pop(_AS_JSON)
                beside = {name: given.pop(name) for name in flags}
                values = {
                    name: arguments[name].to_si(value)
                    for name, value in given.items()
                    if name in stated
                }
                made = command(_make_request(request, values), **beside)
                if is_runner:
                    outcomes = [made] if isinstance(made, Outcome) else made
                    deliver(outcomes, as_json=as_json, strict=given.get("strict", False))

    context = Parameter("context", Parameter.KEYWORD_ONLY, annotation=typer.Context)
    parameters = [context, *_iterate_parameters(request)]
    if is_runner or _AS_JSON in flags:
        hint = Annotated[bool, typer.Option("--json", help=_JSON_HELP)]
        parameters.append(
            Parameter(_AS_JSON, Parameter.KEYWORD_ONLY, default=False, annotation=hint)
        )
    update_wrapper(bound, command)
    vars(bound)["__signature__"] = Signature(parameters)
    bound.__annotations__ = {one.name: one.annotation for one in parameters}
    return bound


def _make_request(request: type[Request], values: dict[str, Any]) -> Request:
    """Make a request from values in SI; lists of the command line become tuples."""
    repeatable = {name for name, hint in get_type_hints(request).items() if _get_item(hint)}
    return request(
        **{name: tuple(one or ()) if name in repeatable else one for name, one in values.items()}
    )


def _iterate_parameters(request: type[Request]) -> Iterator[Parameter]:
    """Yield the parameters of a request as typer reads them."""
    hints, arguments = get_type_hints(request), get_arguments(request)
    for one in fields(request):
        if one.name not in arguments:
            continue
        declared, hint, default = arguments[one.name], hints[one.name], one.default
        if item := _get_item(hint):
            hint, default = GenericAlias(list, item), None if default == () else default
        marker = _make_marker(one.name, declared)
        yield Parameter(
            one.name,
            Parameter.KEYWORD_ONLY,
            default=Parameter.empty if default is MISSING else declared.to_display(default),
            annotation=Annotated[hint, marker],
        )


def _make_marker(name: str, declared: Argument) -> Any:
    """Make the declaration of an argument for typer."""
    described: dict[str, Any] = {
        "metavar": declared.placeholder,
        "help": declared.help,
        "min": declared.minimum,
        "max": declared.maximum,
        "callback": None if declared.role is None else _make_check(declared.role),
        "show_default": declared.shows_default,
    }
    if not declared.names:
        return typer.Argument(**described)
    names = [text or spell_option(name) for text in declared.names]
    return typer.Option(*names, **described)


def _make_check(role: FileRole) -> Callable[[Any], Any]:
    """Make the check of the files of an argument: one, several or none."""

    def check(value: Any) -> Any:

        if isinstance(value, list):
            return [resolve_file(one, role) for one in value]
        return None if value is None else resolve_file(value, role)

    return check


def _get_item(hint: Any) -> Any:
    """Return the type of the values of a repeatable argument; None for a single value."""
    return get_args(hint)[0] if get_origin(hint) is tuple else None


def _collect_paths(value: object) -> Iterator[Path]:
    """Collect the paths in a parameter's value, which may also name a built-in."""
    for one in value if isinstance(value, list) else [value]:
        if isinstance(one, Path | str):
            yield Path(one)

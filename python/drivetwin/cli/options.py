# SPDX-License-Identifier: MIT
"""Command line of a request, and protection of the files that a command reads."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import MISSING, fields
from functools import cache, update_wrapper
from inspect import Parameter, Signature, signature
from pathlib import Path
from types import GenericAlias
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import typer

from drivetwin._util.atomic import protect_files, remove_unfinished
from drivetwin._util.outputs import Output, lock_outputs
from drivetwin._util.request import Argument, FileRole, Request, get_arguments, spell_option
from drivetwin.cli.output import deliver
from drivetwin.report.blocks import Outcome

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
        from drivetwin.cli.file_kinds import resolve_file

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

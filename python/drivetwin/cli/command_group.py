# SPDX-License-Identifier: MIT
"""Groups of commands; each is built from its request when it is called, not when help lists it.

Help is plain text: loading the library that frames it takes longer than all the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, fields
from functools import cache
from importlib import import_module
from inspect import Parameter, Signature, getdoc
from pathlib import Path
from types import GenericAlias
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import typer
from typer.core import TyperGroup

from drivetwin._util.atomic import protect_files, remove_unfinished
from drivetwin._util.request import (
    Argument,
    FileRole,
    Request,
    get_arguments,
    lock_outputs,
    spell_option,
)
from drivetwin._util.text import escape_line
from drivetwin.cli.output import deliver
from drivetwin.errors import INTERRUPTED
from drivetwin.report.blocks import Outcome

OWN_CODES = {"try": {1: "an assertion of the controller failed"}}
"""Exit codes that one command alone has."""


def format_end(request: type[Request]) -> str:
    """Format the end of the help of a command: examples and exit codes."""
    calls = [f"  drivetwin {call}" for call in request.examples]
    codes = {0: "done", **OWN_CODES.get(request.command_name, {})}
    codes[2] = "wrong usage, or an input that cannot be used"
    if "strict" in get_arguments(request):
        codes[3] = "done, but not confirmed (--strict)"
    codes[INTERRUPTED] = "interrupted"
    listed = [f"  {code:>3}  {text}" for code, text in codes.items()]
    return "\n".join(("\b", "Examples:", *calls, "", "\b", "Exit codes:", *listed))


WRONG_USAGE = 2
"""Exit code of a call without a command."""
PLAIN: dict[str, Any] = {"rich_markup_mode": None, "pretty_exceptions_enable": False}
"""Settings of every command: help and faults without frames."""


class CommandGroup(TyperGroup):
    """Group of lazy commands; usage errors quote arguments, such as file names, with escapes."""

    def __init__(self, *, entries: Mapping[str, Entry], **attributes: Any) -> None:
        super().__init__(**{**attributes, "rich_markup_mode": None})
        self.commands: Any = LazyCommands(entries)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments; without any, print the help and exit with code 2."""
        if not args and not ctx.resilient_parsing:
            typer.echo(ctx.get_help(), err=True)
            ctx.exit(WRONG_USAGE)
        return super().parse_args(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002
        """Write the names of the commands, each with its summary."""
        rows = [(name, self.commands.summarize(name)) for name in self.commands]
        with formatter.section("Commands"):
            formatter.write_dl(rows)

    def invoke(self, ctx: Any) -> Any:
        """Invoke a command."""
        try:
            return super().invoke(ctx)
        except Exception as fault:
            message = getattr(fault, "message", None)
            if isinstance(message, str):
                vars(fault)["message"] = escape_line(message)
            raise


Entry = type[Request] | CommandGroup
"""A command as its request, or a group of commands."""


class LazyCommands(Mapping[str, Any]):
    """Commands by name; the parameters of a command are read when it is looked up."""

    def __init__(self, entries: Mapping[str, Any]) -> None:
        self.entries = entries

    def __getitem__(self, name: str) -> Any:
        return build_command(name, self.entries[name])

    def __iter__(self) -> Iterator[str]:
        return iter(self.entries)

    def __len__(self) -> int:
        return len(self.entries)

    def summarize(self, name: str) -> str:
        """Return the first paragraph of the help of a command, on one line."""
        entry = self.entries[name]
        text = entry.help if isinstance(entry, CommandGroup) else getdoc(entry)
        return " ".join((text or "").split("\n\n")[0].split())


@cache
def build_command(name: str, entry: Entry) -> Any:
    """Return a group as it is; build a command from its request, whose inputs it protects."""
    if isinstance(entry, CommandGroup):
        return entry
    single = typer.Typer(add_completion=False, **PLAIN)
    single.command(name, epilog=format_end(entry))(bind_command(entry))
    command = typer.main.get_command(single)
    for parameter in command.params:
        described = vars(parameter)
        choices = _list_choices(parameter)
        listed = all(one in (described["help"] or "") for one in choices)
        if sum(map(len, choices)) > _LONGEST and not listed:
            described["help"] = f"{described['help']} One of {', '.join(choices)}."
        described["display_type"] = lambda *_, one=parameter: _describe_type(one)
    return command


_LONGEST = 40
"""Letters of choices that stand beside the name of an option; those of more are in its help."""
_KINDS = {int: "N", float: "NUMBER"}
"""Words for the values of an option in place of Python types; all others are texts."""


def _list_choices(parameter: Any) -> list[str]:
    """List the values of a parameter that has a closed set of them."""
    kind = parameter.type_descriptor
    return [str(getattr(one, "value", one)) for one in kind.choices] if kind.is_choice else []


def _describe_type(parameter: Any) -> str:
    """Describe the values of a parameter for help: its choices, or a word in place of a type."""
    choices = _list_choices(parameter)
    if choices and sum(map(len, choices)) <= _LONGEST:
        return f"<{'|'.join(choices)}>"
    is_named = choices or parameter.param_type_name == "argument"
    return "" if is_named else _KINDS.get(parameter.type_descriptor.annotation, "TEXT")


_AS_JSON = "as_json"
_JSON_HELP = "Print only the result, as JSON on stdout."


def bind_command(request: type[Request]) -> Callable[..., None]:
    """Return a command as a function of the values of the command line, for typer.

    It raises InputError instead of overwriting a file that the command reads. Files that arguments
    other than outputs name are read. Outputs are checked before the computation. A command is also
    refused while another one writes to the same place.
    """
    arguments = get_arguments(request)
    outputs = {name: one.output for name, one in arguments.items() if one.output is not None}

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
                values = {
                    name: arguments[name].to_si(value)
                    for name, value in given.items()
                    if name in stated and name in arguments
                }
                made = load_runner(request)(_make_request(request, values))
                deliver(
                    [made] if isinstance(made, Outcome) else made,
                    as_json=given.get(_AS_JSON, False),
                    strict=given.get("strict", False),
                )

    context = Parameter("context", Parameter.KEYWORD_ONLY, annotation=typer.Context)
    parameters = [context, *_iterate_parameters(request)]
    if request.has_document and _AS_JSON not in arguments:
        hint = Annotated[bool, typer.Option("--json", help=_JSON_HELP)]
        parameters.append(
            Parameter(_AS_JSON, Parameter.KEYWORD_ONLY, default=False, annotation=hint)
        )
    bound.__doc__ = request.__doc__
    vars(bound)["__signature__"] = Signature(parameters)
    bound.__annotations__ = {one.name: one.annotation for one in parameters}
    return bound


def load_runner(request: type[Request]) -> Callable[[Request], Any]:
    """Import the function that runs a command: it returns an `Outcome`, or yields several."""
    module, name = request.runs.split(":")
    return getattr(import_module(f"drivetwin.cli.{module}"), name)  # type: ignore[no-any-return]


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
        if not value:  # of a file that is not given, as in each completion of a line
            return value
        from drivetwin.cli.input_files import resolve_file  # it loads the readers

        if isinstance(value, list):
            return [resolve_file(one, role) for one in value]
        return resolve_file(value, role)

    return check


def _get_item(hint: Any) -> Any:
    """Return the type of the values of a repeatable argument; None for a single value."""
    return get_args(hint)[0] if get_origin(hint) is tuple else None


def _collect_paths(value: object) -> Iterator[Path]:
    """Collect the paths in a parameter's value, which may also name a built-in."""
    for one in value if isinstance(value, list) else [value]:
        if isinstance(one, Path | str):
            yield Path(one)

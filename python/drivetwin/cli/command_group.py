# SPDX-License-Identifier: MIT
"""Groups of commands, each built when it is called, not when help lists it; their examples.

Help is plain text: loading the library that frames it takes longer than all the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cache
from inspect import getdoc
from typing import Any

import typer
from typer.core import TyperGroup

from drivetwin._util.request import Request, get_arguments
from drivetwin._util.text import escape_line
from drivetwin.cli.options import bind_command, get_request
from drivetwin.errors import INTERRUPTED

EXAMPLES: dict[str, tuple[str, ...]] = {
    "demo": ("demo", "demo --scenario gearbox -o demo-gearbox"),
    "synth": (
        "synth -o shift.csv --scenario paper_steps --seed 1",
        "synth --model tip_in -o tip_in.csv",
    ),
    "inspect": (
        "inspect shift.mf4",
        "inspect shift.csv --write-mapping channels.toml --accept-proposals",
    ),
    "shifts": (
        "shifts drive.mf4 --vehicle truck.card.toml -o quality.html",
        "shifts after.mf4 --vehicle truck.card.toml --against before.mf4",
    ),
    "identify": (
        "identify shift.csv --vehicle truck.card.toml -o result",
        "identify a.mf4 b.mf4 --vehicle truck.card.toml --together -o both",
        "identify bus1.blf bus2.blf --hold-out bus2 -o bus",
    ),
    "examine": (
        "examine shift.csv --vehicle truck.card.toml -o examined",
        "examine shift.csv --vehicle truck.card.toml --profile J_out",
    ),
    "fit": ("fit k0.model.toml k0.csv --hold-out other.csv -o k0",),
    "simulate": (
        "simulate result other.csv -o signals.csv -o page.html",
        "simulate k0 other.csv -o page.html",
    ),
    "observe": ("observe result shift.csv -o torques.csv",),
    "calibrate": ("calibrate result --shift 2-3 -o calibration",),
    "try": ("try result --shift 2-3 --controller my_controller.toml -o bench",),
    "report": ("report result", "report monday tuesday other.csv -o comparison.html"),
    "export": (
        "export result --to fmu --shift 2-3 --log shift.csv",
        "export result --to dcm -o truck.dcm",
    ),
    "gearbox": ("gearbox", "gearbox zf-8hp70 --gear 3"),
    "reduce": ("reduce zf-8hp70 --shift 2-3",),
    "drive": ("drive three-set-4000cr --course launch -o drive",),
    "schema": ("schema vehicle-card", "schema --command identify"),
    "app": ("app logs",),
    "fleet run": (
        "fleet logs --vehicle truck.card.toml -o store",
        "fleet run 'logs/*.mf4' --vehicle rules.toml -o store --workers 4",
    ),
    "fleet report": ("fleet report store -o fleet.html",),
    "fleet estimate": ("fleet estimate store --parameter eta",),
    "fleet query": ('fleet query store "SELECT name, value FROM parameters"',),
    "card new": (
        "card new -o truck.card.toml --from shift.csv",
        "card new -o truck.card.toml --draft",
    ),
    "card check": ("card check truck.card.toml shift.csv --strict",),
}
"""Arguments of typical calls by command."""
OWN_CODES = {"try": {1: "an assertion of the controller failed"}}
"""Exit codes that one command alone has."""


def format_end(request: type[Request]) -> str:
    """Format the end of the help of a command: examples and exit codes."""
    calls = [f"  drivetwin {call}" for call in EXAMPLES[request.command_name]]
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


Entry = Callable[..., Any] | CommandGroup
"""A command as its function, or a group of commands."""


class LazyCommands(Mapping[str, Any]):
    """Commands by name; the parameters of a command are read when it is looked up."""

    def __init__(self, entries: Mapping[str, Entry]) -> None:
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
    """Return a group as it is; build a command from its function, whose inputs it protects."""
    if isinstance(entry, CommandGroup):
        return entry
    single = typer.Typer(add_completion=False, **PLAIN)
    single.command(name, epilog=format_end(get_request(entry)))(bind_command(entry))
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

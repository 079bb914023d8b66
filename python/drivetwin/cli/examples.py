# SPDX-License-Identifier: MIT
"""End of the help of each command: calls that are typical, and the exit codes."""

from __future__ import annotations

from drivetwin._util.request import Request, get_arguments
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

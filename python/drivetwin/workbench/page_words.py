# SPDX-License-Identifier: MIT
"""Messages in words of the page: command-line options and commands become steps and fields."""

from __future__ import annotations

import re

_FIELDS = {
    "--name": "the name of the vehicle",
    "--gearbox": "the built-in gearbox",
    "--ratios": "the ratios of the gears",
    "--gears": "the names of the gears",
    "--elements": "the shift elements",
    "--input-gear": "the input gear",
    "--final-drive": "the final drive",
    "--converter": "the map of the converter",
    "--engine-inertia": "the inertia at the engine",
    "--vehicle-inertia": "the inertia of the vehicle",
    "--mass": "the mass of the vehicle",
    "--wheel-radius": "the wheel radius",
    "--output-inertia": "the inertia of the output side",
    "--element": "the data of the shift elements",
    "--sensor": "the sensor class",
    "--vehicle": "a vehicle card",
    "--channels": "the step Channels",
    "--method likelihood": "the likelihood method",
    "--shift": "the choice of the shift",
}
"""Field or step of the page in place of an option."""
_COMMANDS = {
    "inspect": "the step Channels",
    "shifts": "the step Shifts",
    "identify": "the step Identify",
    "export": "the step Report and export",
    "app": "the program",
}
"""Step of the page in place of a command."""
_PHRASES = (
    (
        r"(?:assert|name|choose|give) (?P<thing>the units|its column|it|one|the channel) in a "
        r"channel mapping(?: file)? \(--channels[^)]*\)(?: or in \[channels\] of the card)?",
        r"correct \g<thing> in the step Channels",
    ),
    (r"map (?P<thing>.{1,400}) with --channels", r"give \g<thing> a role in the step Channels"),
    (
        r'assert it in the channel mapping[^:,]*[:,] time = \{ unit = "\w+" \}(?: \(or [^)]*\))?',
        "state the unit of the time column in the step Channels",
    ),
    (
        r"check its unit of time; the channel mapping asserts one: time = .*",
        "correct the unit of the time column in the step Channels",
    ),
    (r", if they are these: channels\..*", ""),
    (
        r"assert it in the channel mapping[^:]*: channels\.\S+ = \{[^}]*\}",
        "correct it in the step Channels",
    ),
    (r" \('drivetwin inspect LOG --write-mapping[^']*' begins one\)", ""),
    (r" \('drivetwin examine --friction free'\)", ""),
    (r"state them by these options, or run .*", "answer them in the form"),
    (
        r"name (?P<thing>it|one) in a channel mapping",
        r"correct \g<thing> in the step Channels",
    ),
)
"""Whole phrases that speak of options, with their replacement."""
_OPTION = re.compile("|".join(rf"{one}(?![\w-])" for one in sorted(_FIELDS, key=len, reverse=True)))
_COMMAND = re.compile(r"'drivetwin (?P<name>[a-z]+)[^']*'")


def replace_options(text: str) -> str:
    """Return a message with steps and fields of the page in place of options and commands."""
    for phrase, words in _PHRASES:
        text = re.sub(phrase, words, text)
    text = _OPTION.sub(lambda found: _FIELDS[found.group()], text)
    return _COMMAND.sub(lambda found: _COMMANDS.get(found["name"], "the workbench"), text)

# SPDX-License-Identifier: MIT
"""Writes the C sources of a twin: the model as it stands in `source/`, and `dt_twin.c`.

Models that the C code cannot represent are rejected before files are written.
"""

from __future__ import annotations

import re
from importlib import resources
from pathlib import Path

from drivetwin._util.atomic import write_bytes
from drivetwin._util.text import escape_text
from drivetwin.errors import InputError
from drivetwin.export.entries import (
    Entry,
    Subject,
    delay_entries,
    get_lock_index,
    list_entries,
    start_entries,
)
from drivetwin.simulation.dual_clutch import DualClutch, FrictionTable, State
from drivetwin.simulation.element_schema import as_json

_LOSS_LAWS = {"paper": "DT_PAPER", "dissipative": "DT_DISSIPATIVE"}


def read_model_sources() -> dict[str, bytes]:
    """The files of the model by name, without the twin's parameters."""
    folder = resources.files("drivetwin.export.c") / "source"
    names = sorted(entry.name for entry in folder.iterdir())
    return {name: (folder / name).read_bytes() for name in names}


def generate_twin_source(subject: Subject) -> str:
    """`dt_twin.c`: parameters and start as initialisers with unit and meaning.

    Raises InputError for a model that the C sources cannot hold.
    """
    subject = subject.reduce()
    model, start = subject.model, subject.start
    check_exportable(model, start)
    names = ", ".join(format_c_string(element.name) for element in model.elements)
    points = {f"clutch[{i}].friction.points": n for i, n in get_table_points(subject).items()}
    return "\n".join(
        (
            "/* SPDX-License-Identifier: MIT */",
            f"/* {_format_comment(subject.name)}: "
            f"{_format_comment(subject.note or 'parameters')}; written by"
            " drivetwin. */",
            "",
            '#include "dt_twin.h"',
            "",
            f"const char dt_twin_name[] = {format_c_string(subject.name)};",
            f"const char *const dt_twin_clutch_names[DT_CLUTCHES] = {{{names}}};",
            "",
            "const dt_params dt_twin_params = {",
            *map(_format_initialiser, list_entries(model)),
            f"    .loss_law = {_LOSS_LAWS[model.loss_law]},",
            *(f"    .{field} = {count}," for field, count in points.items() if count),
            "};",
            "",
            "const dt_start dt_twin_start = {",
            *map(_format_initialiser, start_entries(start)),
            f"    .locked = {get_lock_index(model, start)},",
            "};",
            "",
            "const dt_delays dt_twin_delays = {",
            *map(_format_initialiser, delay_entries(subject.delays)),
            "};",
            "",
        )
    )


def get_table_points(subject: Subject) -> dict[int, int]:
    """Element index -> points of its friction table, 0 for a Stribeck law."""
    laws = (element.friction for element in subject.model.elements)
    return {i: len(getattr(law, "slip", ())) for i, law in enumerate(laws)}


def write_c(subject: Subject, folder: Path) -> tuple[Path, ...]:
    """Write the sources of a twin into `folder`; returns their paths.

    Raises InputError for a model that the C sources cannot hold, and OSError.
    """
    generated = {"dt_twin.c": generate_twin_source(subject).encode()}
    files = {**read_model_sources(), **generated}
    for name, data in files.items():
        write_bytes(folder / name, data)
    return tuple(folder / name for name in files)


def format_c_string(text: str) -> str:
    """A C string literal; octal escapes stand for all but printable ASCII, and for asterisks."""

    def literal(byte: int) -> str:
        return chr(byte) if 32 <= byte < 127 and chr(byte) not in '"\\?*' else f"\\{byte:03o}"

    return '"' + "".join(map(literal, text.encode(errors="backslashreplace"))) + '"'


def _format_comment(text: str) -> str:
    """Text that can neither begin nor end a comment, nor break its line."""
    plain = " ".join(escape_text(text).split())
    return re.sub(r"(?<=\*)(?=/)|(?<=/)(?=\*)", " ", plain)


def _format_initialiser(entry: Entry) -> str:
    value = float(entry.value)  # that of a numpy array would name its type
    return f"    .{entry.field} = DT_C({value!r}), /* {entry.unit}: {entry.meaning} */"


MAX_POINTS = 64
"""DT_POINTS of `dt_model.h`."""
_NOT_ZERO = ("eta", "J_out", "J_v", "v_s", "i_in", "i_f", "i_c", "i_out")
"""Fields that must not be zero in `dt_check`; their range alone would admit zero."""


def check_exportable(model: DualClutch, start: State) -> None:
    """Raise InputError for a model that the C code cannot represent.

    The model must have two shift elements with supported friction laws, and numbers that
    `dt_check` accepts.
    """
    as_json(model)  # names every number that is not finite
    if len(model.elements) != 2:
        raise InputError(
            f"the model has {len(model.elements)} shift elements",
            "export one shift: an off-going and an on-coming element",
        )
    if len(start.locked) > 1:
        raise InputError("more than one element starts locked", "name one or none")
    for element in model.elements:
        law = element.friction
        if isinstance(law, FrictionTable) and len(law.slip) > MAX_POINTS:
            raise InputError(
                f"the friction table of {element.name} has {len(law.slip)} points",
                f"thin it out to at most {MAX_POINTS}, or fit a Stribeck law",
            )
    for entry in list_entries(model):
        _check_range(entry)


def _check_range(entry: Entry) -> None:
    field = entry.name.rpartition(".")[2]
    inside = entry.least <= entry.value <= entry.most
    if not inside or (field in _NOT_ZERO and entry.value == 0.0):
        raise InputError(
            f"{entry.name} = {entry.value:g} {entry.unit} is impossible ({entry.meaning})",
            "correct the value in the twin",
        )

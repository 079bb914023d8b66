# SPDX-License-Identifier: MIT
"""Requests: the one declaration of the arguments of a command.

Command line, JSON Schema, checks, recorded settings and controls of a page derive from it.
"""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import MISSING, Field, FrozenInstanceError, dataclass, field, fields
from enum import Enum, StrEnum
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, dataclass_transform, get_type_hints

from drivetwin._util.atomic import refuse_overwrite
from drivetwin.errors import FileFormatError, InputError, Where


class Shape(StrEnum):
    """Shape of an output."""

    FILE = "file"
    FOLDER = "folder"
    EITHER = "file or folder"


@dataclass(frozen=True)
class Output:
    """Marker of an argument that names an output.

    `endings` are the endings that a file may have, each with its kind; empty: any ending.
    """

    shape: Shape = Shape.FILE
    endings: Mapping[str, str] | None = None

    def check(self, path: Path) -> None:
        """Raise InputError or FileFormatError if nothing can be written to `path`."""
        where = Where(file=str(path))
        if self.shape is not Shape.FOLDER and not path.name:
            raise InputError("this names no file to write to", "name a file", where)
        if self.shape is Shape.FILE and path.is_dir():
            raise InputError("this is a folder, not a file", "name a file in it", where)
        if self.shape is Shape.FOLDER:
            if path.resolve() == path.resolve().parent:
                raise InputError(
                    "this is the root of the file system, not a folder for results",
                    "name a folder in it",
                    where,
                )
            if path.is_file():
                raise InputError("this is a file, not a folder", "name a folder", where)
        refuse_overwrite(path)
        self._check_ending(path)
        _check_place(path)

    def _check_ending(self, path: Path) -> None:
        """Raise FileFormatError if the ending of a file is of no kind that is written."""
        if self.endings and path.suffix.casefold() not in self.endings:
            known = ", ".join(f"{ending} ({kind})" for ending, kind in self.endings.items())
            raise FileFormatError(
                f"no format has the ending {path.suffix!r}", f"use {known}", Where(file=str(path))
            )


def _check_place(path: Path) -> None:
    """Raise InputError if the nearest folder that exists on the way to `path` takes no files."""
    folders = (path, *path.parents) if path.is_dir() else path.parents
    nearest = next((one for one in folders if one.exists()), Path())
    if not nearest.is_dir():
        what = f"{nearest} is a file, so nothing can be in it"
        raise InputError(what, "name another folder", Where(file=str(path)))
    if not os.access(nearest, os.W_OK | os.X_OK):
        what = f"no permission to write in {nearest.resolve()}"
        remedy = "name another folder, or change its permissions"
        raise InputError(what, remedy, Where(file=str(path)))


def select_outputs(paths: Iterable[Path] | None, *endings: str) -> list[Path]:
    """Return the outputs of some endings, in any case of letters."""
    return [path for path in paths or () if path.suffix.casefold() in endings]


PAGE = {".html": "page with figures"}
"""Kind of an output that is a page alone."""
LOG_ENDINGS = {".csv": "text", ".mf4": "MDF 4", ".parquet": "Parquet", ".mat": "MATLAB"}
"""Kinds of an output that is a log."""


try:
    import fcntl
except ImportError:  # not a POSIX system: outputs are not locked
    fcntl = None  # type: ignore[assignment]


@contextmanager
def lock_outputs(paths: Iterable[Path]) -> Iterator[None]:
    """Hold the locks of output paths inside the block; they end with the process at the latest.

    Raises InputError where another command of this user, on this machine, holds one.
    """
    with ExitStack() as held:
        for path in sorted({path.resolve() for path in paths}):
            held.enter_context(_lock(path))
        yield


@contextmanager
def _lock(path: Path) -> Iterator[None]:
    if fcntl is None:
        yield
        return
    import hashlib

    name = hashlib.sha256(os.fsencode(path)).hexdigest()[:32]
    file = Path(tempfile.gettempdir(), f"drivetwin-{os.getuid()}-{name}.lock")
    handle = _acquire(file, path)
    try:
        yield
    finally:
        file.unlink(missing_ok=True)
        os.close(handle)


def _acquire(file: Path, path: Path) -> int:
    """Return the open, locked file. One that its last owner removed meanwhile is made again."""
    while True:
        handle = os.open(file, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(handle)
            raise InputError(
                "another command is writing here",
                "wait until it is through, or give another -o",
                Where(file=str(path)),
            ) from None
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(handle), file.stat()):
                return handle
        os.close(handle)


_KEY = "argument"
"""Key of the declaration in the metadata of a field."""


class Unit(NamedTuple):
    """Unit of numbers on the command line; a fraction, so that whole numbers convert exactly."""

    label: str
    numerator: float = 1.0
    """SI value of `denominator` units."""
    denominator: float = 1.0
    offset: float = 0.0
    """SI value of the zero of the unit."""

    @property
    def is_si(self) -> bool:
        """True if numbers in this unit are those in SI."""
        return self.numerator == self.denominator and self.offset == 0.0


_BARE = Unit("")
RPM, BAR, NM = Unit("rpm", math.pi, 30.0), Unit("bar", 1e5), Unit("Nm")
CELSIUS = Unit("°C", offset=273.15)
SECOND, METRE, MEBIBYTE = Unit("s"), Unit("m"), Unit("MiB", 2.0**20)


class FileRole(StrEnum):
    """Role of a file that a command reads, in words."""

    LOG = "a log"
    TWIN = "a twin"
    RESULT = "a result of an identification"
    CARD = "a vehicle card"
    MAPPING = "a channel mapping"
    OTHER = "another file"


@dataclass(frozen=True)
class Argument:
    """Declaration of a field of a request.

    The command line has `minimum`, `maximum` and values in the display unit `unit`; the field is
    SI. `names` are the names on the command line, empty for a positional argument. `output` marks a
    path that is written, `role` a file that is read. An argument that `decides` nothing may differ
    between an interrupted run and the run that continues it.
    """

    help: str
    names: tuple[str, ...] = ()
    metavar: str | None = None
    unit: Unit = _BARE
    minimum: float | None = None
    maximum: float | None = None
    role: FileRole | None = None
    output: Output | None = None
    decides: bool = True
    shows_default: bool = True
    excludes: tuple[str, ...] = ()
    """Arguments beside which this one has no effect, or the other has none."""
    needs: tuple[str, ...] = ()
    """Arguments without which this one has no effect."""

    @property
    def placeholder(self) -> str | None:
        """Word for the value in a help text, by default the unit."""
        return self.metavar or self.unit.label.upper() or None

    def to_display(self, value: Any) -> Any:
        """Convert a number from SI; return other values unchanged."""
        if self.unit.is_si or value is None:
            return value
        return type(value)((value - self.unit.offset) * self.unit.denominator / self.unit.numerator)

    def to_si(self, value: Any) -> Any:
        """Convert a number to SI; return other values unchanged."""
        if self.unit.is_si or value is None:
            return value
        return type(value)(value * self.unit.numerator / self.unit.denominator + self.unit.offset)

    def check(self, name: str, value: Any) -> None:
        """Raise InputError for a number outside the limits; `value` in SI."""
        if value is None:
            return
        shown, unit = self.to_display(value), f" {self.unit.label}".rstrip()
        if self.minimum is not None and shown < self.minimum:
            fault = f"below the minimum of {self.minimum:g}{unit}"
        elif self.maximum is not None and shown > self.maximum:
            fault = f"above the maximum of {self.maximum:g}{unit}"
        else:
            return
        what = f"{name.replace('_', ' ')} is {shown:g}{unit}, {fault}"
        raise InputError(what, "give a number within the limits", Where(key=name))


REQUIRED: Any = MISSING
"""Default of an option that has to be given."""


def option(help: str, *names: str, default: Any = None, **described: Any) -> Any:
    """Declare a field of a request as an option; `described` are fields of `Argument`.

    Without `names` the option is called as the field.
    """
    return field(default=default, metadata={_KEY: Argument(help, names or ("",), **described)})


def flag(help: str, *names: str, **described: Any) -> Any:
    """Declare an option without a value."""
    return option(help, *names, default=False, **described)


def argument(help: str, metavar: str, *, default: Any = REQUIRED, **described: Any) -> Any:
    """Declare a field of a request as a positional argument, as `option` does."""
    declared = Argument(help, metavar=metavar, **described)
    return field(default=default, metadata={_KEY: declared})


def input_file(
    help: str,
    metavar: str = "FILE",
    role: FileRole = FileRole.OTHER,
    default: Any = None,
    **described: Any,
) -> Any:
    """Declare an option that names a file to read."""
    return option(help, metavar=metavar, role=role, default=default, **described)


def output_folder(help: str, metavar: str = "DIR", default: Any = None) -> Any:
    """Declare `-o`, a folder for the results."""
    return output_file(help, metavar, default=default, shape=Shape.FOLDER)


def output_file(
    help: str,
    metavar: str,
    endings: Mapping[str, str] | None = None,
    default: Any = None,
    shape: Shape = Shape.FILE,
) -> Any:
    """Declare `-o`, a file for the results; `endings` as in `Output`."""
    marker = Output(shape, endings)
    return option(help, "-o", "--output", metavar=metavar, output=marker, default=default)


COMMANDS: dict[str, type[Request]] = {}
"""Requests by the name of their command."""


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(field,))
class Request:
    """Base of requests, whose subclasses are frozen dataclasses with keyword arguments.

    The request of a command names it, the function that runs it and typical calls:
    `class Reduce(Request, command="reduce", runs="gearbox:reduce", examples=("reduce box",))`. Its
    docstring is the help of the command.
    Values are checked against the limits of their declarations. The methods of a dataclass are
    stated here once: generating them for each command would slow down every start of the program.
    """

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]
    command_name: ClassVar[str] = ""
    """Name of the command, of which `fleet run` has two words."""
    runs: ClassVar[str] = ""
    """Module below `drivetwin.cli` and function that run the command."""
    examples: ClassVar[tuple[str, ...]] = ()
    """Arguments of typical calls."""
    has_document: ClassVar[bool] = True
    """False for a command without a result for programs."""

    def __init_subclass__(
        cls,
        command: str = "",
        runs: str = "",
        examples: tuple[str, ...] = (),
        has_document: bool = True,
    ) -> None:
        if command:
            cls.command_name, cls.runs = command, runs
            cls.examples, cls.has_document = examples, has_document
            COMMANDS[command] = cls
        dataclass(init=False, repr=False, eq=False, match_args=False, kw_only=True)(cls)

    def __init__(self, **given: Any) -> None:
        stated = frozenset(name for name, one in given.items() if one not in (None, False, ()))
        for one in fields(self):
            if one.name not in given and one.default_factory is not MISSING:
                given[one.name] = one.default_factory()
            elif given.setdefault(one.name, one.default) is MISSING:
                raise TypeError(f"{type(self).__name__} needs {one.name!r}")
        if unknown := given.keys() - self.__dataclass_fields__.keys():
            raise TypeError(f"{type(self).__name__} has no {', '.join(sorted(unknown))}")
        vars(self).update(given)
        vars(self)["_stated"] = stated
        for name, declared in get_arguments(type(self)).items():
            declared.check(name, getattr(self, name))
            self._check_company(name, declared)

    @property
    def stated(self) -> frozenset[str]:
        """Names of the arguments that were given a value."""
        names: frozenset[str] = vars(self)["_stated"]
        return names

    def _check_company(self, name: str, declared: Argument) -> None:
        """Raise InputError for arguments of which one has no effect beside or without another."""
        if name not in self.stated:
            return
        for other in declared.excludes:
            self.refuse_stated([other], f"{spell_option(name)} takes its place")
        missing = [one for one in declared.needs if one not in self.stated]
        if missing:
            what = f"{spell_option(name)} has no effect without {spell_option(missing[0])}"
            raise InputError(what, "give both, or none", Where(key=spell_option(name)))

    def refuse_stated(self, names: Iterable[str], reason: str) -> None:
        """Raise InputError if one of the arguments was given; `reason` is why it has no effect."""
        declared = get_arguments(type(self))
        for name in sorted(self.stated.intersection(names)):
            spelt = next((one for one in declared[name].names if one), spell_option(name))
            what = f"{spelt} has no effect here: {reason}"
            raise InputError(what, "leave it out", Where(key=spelt))

    def __setattr__(self, name: str, value: object) -> None:
        raise FrozenInstanceError(f"cannot assign to field {name!r}")

    def __repr__(self) -> str:
        listed = ", ".join(f"{one.name}={getattr(self, one.name)!r}" for one in fields(self))
        return f"{type(self).__name__}({listed})"

    def select(self, base: type[Request]) -> dict[str, Any]:
        """Return the arguments by name that a base of the request declares."""
        return {name: getattr(self, name) for name in get_arguments(base)}

    def describe_settings(self) -> dict[str, str]:
        """Return the arguments that decide the result as texts by name, files excluded."""
        return {
            name.replace("_", " "): _spell(declared.to_display(getattr(self, name)))
            for name, declared in get_arguments(type(self)).items()
            if declared.decides and declared.role is None and declared.output is None
        }


def get_arguments(request: type[Request]) -> dict[str, Argument]:
    """Return the declarations of the fields of a request by name, in their order."""
    return {one.name: one.metadata[_KEY] for one in fields(request) if _KEY in one.metadata}


def build_request_schema(command: str) -> dict[str, Any]:
    """Return the JSON Schema of the request of a command; numbers in SI.

    Raises InputError for a command that does not exist.
    """
    from pydantic import Field as SchemaField
    from pydantic import create_model

    request = COMMANDS.get(command)
    if request is None:
        raise InputError(f"there is no command {command!r}", f"take one of {', '.join(COMMANDS)}")
    hints = get_type_hints(request)
    described: dict[str, Any] = {}
    for one in fields(request):
        declared = one.metadata.get(_KEY)
        if declared is not None:
            described[one.name] = (
                hints[one.name],
                SchemaField(
                    ... if one.default is MISSING else one.default,
                    description=declared.help,
                    ge=declared.to_si(declared.minimum),
                    le=declared.to_si(declared.maximum),
                ),
            )
    schema: dict[str, Any] = create_model(request.__name__, **described).model_json_schema()
    return schema


def spell_option(name: str) -> str:
    """Return the name of a field as the command line spells it."""
    return f"--{name.replace('_', '-')}"


def _spell(value: object) -> str:
    return str(value.value) if isinstance(value, Enum) else str(value)

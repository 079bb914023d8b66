# SPDX-License-Identifier: MIT
"""Exception classes of the package; each error has a cause, a place and a remedy.

Remedies suggest the spelling of a misspelt word.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from difflib import get_close_matches


def suggest_spelling(word: str, known: Iterable[str]) -> str:
    """Return `; did you mean 'x'?` for the nearest of the `known` words, else what is known."""
    words = list(known)
    by_folded = {each.casefold(): each for each in words}
    near = get_close_matches(word.casefold(), by_folded, n=1)
    if near:
        return f"; did you mean {by_folded[near[0]]!r}?"
    return f"; known here: {', '.join(words)}" if words else ""


PYTHON_WORDS = {
    "(--channels": "(argument 'mapping'",
    "with --channels": "with the argument 'mapping'",
    "--method likelihood": "method='likelihood'",
    "a --hold-out": "a held-out shift",
    "--engine-torque and --engine-speed": "engine_torque and engine_speed",
    "--system-pressure": "system_pressure",
    "another --policy": "another policy",
    "give --controller FILE": "give the controller of the request",
    "(--effort)": "(CalibrationSettings.scale_effort)",
    "(--time-limit)": "(argument 'limits')",
    "(--memory-limit)": "(argument 'limits')",
    "with --shift, such as --shift 2-3": "by its gears",
    "'drivetwin identify'": "'drivetwin.identify'",
}
"""Words of the Python interface in place of options and commands of the shell."""
INTERRUPTED = 130
"""Exit code of a program that Ctrl-C stopped."""


_TIME_DIGITS = 4
"""Digits after the point of a time in a message: 0.1 ms, below the step of any usual log."""


@dataclass(frozen=True)
class Where:
    """Location of a fault: file, channel, time [s] or key path; each part is optional."""

    file: str | None = None
    channel: str | None = None
    time: float | None = None
    key: str | None = None

    def __str__(self) -> str:
        parts = [
            _quote_unprintable(self.file),
            f"channel {self.channel!r}" if self.channel is not None else None,
            f"t = {round(self.time, _TIME_DIGITS):.9g} s" if self.time is not None else None,
            f"key {self.key!r}" if self.key is not None else None,
        ]
        return ", ".join(part for part in parts if part)


def _quote_unprintable(text: str | None) -> str | None:
    """Return a text that contains characters without a glyph, or line ends, as a Python literal."""
    return text if text is None or text.isprintable() else repr(text)


@dataclass(eq=False)
class DrivetwinError(Exception):
    """Base of all errors raised on purpose.

    `what` states the fault with its numbers, `where` its place, `remedy` what to do, in the words
    of the shell. The text of an error has the words of Python; `format_for_shell` has those of the
    shell. Two errors are never equal, and one made in another process comes back from it as it was.
    """

    what: str
    remedy: str
    where: Where = field(default_factory=Where)

    exit_code = 2

    def __post_init__(self) -> None:
        super().__init__(self.what, self.remedy, self.where)  # what copy and pickle make it of

    def __str__(self) -> str:
        text = self.format_for_shell()
        for option, words in PYTHON_WORDS.items():
            text = text.replace(option, words)
        return text

    def format_for_shell(self) -> str:
        """Return the text of the error with the options and commands of the shell."""
        place = str(self.where)
        head = f"{place}: {self.what}" if place else self.what
        return f"{head}\n  -> {self.remedy}" if self.remedy else head


class InputError(DrivetwinError):
    """Something handed in by the user cannot be used as it is."""


class FileFormatError(InputError):
    """The file is empty, binary where text is expected, cut, or not of the format it claims."""


class ReaderFailureError(FileFormatError):
    """The library that reads a format crashes on a file, hangs, or takes too much memory."""


class MissingChannelError(InputError):
    """A quantity that is needed has no channel in the log, or more than one candidate."""


class UnitError(InputError):
    """A unit is missing, unknown, or of another quantity than the channel's."""


class TimeError(InputError):
    """Time stamps do not increase or are not plausible."""


class DamagedChannelError(InputError):
    """A channel holds NaN runs, is constant throughout, saturated or stuck."""


class PlausibilityError(InputError):
    """Values contradict physics or the vehicle card, e.g. a pressure 1e5 times too large."""


class MappingError(InputError):
    """The channel mapping file is wrong or ambiguous."""


class CardError(InputError):
    """A vehicle or gearbox card has unknown keys, wrong types or impossible values."""


class ReductionError(InputError):
    """A shift of a gearbox has no dual-clutch form, or none that can be simulated."""


class NoFixedRatioError(InputError):
    """A gear leaves more than one speed free, as a power split does; no card describes it."""


class ResultFileError(InputError):
    """A twin or result file cannot be read or has an unknown schema."""


class NoShiftError(DrivetwinError):
    """No usable gear shift was found; the text lists the rejected candidates and why."""


class IdentificationError(DrivetwinError):
    """The data cannot carry the identification that was asked for."""


class MissingParameterError(IdentificationError):
    """Parameters of a model are not identified; the text lists each with the reason."""


class SimulationError(DrivetwinError):
    """A simulation ended with a status other than `completed`."""


class MissingExtraError(DrivetwinError):
    """An optional dependency is not installed; the text names the install command."""


class RulesError(InputError):
    """The rules of a fleet are wrong, or none of them takes a log."""


class StoreError(DrivetwinError):
    """A fleet store cannot be opened, read or written: in use, full, read-only, of another kind."""


class SchedulerError(DrivetwinError):
    """The scheduler of a cluster cannot be reached, or stayed away for too long."""


class QueryError(InputError):
    """A question to a fleet store that its database does not understand."""


class RefusedError(InputError):
    """A path, upload or request that the workbench does not accept."""


class CompilerError(DrivetwinError):
    """A C compiler refuses the sources of an export; the text quotes it."""


class ControllerError(DrivetwinError):
    """The user's controller crashes, hangs or gives no finite command; the text has its inputs."""


class InfeasibleError(DrivetwinError):
    """No calibration within the limits was found; the text names those exceeded and by how much."""

# SPDX-License-Identifier: MIT
"""Meaning of the text of a table's cells, numbers, times and clocks, without guessing.

A clock is written `12:34:56.789` or `1:34:56 PM`, with an optional date. The text by which a
database or a measurement file names a code is a number, a state of the vehicle, or a fault: a code
that is no value, because the sender has none, has an invalid one, or is starting.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import date
from enum import Enum
from functools import cache

import numpy as np
from numpy.typing import NDArray

from drivetwin.channels.shiftlog import FloatArray
from drivetwin.channels.units import get_time_factor, is_time_unit
from drivetwin.errors import FileFormatError, TimeError, Where

_STAMP = re.compile(
    r"(?:(?P<date>\S.*?)(?:T|\s+))?(?P<h>[0-9]{1,3}):(?P<m>[0-9]{2}):(?P<s>[0-9]{2})"
    r"(?:[.,:](?P<fraction>[0-9]{1,9}))?(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?"
)
_DATES = (
    re.compile(r"(?P<y>\d{4})[-/.](?P<m>\d{1,2})[-/.](?P<d>\d{1,2})", re.ASCII),
    re.compile(r"(?P<d>\d{1,2})\.(?P<m>\d{1,2})\.(?P<y>\d{4})", re.ASCII),
)
"""Year first, or day.month.year."""

_ONE_DAY = re.compile(r"[0-9]{1,2}/[0-9]{1,2}/[0-9]{2,4}|[0-9]{1,2}-[^\W\d_]{3,4}\.?-[0-9]{4}")
"""Dates that are accepted only if all rows have the same one: with slashes the order of day and
month is ambiguous, and names of months depend on the language."""

_ZONE = re.compile(r"(Z|[+-]\d{2}:?\d{2})$")


def is_clock(cell: str) -> bool:
    """Return True if a cell is a clock time, with or without a date before it."""
    return _parse_clock_cell(cell, "") is not None


def parse_clock_column(cells: Sequence[str], dates: Sequence[str] | None) -> tuple[FloatArray, int]:
    """Return seconds since the first stamp (n,) and the number of stamps that are readable.

    Reading stops at the first cell that is no clock time; `dates` (n,) hold the day where it stands
    in a column of its own. Without any date a step back by more than half a day is midnight.
    """
    seconds = np.zeros(len(cells))
    written: list[str] = []
    for row, cell in enumerate(cells):
        stamp = _parse_clock_cell(cell, "" if dates is None else dates[row])
        if stamp is None:
            return seconds, row
        seconds[row] = stamp[1]
        written.append(stamp[0])
    if not any(written):
        days = np.concatenate(([0.0], np.cumsum(np.diff(seconds) < -0.5 * _DAY)))[: len(cells)]
    else:
        numbered = {text: _parse_days(text) for text in dict.fromkeys(written)}
        numbers = [0 if len(numbered) == 1 else numbered[text] for text in written]
        if None in numbers:
            return seconds, numbers.index(None)
        days = np.array(numbers, np.float64)
    return _DAY * (days - days[:1]) + (seconds - seconds[:1]), len(cells)


def _parse_clock_cell(cell: str, day: str) -> tuple[str, float] | None:
    """The date as written, blank without any, and seconds since midnight."""
    match = _STAMP.fullmatch(_ZONE.sub("", cell.strip()))
    if match is None:
        return None
    hours = int(match["h"])
    if match["half"]:  # 12 AM is midnight, 12 PM noon
        if not 1 <= hours <= 12:
            return None
        hours = hours % 12 + (12 if match["half"] in "Pp" else 0)
    since = 3600.0 * hours + 60.0 * int(match["m"]) + int(match["s"])
    since += float(f"0.{match['fraction']}") if match["fraction"] else 0.0
    written = (match["date"] or day).strip()
    if written and _parse_days(written) is None and not _ONE_DAY.fullmatch(written):
        return None
    return written, since


def _parse_days(text: str) -> int | None:
    for pattern in _DATES:
        if match := pattern.fullmatch(text):
            try:
                return date(int(match["y"]), int(match["m"]), int(match["d"])).toordinal()
            except ValueError:
                return None
    return None


_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_COMMA_NUMBER = re.compile(r"[+-]?(\d+,\d*|,\d+)([eE][+-]?\d+)?", re.ASCII)

_GROUPED = re.compile(r"[+-]?\d{1,3}([ .,'’\u00a0\u202f]\d{3})+([.,]\d*)?", re.ASCII)
"""A number with signs between its thousands, in the manner of any country."""

_NOT_A_NUMBER = re.compile(
    r"[+-]?(nan|nan\((ind|snan)\)|inf|infinity|1\.#(ind|qnan|snan|inf)0*)|#?n/a|n\.a\.|na|<na>|nat|"
    r"\(?null\)?|none|nil|missing|invalid|#nv|#n/v|#num!|#div/0!|#zahl!|#value!|#wert!",
    re.IGNORECASE,
)
"""Words for no number: of C libraries, of databases, of Excel in English and German."""

_ABSENT = re.compile(r"[-\u2010-\u2015\u2212]{1,4}|\.{1,3}|\*{1,4}|\?{1,3}")
"""Signs that stand for an empty cell."""


class Meaning(Enum):
    """Meaning of a cell that holds no number."""

    ABSENT = "no sample"
    NO_NUMBER = "a sample without a number"
    TEXT = "a text"


def classify_text(cell: str) -> Meaning:
    """Return the meaning of a cell that holds no number."""
    if not cell or _ABSENT.fullmatch(cell):
        return Meaning.ABSENT
    return Meaning.NO_NUMBER if _NOT_A_NUMBER.fullmatch(cell) else Meaning.TEXT


def is_number(cell: str) -> bool:
    """Return True if a cell is a number with decimal point or comma."""
    text = cell.strip()
    return (_NUMBER.fullmatch(text) or _COMMA_NUMBER.fullmatch(text)) is not None


def describe_text(cell: str, line: int) -> str:
    """Describe a cell that should hold a number."""
    fault = f"line {line}: {cell[:40]!r} is no number"
    if _GROUPED.fullmatch(cell):
        fault += " that can be read: export without signs between thousands"
    return fault


Written = tuple[bytes | None, bytes | None, bytes | None, bool]
"""The first number of a column with point, with comma and without either; and whether a comma
cannot stand between thousands."""


def check_decimal_signs(columns: Sequence[Written], file: str) -> None:
    """Refuse numbers whose decimal sign is open.

    Raises FileFormatError where both point and comma occur: then one of them groups thousands; and
    where each comma stands as between thousands, in the file or in a column that holds whole
    numbers without.
    """
    comma = next((comma for _, comma, _, _ in columns if comma is not None), None)
    if comma is None:
        return
    example = comma.decode()
    point = next((point for point, _, _, _ in columns if point is not None), None)
    grouped = next(
        ((comma, whole) for _, comma, whole, clear in columns if comma and whole and not clear),
        None,
    )
    if point is not None:
        fault = f"numbers with point ({point.decode()!r}) and with comma ({example!r})"
    elif not any(clear for _, _, _, clear in columns):
        fault = f"the comma in {example!r} and all others may separate decimals or thousands"
    elif grouped is not None:
        one, other = (text.decode() for text in grouped)
        fault = f"a column with {one!r} and {other!r}: the comma may group thousands"
    else:
        return
    remedy = "export with one decimal sign and no sign between thousands"
    raise FileFormatError(fault, remedy, Where(file=file))


def parse_numbers(texts: Iterable[str]) -> FloatArray:
    """Return the numbers (n,) of texts; NaN for texts that are no numbers.

    A comma may be a decimal sign or stand between thousands: such a text is no number.
    """
    stripped = [text.strip() for text in texts]
    known = [is_number(text) and "," not in text for text in stripped]
    return np.array([float(x) if ok else np.nan for x, ok in zip(stripped, known, strict=True)])


def select_numbers(texts: Sequence[str], codes: FloatArray) -> tuple[FloatArray, str] | None:
    """Return the numbers that stand for `codes` (n,) by their texts (n,), and a note.

    Numbers are NaN where a text is no number; the note describes the choice.

    Returns None where the codes are to be taken: no text is a number, or those that are state the
    code itself and others name codes, such as `N` beside `1` and `2`.
    """
    values = parse_numbers(texts)
    is_value = np.isfinite(values)
    same = np.array_equal(values[is_value], codes[is_value])
    if not is_value.any() or (same and not is_value.all()):
        return None
    others = [text.strip() for text, number in zip(texts, is_value, strict=True) if not number]
    named = ", ".join(repr(text) for text in dict.fromkeys(others) if text)
    note = "texts that are numbers taken as values" + (f", not {named}" if named else "")
    return values, "" if same else note


def read_flag(texts: Iterable[str]) -> dict[str, float] | None:
    """Read the texts of a flag as 1 and 0; None where they are no two states.

    One text denies the other, as `Shift in process` and `Shift is not in process`, or both are
    usual words, as `on` and `off`. A flag that never changes has one text.
    """
    found = {text: _read_state(text) for text in texts}
    values = [one for one in found.values() if one is not None]
    if len(values) < len(found) or len(values) != len(set(values)):
        return None
    return {text: one for text, one in found.items() if one is not None}


def _read_state(text: str) -> float | None:
    """Return 0 for a text that denies a state and 1 for one that affirms it; None for others."""
    bare = re.sub(r"^b(['\"])(.*)\1$", r"\2", text.strip())
    words = re.findall(r"[A-Z]?[^\W\d_A-Z]+|[A-Z]+", bare)
    plain = {word.casefold() for word in words}
    if plain & _DENIES:
        return 0.0
    return 1.0 if plain & _AFFIRMS else None


_DENIES = frozenset(
    ("not", "no", "off", "false", "inactive", "disengaged", "disabled", "nicht", "nein", "aus")
)
_AFFIRMS = frozenset(
    ("yes", "on", "true", "active", "engaged", "enabled", "process", "progress", "ja", "ein", "an")
)
"""Words of the two states of a flag."""

_DECIMAL = r"\d+(?:[.,]\d*)?|[.,]\d+"
_WITH_UNIT = re.compile(rf"([+-]?(?:{_DECIMAL})(?:[eE][+-]?\d+)?)\s*([^\W\d_]+)", re.ASCII)
"""`0.001 sec` of MATLAB, `1.5ms`."""

_CLOCK = r"(?P<h>\d+):(?P<m>\d\d):(?P<s>\d\d(?:[.,]\d*)?)"
_DAYS = re.compile(rf"(?:(?P<d>[+-]?\d+) days?,? )?(?P<sign>[+-]?){_CLOCK}", re.ASCII)
"""`0 days 00:00:00.001` of pandas, `1 day, 0:00:00.5` of Python, `-00:00:00.5`."""

_MINUTES = re.compile(r"(?P<sign>[+-]?)(?P<m>\d+):(?P<s>\d\d[.,]\d+)", re.ASCII)
"""`01:02.345`: the decimals belong to seconds. `01:02` may be hours and minutes."""

_ISO = re.compile(
    rf"(?P<sign>[+-]?)P(?:(?P<d>[+-]?\d+)D)?(?:T(?:(?P<h>{_DECIMAL})H)?(?:(?P<m>{_DECIMAL})M)?"
    rf"(?:(?P<s>{_DECIMAL})S)?)?",
    re.ASCII,
)
"""`PT0.001S` of ISO 8601."""

_DAY = 86400.0
_SECONDS = {"h": 3600.0, "m": 60.0, "s": 1.0}


def parse_duration(cell: str) -> float | None:
    """Return the seconds of a duration with its unit, or None."""
    text = cell.strip()
    if match := _WITH_UNIT.fullmatch(text):
        if not is_time_unit(match[2]):
            return None
        return get_time_factor(match[2], Where()) * float(match[1].replace(",", "."))
    for pattern in (_DAYS, _MINUTES, _ISO):
        match = pattern.fullmatch(text)
        if match is None or (pattern is _ISO and not any(map(str.isdigit, text))):
            continue
        parts = {name: part.replace(",", ".") for name, part in match.groupdict("").items()}
        size = sum(float(parts.get(name) or 0.0) * factor for name, factor in _SECONDS.items())
        return float(parts.get("d") or 0.0) * _DAY + (-size if match["sign"] == "-" else size)
    return None


def is_time_text(cell: str) -> bool:
    """Return True if a cell is a clock time or a duration with its unit."""
    return is_clock(cell) or parse_duration(cell) is not None


def parse_time_texts(
    cells: Sequence[str], dates: Sequence[str] | None, lines: Sequence[int], where: Where
) -> FloatArray:
    """Convert a column of texts to seconds (n,), clock times from the first.

    Raises TimeError for the first cell of another format.
    """
    if not is_clock(cells[0]):
        return _parse_durations(cells, lines, where)
    seconds, count = parse_clock_column(cells, dates)
    if count < seconds.size:
        remedy = "export time as seconds since the start of the recording"
        cell, word = cells[count], "clock time"
        if dates is not None and is_clock(cell):  # the day beside it is at fault
            cell, word = dates[count], "date that can be read"
            remedy = f"write it as 2024-05-31 or 31.05.2024, or {remedy}"
        what = f"no time stamp: line {lines[count]}: {cell.strip()[:40]!r} is no {word}"
        raise TimeError(what, remedy, where)
    return seconds


def _parse_durations(cells: Sequence[str], lines: Sequence[int], where: Where) -> FloatArray:
    seconds = np.empty(len(cells))
    for row, cell in enumerate(cells):
        found = parse_duration(cell)
        if found is None:
            what = f"no time stamp: line {lines[row]}: {cell.strip()[:40]!r} is no duration"
            raise TimeError(what, "export time as seconds since the start of the recording", where)
        seconds[row] = found
    return seconds


class CodeMeaning(Enum):
    """Meaning of the text of a code."""

    NUMBER = "a number"
    STATE = "a state"
    FAULT = "no value"


def _normalise(text: str) -> str:
    """Return a text in small letters, without accents."""
    parts = unicodedata.normalize("NFKD", text.casefold())
    return "".join(one for one in parts if not unicodedata.combining(one))


def _list_stems(*lines: str) -> tuple[str, ...]:
    return tuple(_normalise(" ".join(lines)).split())


_FAULTS = _list_stems(
    "error fault fail invalid unavail undefin unknown reserved rsvd unused malfunction defect",
    "implausib unplausib missing timeout overflow underflow corrupt uninit notavail",  # English
    "fehler fehlt fehlend fehlwert störung stoerung ungültig ungueltig unbekannt reserviert defekt",
    "unbelegt unbenutzt undefiniert überlauf ueberlauf unterlauf ersatzwert nichtverfüg",  # German
    "erreur défaut invalide indispon inconnu défaillance",  # French
    "errore guasto sconosciut riservat inválid fallo falla falha desconocid desconhecid reservad",
    "fejl feil ogiltig ugyldig okänd ukendt ukjent otillgänglig ongeldig onbekend storing",
    "błąd nieprawidłow niedostępn nieznan chyba neplatn nedostupn neznám hata geçersiz virhe hiba",
    "érvénytelen ошибк неисправн недейств недоступ неизвест",
    "init инициализ",  # start
)
"""Beginnings of words for a code that is no value, unless the text denies them."""

_WORDS = frozenset(_list_stems("sna err flt undef unkn erro fel fout nan nv"))
"""Such words that only count as a whole."""

_TEXTS = re.compile(r"#?n\s?[./]?\s?[av]\.?|k\.\s?a\.?|don.?t care.*|take no action|out of range")
"""Such texts that only count as a whole."""

_SIGNS = re.compile(
    "(?<![无無没])(故障|错误|錯誤|无效|無効|不可用|未知|初始化|異常|エラー|오류|무효)"
)
"""Such words in scripts without blanks, and the signs before them that deny them."""

_VALUES = _list_stems(
    "avail valid defin use support init installed implemented plausib known signal data value",
    "verfügbar verfuegbar gültig gueltig belegt benutzt definiert vorhanden plausibel bekannt wert",
    "daten disponi valide valido válido connu tillgänglig giltig gyldig beschikbaar geldig present",
)
"""Beginnings of words for a value, which make a text a fault if it denies them."""

_DENIALS = frozenset(
    _list_stems("no not non kein keine keinen nicht ohne without pas sans ei niet geen inte não не")
)
_FREE = frozenset(("free", "frei"))
_ENDED = frozenset(_list_stems("ok done complete completed finished abgeschlossen beendet"))
_DETECTED = _list_stems("present active detected vorhanden aktiv erkannt set gesetzt")
"""Words by whose denial after it a fault is denied: `Fehler nicht vorhanden`."""

_REACH = 2
"""Words over which a denial acts: `not yet available`."""


@cache
def classify_code_text(text: str) -> CodeMeaning:
    """Return the meaning of the text of a code."""
    if np.isfinite(parse_numbers([text])[0]):
        return CodeMeaning.NUMBER
    whole = _normalise(text).strip()
    parted = re.sub(r"(?<=[^\W\d_A-Z])(?=[A-Z])", " ", text)  # NotAvailable
    words = re.findall(r"[^\W\d_]+", _normalise(parted))
    if _TEXTS.fullmatch(whole) or _SIGNS.search(text) or _has_fault(words):
        return CodeMeaning.FAULT
    return CodeMeaning.STATE


def _has_fault(words: Sequence[str]) -> bool:
    """Return True if one of the words states a fault that the others do not deny."""
    if not _ENDED.isdisjoint(words):
        return False
    found = False
    for place, word in enumerate(words):
        denied = not _DENIALS.isdisjoint(words[max(0, place - _REACH) : place])
        is_fault = word in _WORDS or (
            word.startswith(_FAULTS) and not word.endswith(("frei", "los"))
        )
        if is_fault and not denied and not _is_denied_behind(words[place + 1 :]):
            return True
        if denied and word.startswith(_VALUES) and not (found and word.startswith(_DETECTED)):
            return True
        found |= is_fault
    return False


def _is_denied_behind(following: Sequence[str]) -> bool:
    """Return True for the words behind a fault in `error free` and `Fehler nicht vorhanden`."""
    if not following or following[0] in _FREE:
        return bool(following)
    return following[0] in _DENIALS and following[1:] != [] and following[1].startswith(_DETECTED)


@dataclass(frozen=True, eq=False)
class CodeValues:
    """Values (k,) of named codes, NaN for those without; `faults` (k,) marks codes of no value.

    `chosen`: texts are the values, `note` describes that; else the codes themselves are.
    """

    values: FloatArray
    faults: NDArray[np.bool_]
    chosen: bool
    note: str


def interpret_codes(texts: Sequence[str], values: FloatArray) -> CodeValues:
    """Return the values of codes with texts (k,), whose numbers in the unit are `values` (k,)."""
    faults = np.array([classify_code_text(one) is CodeMeaning.FAULT for one in texts], np.bool_)
    others = [text for text, fault in zip(texts, faults.tolist(), strict=True) if not fault]
    found = select_numbers(others, values[~faults])
    numbers, note = (values[~faults], "") if found is None else found
    result = np.full(len(texts), np.nan)
    result[~faults] = numbers
    return CodeValues(result, faults, found is not None, note)


def describe_faults(texts: Sequence[str], counts: Sequence[int], size: int) -> str:
    """Describe samples of named codes left out, of `size` samples; blank without any."""
    named: dict[str, int] = {}
    for text, count in zip(texts, counts, strict=True):
        if count:
            named[text] = named.get(text, 0) + int(count)
    if not named:
        return ""
    listed = ", ".join(f"{count} {text.strip()!r}" for text, count in named.items())
    return f"{listed} of {size} samples left out: by its text the code is no value"

# SPDX-License-Identifier: MIT
"""Meaning of the texts by which databases and measurement files name codes.

A text is a number, a state of the vehicle, or a fault: a code that is no value, because the sender
has none, has an invalid one, or is starting. One table of words serves bus databases and
measurement files.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cache

import numpy as np
from numpy.typing import NDArray

from drivetwin.channels.shiftlog import FloatArray
from drivetwin.logs.formats.cell_text import parse_numbers, select_numbers


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
    result = np.full(len(texts), np.nan)
    result[~faults] = values[~faults] if found is None else found.values
    return CodeValues(result, faults, found is not None, "" if found is None else found.note)


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

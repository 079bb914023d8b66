# SPDX-License-Identifier: MIT
"""Typed answers: numbers with the text in which a person stated them, and other values."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from decimal import Decimal
from itertools import pairwise

from drivetwin._util.toml import MAX_EXPONENT, WrittenNumber, format_text, is_extreme
from drivetwin.vehicle.spec import PriorValue, describe_ratio, parse_teeth

Parser = Callable[[str], object]

MOST_CHARACTERS = 200
"""Longest name."""


def parse_number(text: str) -> float:
    """Parse a finite number with a decimal point, of a size that a card may have."""
    text = text.strip()
    try:
        value = float(text)
    except ValueError:
        if re.fullmatch(r"[+-]?\d+,\d+", text):
            raise ValueError(f"{text!r} is no number: write a point instead of the comma") from None
        raise ValueError(f"{text!r} is no number") from None
    if not math.isfinite(value) or "_" in text:
        raise ValueError(f"{text!r} is no finite number")
    if is_extreme(value):
        raise ValueError(f"{text!r} is beyond 1e{MAX_EXPONENT} or within 1e-{MAX_EXPONENT} of zero")
    return value


def parse_bounded(
    text: str, low: float = 0.0, high: float = 1e12, *, zero: bool = False, unit: str = ""
) -> float:
    """Parse a number above `low` (with `zero` from it on) and up to `high`."""
    value = parse_number(text)
    shown = f" {unit}" if unit else ""
    if value < low or (value == low and not zero):
        raise ValueError(f"{value:g}{shown} is not {'at least' if zero else 'above'} {low:g}")
    if value > high:
        raise ValueError(f"{value:g}{shown} is above {high:g}, the largest value that can be")
    return value


def parse_count(text: str, high: float) -> int:
    """Parse a whole number above zero and up to `high`."""
    value = parse_bounded(text, high=high)
    if value != int(value):
        raise ValueError(f"{value:g} is no whole number")
    return int(value)


def split_list(text: str) -> list[str]:
    """Split a list at semicolons, else at white space, else at commas."""
    if ";" in text:
        parts = text.split(";")
    else:
        parts = re.split(r"\s+", text.strip())
        parts = parts if len(parts) > 1 else text.split(",")
    return [part for one in parts if (part := one.strip().strip(",").strip())]


def parse_name(text: str) -> str:
    """Parse a name: any text of a line, without bytes that are no characters."""
    name = text.strip()
    if not name:
        raise ValueError("the name is empty")
    if len(name) > MOST_CHARACTERS:
        raise ValueError(f"the name has {len(name)} characters, at most {MOST_CHARACTERS} are used")
    if any(0xD800 <= ord(one) <= 0xDFFF for one in name):
        raise ValueError("the name contains bytes that are no text in UTF-8")
    return name


def parse_names(text: str, count: int | None = None) -> tuple[str, ...]:
    """Parse different names, as many as `count` states."""
    names = tuple(parse_name(part) for part in split_list(text))
    if count is not None and len(names) != count:
        raise ValueError(f"{len(names)} names for {count} gears: give one for each gear")
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ValueError(f"{twice!r} is named twice: each gear has its own")
    if not names:
        raise ValueError("no name is given")
    return names


def _split_pair(text: str, separators: str, example: str) -> list[float]:
    """Split one or two numbers; a comma between digits is refused, for it may be a decimal one."""
    if re.search(r"\d\s*,\s*\d", text):
        raise ValueError(f"{text.strip()!r} has a comma: write a decimal point, or {example}")
    texts = re.split(rf"\s*(?:{separators})\s*", text.strip())
    parts = [parse_bounded(part, zero=True) for part in texts]
    if len(parts) not in (1, 2):
        raise ValueError(f"give one number, or {example}")
    return parts


def parse_range(text: str, spread: float = 2.0) -> tuple[float, float]:
    """Parse LOW..HIGH; of one value the range from it over `spread` to it times `spread`."""
    parts = _split_pair(text, r"\.\.\.?|\bto\b|–", "LOW..HIGH for a range, as 4..20")
    low, high = parts if len(parts) == 2 else (parts[0] / spread, parts[0] * spread)
    if not 0.0 < low < high:
        raise ValueError(f"a range is LOW..HIGH with 0 below LOW below HIGH, not {low:g}..{high:g}")
    return low, high


def parse_choice(text: str, choices: Sequence[str]) -> str:
    """Parse one of the `choices`; an unambiguous beginning is enough."""
    wanted = text.strip().casefold()
    exact = [one for one in choices if one.casefold() == wanted]
    found = exact or [one for one in choices if wanted and one.casefold().startswith(wanted)]
    if len(found) != 1:
        raise ValueError(f"{text.strip()!r} is not one of {', '.join(choices)}")
    return found[0]


PLUS_MINUS = r"\+/?-|±"
COMPUTED_DIGITS = 6
"""Digits after the point of a ratio that is computed, as from the teeth of a gearbox [count]."""
MOST_DIGITS = 12
"""Most digits after the point of a measured number [count]; more are rounding errors of a float."""


class StatedNumber(float):
    """A number with its text: digits or tooth counts, and the digits of its standard deviation.

    `digits` are such as TOML takes, or tooth counts; `std_digits` is None where no standard
    deviation is stated. Both keep what a float loses: `2.010` is known better than `2.01`.
    """

    digits: str
    std_digits: str | None

    @classmethod
    def make(cls, digits: str, std_digits: str | None = None) -> StatedNumber:
        """Return the number of a text of digits or tooth counts."""
        number = cls(parse_teeth(digits) if "/" in digits else float(digits))
        number.digits, number.std_digits = digits, std_digits
        return number

    @classmethod
    def measure(cls, measured: PriorValue) -> StatedNumber:
        """Return a measured number, rounded to a tenth of its standard deviation.

        Without a standard deviation, as from speeds without noise, all digits are kept.
        """
        value, std = measured.value, measured.std
        if not std > 0.0:
            return cls.make(repr(float(value)))
        places = min(max(1 - math.floor(math.log10(std)), 0), MOST_DIGITS)
        return cls.make(f"{value:.{places}f}", f"{std:.{places}f}")

    @classmethod
    def compute(cls, value: float) -> StatedNumber:
        """Return a computed ratio, which is known to all digits that a card gets."""
        return cls.make(f"{value:.{COMPUTED_DIGITS}f}")

    @property
    def std(self) -> float | None:
        """Stated standard deviation; None without one. That of tooth counts is zero."""
        if self.std_digits is None:
            return 0.0 if "/" in self.digits else None
        return float(self.std_digits)

    @property
    def entry(self) -> str:
        """Text of the entry on a card, in TOML."""
        digits = format_text(self.digits) if "/" in self.digits else self.digits
        if self.std_digits is None:
            return digits
        return f"{{ value = {digits}, std = {self.std_digits} }}"

    @property
    def typed(self) -> str:
        """Text as a person types it."""
        return self.digits if self.std_digits is None else f"{self.digits}+-{self.std_digits}"

    def to_ratio(self) -> PriorValue:
        """Return the distribution of the number as a ratio."""
        if self.std is not None:
            return PriorValue(float(self), self.std)
        return describe_ratio(WrittenNumber.parse(self.digits))

    def to_prior(self, describe: Callable[[float], PriorValue], factor: float = 1.0) -> PriorValue:
        """Return the distribution in SI; `factor` is the size of the card's unit.

        `describe` is the distribution of a number in SI without a stated standard deviation.
        """
        if self.std is None:
            return describe(factor * self)
        return PriorValue(factor * self, factor * self.std)

    def divide(self, divisor: StatedNumber) -> StatedNumber:
        """Return the ratio that this one is of another, with the uncertainty of both."""
        one, other = self.to_ratio(), divisor.to_ratio()
        if other == PriorValue(1.0):
            return self
        value = one.value / other.value
        std = abs(value) * math.hypot(one.std / one.value, other.std / other.value)
        if std == 0.0:
            return StatedNumber.make(repr(value), "0.0")
        return StatedNumber.measure(PriorValue(value, std))


def parse_stated(
    text: str, low: float = 0.0, high: float = 1e12, *, zero: bool = False, unit: str = ""
) -> StatedNumber:
    """Parse VALUE, or VALUE+-STD with one standard deviation, and keep the digits.

    The value is above `low` (with `zero` from it on) and up to `high`. Raises ValueError for
    another text.
    """
    parts = re.split(rf"\s*(?:{PLUS_MINUS})\s*", text.strip())
    if len(parts) > 2:
        raise ValueError(f"{text.strip()!r} has more than one standard deviation")
    parse_bounded(parts[0], low, high, zero=zero, unit=unit)
    if len(parts) == 2:
        parse_bounded(parts[1], zero=True, unit=unit)
    return StatedNumber.make(*map(_format_digits, parts))


def parse_ratio(text: str, high: float = 1000.0) -> StatedNumber:
    """Parse a ratio above zero: a number, VALUE+-STD, or tooth counts such as 49/33."""
    plain = join_signs(text).strip()
    if "/" in re.sub(PLUS_MINUS, "", plain):
        parse_bounded(repr(parse_teeth(plain)), high=high)
        return StatedNumber.make(plain)
    return parse_stated(plain, high=high)


def parse_clutch_ratio(text: str) -> StatedNumber:
    """Parse a ratio of a clutch, which may be negative but not zero."""
    is_negative = text.strip().startswith("-")
    value = parse_stated(text, -1e3, 1e3) if is_negative else parse_ratio(text)
    if abs(value) < 1e-3:
        raise ValueError(f"{value:g} is too near to zero for a ratio")
    return value


def parse_ratios(text: str) -> tuple[StatedNumber, ...]:
    """Parse the ratios of two or more gears, which fall from low gear to high gear."""
    ratios = tuple(parse_ratio(part) for part in split_list(join_signs(text)))
    if len(ratios) < 2:
        raise ValueError("a card needs two gears or more, as 1.86, 1.41")
    for lower, higher in pairwise(ratios):
        if higher >= lower:
            raise ValueError(
                f"the ratios run from low to high gear: {higher:g} must be below {lower:g}"
            )
    return ratios


def join_signs(text: str) -> str:
    """Return a text of several numbers without the blanks around `+-`, `±`, `/` and `*`."""
    return re.sub(rf"\s*({PLUS_MINUS}|[/*])\s*", r"\1", text)


def _format_digits(text: str) -> str:
    """Write the digits of a number as TOML takes them: without exponent, sign and leading zeros."""
    # The exponent of a zero has no bound; its digits would fill the memory.
    return f"{Decimal(text.strip()):f}" if float(text) else "0.0"

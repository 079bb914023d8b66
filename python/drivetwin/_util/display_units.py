# SPDX-License-Identifier: MIT
"""Units and number formats in which people read, and display of results in notebooks.

Everything inside stays SI. The report draws results and stands above them. The package registers
the report's presenter here when it is imported, so that results do not import the report.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Display:
    """Display unit of a quantity: `label`, and the factor from SI."""

    label: str
    factor: float = 1.0

    def to_display(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values (n,) in the display unit."""
        return values * self.factor


RPM = Display("rpm", 30.0 / math.pi)
BAR = Display("bar", 1e-5)
NM = Display("Nm")
RAD_PER_S = Display("rad/s")

_BY_SI = {
    "1": Display("–"),
    "kg*m^2": Display("kg·m²"),
    "m^3": Display("m³"),
    "N*m": NM,
    "N*m/rad": Display("Nm/rad"),
    "N*m*s/rad": Display("Nm·s/rad"),
    "N*m*s^2/rad^2": Display("Nm·s²/rad²"),
    "Hz": Display("Hz"),
    "Pa": BAR,
    "Pa/s": Display("bar/s", BAR.factor),
    "rad/s": RPM,
    "m/s^2": Display("m/s²"),
    "m/s^3": Display("m/s³"),
    "m/s^1.75": Display("m/s¹·⁷⁵"),
    "rad/s^2": Display("rad/s²"),
    "rad/s^3": Display("rad/s³"),
    "rad/s^1.75": Display("rad/s¹·⁷⁵"),
    "s": Display("ms", 1e3),
    "N*m*s": Display("Nm·s"),
    "N*m/s": Display("kNm/s", 1e-3),
    "J": Display("kJ", 1e-3),
    "W": Display("kW", 1e-3),
}


def get_display_unit(si_unit: str) -> Display:
    """Display unit of an SI unit from the parameter table; the unit itself where none is set."""
    return _BY_SI.get(si_unit) or Display(spell_unit(si_unit))


def spell_unit(si_unit: str) -> str:
    """Return an SI unit as texts spell it, m/s³ for `m/s^3`; values stay in SI."""
    text = si_unit.replace("N*m", "Nm").replace("*", "·")
    return re.sub(r"\^([\d.]+)", lambda power: power[1].translate(_RAISED), text)


_RAISED = str.maketrans("0123456789.", "⁰¹²³⁴⁵⁶⁷⁸⁹·")
"""Digits of powers, as in `_BY_SI`."""

LARGE = 1e4
"""Size in Nm, Nm/rad or Nm·s/rad from which torques, stiffness and damping are shown in kNm."""


def scale_display(display: Display, size: float) -> Display:
    """Return the display unit for values of up to `size` [SI]: kNm in place of Nm if large."""
    if not display.label.startswith("Nm") or not abs(size) >= LARGE:
        return display
    return Display(f"k{display.label}", 1e-3 * display.factor)


def format_with_unit(
    value: float, si_unit: str, half_width: float | None = None, digits: int = 4
) -> str:
    """A quantity [SI] in a sentence: `0.963 ± 0.074 bar`; one without dimension has no unit.

    With a `half_width` [SI] both have its two digits, as in tables; without one, so many `digits`.
    """
    display = get_display_unit(si_unit)
    unit = "" if si_unit == "1" else f" {display.label}"
    if half_width is None:
        return format_significant(value * display.factor, digits) + unit
    number, half = format_uncertainty(value * display.factor, half_width * display.factor)
    return (f"{number} ± {half}" if half else number) + unit


def format_uncertainty(value: float, half_width: float | None) -> tuple[str, str]:
    """Value and half width as text, both cut to two digits of the half width.

    Without a usable half width the value has four digits and the second text is empty; with a very
    small one the value has six.
    """
    if half_width is None or not math.isfinite(half_width) or half_width <= 0.0:
        return format_significant(value), ""
    digits = 1 - math.floor(math.log10(half_width))
    if half_width < 1e-5 * abs(value) or abs(digits) > 12:
        return format_significant(value, 6), format_significant(half_width, 2)
    return _format_digits(value, digits), _format_digits(half_width, digits)


def format_significant(value: float, digits: int = 4) -> str:
    """Text with so many significant digits, never in powers of ten within 1e-6 to 1e9."""
    if not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    exponent = math.floor(math.log10(abs(value)))
    if not -6 <= exponent < 9:
        return f"{value:.{digits - 1}e}"
    return _format_digits(value, digits - 1 - exponent)


def _format_digits(value: float, digits: int) -> str:
    # Zero is added so that a negative zero loses its sign.
    text = f"{round(value, digits) + 0.0:,.{max(0, digits)}f}"
    return text.replace(",", "\u202f").replace("-", "−")


class Presenter(Protocol):
    """Figures and summaries of results, by type of the result."""

    def draw_figure(self, shown: Any, /) -> Any:
        """Return the Plotly figure of a result."""

    def summarise(self, shown: Any, /) -> Any:
        """Return the summary of a result, as text and HTML."""

    def make_frame(self, shown: Any, /) -> Any:
        """Return the pandas data frame of a result."""


_loaders: list[Callable[[], Any]] = []


def register_presenter(load: Callable[[], Any]) -> None:
    """Register the function that imports the presenter; it is called at the first display."""
    _loaders[:] = [load]


def _load_presenter() -> Presenter:
    presenter: Presenter = _loaders[0]()
    return presenter


class DisplayMixin:
    """Base of displayable results: log, shifts, identification, twin, validation."""

    def plot(self) -> Any:
        """Return the Plotly figure of the report."""
        return _load_presenter().draw_figure(self)

    def summary(self) -> Any:
        """Return a summary in a few lines: text for `print`, a table in a notebook."""
        return _load_presenter().summarise(self)

    def to_frame(self) -> Any:
        """Return a pandas data frame: channels or signals over time, or parameters, in SI."""
        return _load_presenter().make_frame(self)

    def _repr_html_(self) -> str:
        """Return the HTML representation for notebooks."""
        return str(self.summary().html)

# SPDX-License-Identifier: MIT
"""Parameter sets for the tests: one of a twin, and a strategy for any."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from hypothesis import strategies as st

from drivetwin.export.parameters.content import Axis, Curve, ParameterSet, Scalar
from drivetwin.export.parameters.files import ParameterFormat, read_parameters, write_parameters
from drivetwin.twin.build import build_twin
from drivetwin.twin.twin import Twin
from tests.report.sample import card, identification


def twin() -> Twin:
    """The made-up identification as a twin."""
    return build_twin(identification(), card())


def format_parameters(content: ParameterSet, kind: ParameterFormat) -> str:
    """Return the text of a parameter file."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "file"
        write_parameters(content, path, kind)
        return path.read_text("utf-8")


def parse_parameters(text: str, kind: ParameterFormat, name: str = "file") -> ParameterSet:
    """Read the text of a parameter file."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        return read_parameters(path, kind)


def reread(content: ParameterSet, kind: ParameterFormat) -> ParameterSet:
    """Write contents and read them back."""
    return parse_parameters(format_parameters(content, kind), kind)


_NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
_UNITS = st.sampled_from(["1", "N*m", "kg*m^2", "N*m*s/rad", "rad/s", "m^3", "Pa", "Hz"])
_NAMES = st.text(min_size=1, max_size=12).filter(lambda name: name.strip() != "")
_TEXTS = st.text(max_size=30)
_POINTS = st.lists(_NUMBERS, min_size=1, max_size=14, unique=True).map(
    lambda points: tuple(sorted({value + 0.0 for value in points}))
)


def _entries(names: list[str]) -> st.SearchStrategy[ParameterSet]:
    """Sets whose numbers and curves have just these names."""
    split = len(names) // 2
    scalars = st.tuples(
        *(st.builds(Scalar, st.just(name), _NUMBERS, _UNITS, _TEXTS) for name in names[:split])
    )
    curves = st.tuples(*(_curves(name) for name in names[split:]))
    return st.builds(ParameterSet, st.text(max_size=20), scalars, curves)


def _curves(name: str) -> st.SearchStrategy[Curve]:
    axes = st.builds(Axis, _NAMES, _POINTS, _UNITS)
    return axes.flatmap(
        lambda axis: st.builds(
            Curve,
            st.just(name),
            st.just(axis),
            st.tuples(*(_NUMBERS for _ in axis.points)),
            _UNITS,
            _TEXTS,
        )
    )


SETS = st.lists(_NAMES, min_size=2, max_size=6).flatmap(_entries)
"""Any contents: names and texts with all of Unicode, numbers over the whole range of doubles."""

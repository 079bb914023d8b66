# SPDX-License-Identifier: MIT
"""Changes of a log as a table: those that must not matter, and damage as loggers and people do it.

Each change is a function of the table and a generator; the names of HARMLESS and DAMAGING are what
a run of the fuzzer reports.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from tests.support.arrays import FloatArray

TIME = "time"


@dataclass(frozen=True)
class Table:
    """A log before it is written: `columns` by name, the first is the time; `busy` [s]: the shift.

    `separator` and `comma` (decimal comma) decide the spelling; NaN is written as `missing`.
    """

    columns: Mapping[str, FloatArray]
    units: Mapping[str, str]
    busy: tuple[tuple[float, float], ...]
    head: tuple[str, ...] = ()
    separator: str = ","
    comma: bool = False
    missing: str = "NaN"

    def text(self) -> str:
        """The table as a CSV file."""
        names = list(self.columns)
        rows = [self.separator.join(names), self.separator.join(self.units[n] for n in names)]
        for values in np.column_stack(list(self.columns.values())):
            cells = [self.missing if np.isnan(v) else f"{v:.9g}" for v in values]
            line = self.separator.join(cells)
            rows.append(line.replace(".", ",") if self.comma else line)
        return "\n".join([*self.head, *rows]) + "\n"

    @property
    def time(self) -> FloatArray:
        """Time [s]."""
        return self.columns[TIME]

    def with_column(self, name: str, values: FloatArray) -> Table:
        """The table with one column replaced or added."""
        return replace(self, columns={**self.columns, name: values})


Change = Callable[[Table, np.random.Generator], Table]


def _channel(table: Table, rng: np.random.Generator) -> str:
    return str(rng.choice([name for name in table.columns if name != TIME]))


def _run(table: Table, rng: np.random.Generator, longest: int) -> slice:
    length = int(rng.integers(3, longest))
    first = int(rng.integers(1, len(table.time) - length - 1))
    return slice(first, first + length)


def _edited(
    table: Table, rng: np.random.Generator, change: Callable[[FloatArray], FloatArray]
) -> Table:
    name = _channel(table, rng)
    return table.with_column(name, change(table.columns[name].copy()))


# --- what must not matter


def comments(table: Table, rng: np.random.Generator) -> Table:
    """Lines of comment above the names."""
    lines = ("# recorded on the bench", "# driver: N.N.; route 7", "#", "# T = 21,5 degrees")
    return replace(table, head=lines[: int(rng.integers(1, 5))])


def reordered(table: Table, rng: np.random.Generator) -> Table:
    """Columns in another order; the time stays first."""
    names = [name for name in table.columns if name != TIME]
    rng.shuffle(names)
    return replace(table, columns={name: table.columns[name] for name in (TIME, *names)})


_UNITS = {
    "rpm": (("rad/s", np.pi / 30.0), ("1/min", 1.0), ("U/min", 1.0), ("min-1", 1.0)),
    "rad/s": (("rpm", 30.0 / np.pi), ("1/min", 30.0 / np.pi)),
    "Nm": (("kNm", 1e-3), ("N·m", 1.0), ("N*m", 1.0)),
    "bar": (("kPa", 100.0), ("Pa", 1e5), ("MPa", 0.1), ("mbar", 1e3)),
    "s": (("ms", 1e3),),
}


def other_units(table: Table, rng: np.random.Generator) -> Table:
    """Numbers and unit of some columns in another unit."""
    columns, units = dict(table.columns), dict(table.units)
    for name, unit in table.units.items():
        choices = _UNITS.get(unit, ())
        if choices and rng.random() < 0.7:
            units[name], factor = choices[int(rng.integers(len(choices)))]
            columns[name] = factor * columns[name]
    return replace(table, columns=columns, units=units)


def decimal_comma(table: Table, _: np.random.Generator) -> Table:
    """Decimal comma and semicolons."""
    return replace(table, separator=";", comma=True)


def more_columns(table: Table, rng: np.random.Generator) -> Table:
    """Columns that mean nothing to a driveline."""
    oil = table.with_column("T_Oil", 80.0 + rng.normal(size=len(table.time)))
    return replace(oil, units={**table.units, "T_Oil": "degC"})


def later_clock(table: Table, rng: np.random.Generator) -> Table:
    """Time that starts elsewhere, also before zero."""
    start = round(float(rng.uniform(-20.0, 1e4)), 3)
    return replace(
        table.with_column(TIME, table.time + start),
        busy=tuple((low + start, high + start) for low, high in table.busy),
    )


def missing_outside(table: Table, rng: np.random.Generator) -> Table:
    """One run of missing numbers in one channel, clear of the shifts."""
    name, values = _channel(table, rng), None
    while values is None:
        part = _run(table, rng, 100)
        low, high = table.time[part.start - 1], table.time[part.stop]
        if all(high < start or low > end for start, end in table.busy):
            values = table.columns[name].copy()
            values[part] = np.nan
    missing = str(rng.choice(["NaN", "", "nan", "n/a"]))
    return replace(table.with_column(name, values), missing=missing)


HARMLESS: dict[str, Change] = {
    change.__name__: change
    for change in (
        comments,
        reordered,
        other_units,
        decimal_comma,
        more_columns,
        later_clock,
        missing_outside,
    )
}

# --- damage


def missing_anywhere(table: Table, rng: np.random.Generator) -> Table:
    """Runs of missing numbers in one to three channels."""
    for _ in range(int(rng.integers(1, 4))):
        name = _channel(table, rng)
        values = table.columns[name].copy()
        values[_run(table, rng, 400)] = np.nan
        table = table.with_column(name, values)
    return table


def stuck(table: Table, rng: np.random.Generator) -> Table:
    """One number repeated for a while."""
    part = _run(table, rng, 600)

    def change(values: FloatArray) -> FloatArray:
        values[part] = values[part.start]
        return values

    return _edited(table, rng, change)


def saturated(table: Table, rng: np.random.Generator) -> Table:
    """A channel that ends at a limit."""
    share = rng.uniform(0.4, 0.98)
    return _edited(table, rng, lambda v: np.minimum(v, np.quantile(v, share)))


def dropout(table: Table, rng: np.random.Generator) -> Table:
    """Zeros for a while."""
    part = _run(table, rng, 300)

    def change(values: FloatArray) -> FloatArray:
        values[part] = 0.0
        return values

    return _edited(table, rng, change)


def spiked(table: Table, rng: np.random.Generator) -> Table:
    """Single wild numbers."""
    places = rng.integers(0, len(table.time), int(rng.integers(1, 12)))

    def change(values: FloatArray) -> FloatArray:
        values[places] += rng.choice([-1.0, 1.0]) * 3.0 * np.ptp(values)
        return values

    return _edited(table, rng, change)


def wrong_sign(table: Table, rng: np.random.Generator) -> Table:
    """A sensor the other way round."""
    return _edited(table, rng, lambda v: -v)


def wrong_unit(table: Table, rng: np.random.Generator) -> Table:
    """Numbers of another unit than the file says."""
    factor = float(rng.choice([30.0 / np.pi, np.pi / 30.0, 1e3, 1e-3, 10.0, 0.1, 1e5, 6.895e-2]))
    return _edited(table, rng, lambda v: factor * v)


def exchanged(table: Table, rng: np.random.Generator) -> Table:
    """Two columns under each other's name."""
    one, other = _channel(table, rng), _channel(table, rng)
    columns = dict(table.columns)
    columns[one], columns[other] = columns[other], columns[one]
    return replace(table, columns=columns)


def bad_clock(table: Table, rng: np.random.Generator) -> Table:
    """Repeated, backward, jumping or wrapped time stamps."""
    time, place = table.time.copy(), int(rng.integers(2, len(table.time) - 2))
    match int(rng.integers(5)):
        case 0:
            time[place] = time[place - 1]
        case 1:
            time[place:] -= 0.5
        case 2:
            time[place:] += float(rng.choice([0.1, 5.0, 1e4]))
        case 3:
            time = np.mod(time, 0.6 * time[-1])
        case _:
            time[place] = np.nan
    return table.with_column(TIME, time)


def cut(table: Table, rng: np.random.Generator) -> Table:
    """A recording that starts late or ends early."""
    first, last = sorted(rng.integers(0, len(table.time), 2).tolist())
    part = slice(first, None) if rng.random() < 0.5 else slice(None, max(last, 1))
    return replace(table, columns={name: v[part] for name, v in table.columns.items()})


def column_lost(table: Table, rng: np.random.Generator) -> Table:
    """A channel that was not recorded."""
    name = _channel(table, rng)
    return replace(table, columns={k: v for k, v in table.columns.items() if k != name})


def dead(table: Table, rng: np.random.Generator) -> Table:
    """A channel with one number throughout."""
    return _edited(table, rng, lambda v: np.full_like(v, float(rng.choice([0.0, v[0], v.mean()]))))


def wrapped(table: Table, rng: np.random.Generator) -> Table:
    """A rolling counter that starts again from zero."""
    share = rng.uniform(0.5, 0.95)
    return _edited(table, rng, lambda v: np.mod(v, share * np.abs(v).max() + 1e-9))


def noisy(table: Table, rng: np.random.Generator) -> Table:
    """Strong noise on one channel."""
    size = rng.uniform(0.01, 0.3)
    return _edited(table, rng, lambda v: v + size * np.ptp(v) * rng.normal(size=v.size))


def coarse(table: Table, rng: np.random.Generator) -> Table:
    """Coarsely rounded numbers."""
    step = rng.uniform(0.005, 0.2)
    return _edited(table, rng, lambda v: np.round(v / (step * np.ptp(v))) * step * np.ptp(v))


def thinned(table: Table, rng: np.random.Generator) -> Table:
    """Fewer rows."""
    every = int(rng.integers(2, 40))
    return replace(table, columns={name: v[::every] for name, v in table.columns.items()})


def late(table: Table, rng: np.random.Generator) -> Table:
    """One channel later than the others."""
    rows = int(rng.integers(5, 150))
    return _edited(table, rng, lambda v: np.concatenate([np.full(rows, v[0]), v[:-rows]]))


DAMAGING: dict[str, Change] = {
    change.__name__: change
    for change in (
        missing_anywhere,
        stuck,
        saturated,
        dropout,
        spiked,
        wrong_sign,
        wrong_unit,
        exchanged,
        bad_clock,
        cut,
        column_lost,
        dead,
        wrapped,
        noisy,
        coarse,
        thinned,
        late,
    )
}

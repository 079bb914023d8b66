# SPDX-License-Identifier: MIT
"""Tables with one row for each reading: channels by name, or a reason why not."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import DrivetwinError, FileFormatError, TimeError
from tests.logs.formats.text_logs import read_csv

UNITS = {"SpdIn": "rpm", "TrqOut": "Nm", "PrsBrk2": "bar"}
Reading = tuple[float, str, float]


def readings(melted: bool = False) -> list[Reading]:
    """Three channels of 20 readings, each at its own stamps."""
    rows = [
        (0.01 * step + 0.001 * place, name, step - 20.25 + place)
        for step in range(20)
        for place, name in enumerate(UNITS)
    ]
    return sorted(rows, key=lambda row: list(UNITS).index(row[1])) if melted else rows


def render(head: str, order: str, sep: str, decimal: str, rows: list[Reading]) -> bytes:
    """Table whose columns are time, name, value, unit, date or clock by the letters of `order`."""
    lines = [head]
    for time, name, value in rows:
        milli = time * (1e3 if "ms" in head else 1.0)
        cells = {
            "T": f"{milli:.4f}".replace(".", decimal),
            "D": f"2024-05-01 10:00:{time:07.4f}",
            "C": f"10:00:{time:07.4f}",
            "N": name,
            "V": f"{value:.4f}".replace(".", decimal),
            "U": UNITS[name],
            "X": "can0",
        }
        lines.append(sep.join(f'"{cells[letter]}"' for letter in order))
    return "\n".join(lines).encode()


@pytest.mark.parametrize("melted", [False, True])
@pytest.mark.parametrize(
    ("head", "order", "sep", "decimal"),
    [
        ('"SECONDS";"PID";"VALUE";"UNITS";', "TNVU", ";", "."),
        ("time [s],signal,value,unit", "TNVU", ",", "."),
        ("Zeit [s];Kanal;Wert;Einheit", "TNVU", ";", ","),
        ("time [s]\tvariable\tvalue", "TNV", "\t", "."),
        ("channel,time [s],value,unit", "NTVU", ",", "."),
        ("Messgröße;Einheit;Zeit [s];Messwert", "NUTV", ";", ","),
        ("timestamp (ms),sensor,reading,unit", "TNVU", ",", "."),
        ("time [s]|value|unit|tag", "TVUN", "|", "."),
        ("signal_name,unit,value,time_s", "NUVT", ",", "."),
        ("Zeitstempel (s)\tBezeichnung\tWert\tEinheit", "TNVU", "\t", ","),
        ("sec;SIGNAL;WERT;EINHEIT", "TNVU", ";", ","),
        ("ms,PID,VALUE,UNITS", "TNVU", ",", "."),
        ("_time,_field,_value", "DNV", ",", "."),
        ("time [s],what,amount,uom", "TNVU", ",", "."),
        ("unit;value;name;time [s]", "UVNT", ";", "."),
    ],
)
def test_readings_become_channels(
    head: str, order: str, sep: str, decimal: str, melted: bool
) -> None:
    log = read_csv(render(head, order, sep, decimal, readings(melted)))
    assert [one.name for one in log.channels] == list(UNITS)
    start = log.channels[0].time[0]
    for place, one in enumerate(log.channels):
        assert one.time - start == pytest.approx(np.arange(20) * 0.01 + 0.001 * place, abs=1e-9)
        assert one.values.tolist() == [step - 20.25 + place for step in range(20)]
        assert one.unit == (UNITS[one.name] if "U" in order else None)
    assert "one row for each reading: 3 channels by name" in log.warnings


def test_a_column_of_states_does_not_make_a_table_of_readings() -> None:
    rows = "".join(f"{0.01 * step:.2f},{'PRND'[step % 4]},{step}.5\n" for step in range(20))
    log = read_csv(f"time [s],lever,speed [rpm]\n{rows}".encode())
    assert [one.name for one in log.channels] == ["speed"]


def test_readings_with_further_columns_are_refused() -> None:
    data = render("time [s],source,signal,value,unit", "TXNVU", ",", ".", readings())
    with pytest.raises(FileFormatError, match=r"each row is one reading.*source"):
        read_csv(data)


def test_readings_by_the_clock_without_a_date_are_refused() -> None:
    data = render("time,name,value", "CNV", ",", ".", readings())
    with pytest.raises(TimeError, match="midnight"):
        read_csv(data)


def test_a_channel_with_two_units_is_refused() -> None:
    data = render("time [s],name,value,unit", "TNVU", ",", ".", readings())
    last = data.rindex(b"bar")
    with pytest.raises(FileFormatError, match="'bar' and in 'kPa'"):
        read_csv(data[:last] + b"kPa" + data[last + 3 :])


def test_a_text_among_values_costs_its_channel_only() -> None:
    data = render("time [s],name,value,unit", "TNVU", ",", ".", readings())
    log = read_csv(data.replace(b'"-20.2500"', b'"on"', 1))
    assert [one.name for one in log.channels] == ["TrqOut", "PrsBrk2"]
    assert log.unreadable == {"SpdIn": "line 2: a value of 'SpdIn' is no number"}


@given(
    rows=st.lists(
        st.tuples(
            st.floats(0, 1e5, width=32),
            st.sampled_from(list(UNITS)),
            st.floats(-1e6, 1e6, width=32),
        ),
        min_size=5,
        max_size=40,
    ),
    sep=st.sampled_from(",;\t|"),
    order=st.permutations("TNVU").map("".join),
)
def test_written_readings_read_back_equal(rows: list[Reading], sep: str, order: str) -> None:
    words = {"T": "time [s]", "N": "name", "V": "value", "U": "unit"}
    head = sep.join(words[letter] for letter in order)
    log = read_csv(render(head, order, sep, ".", rows))
    for one in log.channels:
        mine = [value for _, name, value in rows if name == one.name]
        assert one.values == pytest.approx(mine, abs=1e-4)
    assert sum(one.values.size for one in log.channels) == len(rows)


@given(st.integers(0, 900), st.binary(max_size=4))
def test_damaged_readings_give_a_typed_error_at_worst(place: int, other: bytes) -> None:
    data = render("time [s],name,value,unit", "TNVU", ",", ".", readings())
    damaged = data[:place] + other + data[place + 3 :]
    with contextlib.suppress(DrivetwinError):
        read_csv(damaged)

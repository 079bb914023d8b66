# SPDX-License-Identifier: MIT
"""The CSV reader: layouts found in practice, and files that are none."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from drivetwin.channels.roles import TimeColumn
from drivetwin.errors import (
    DrivetwinError,
    FileFormatError,
    MappingError,
    MissingChannelError,
    TimeError,
    UnitError,
)
from drivetwin.logs.raw import RawLog
from drivetwin.logs.read import read_raw
from tests.logs.formats.text_logs import read_csv


def read(text: str | bytes, time: TimeColumn | None = None) -> RawLog:
    data = text.encode() if isinstance(text, str) else text
    return read_csv(data, "log.csv", time or TimeColumn())


def values(log: RawLog, name: str) -> list[float]:
    (channel,) = log.get_channels(name)
    return [float(value) for value in channel.values]


PLAIN = "time,EngTrq,nAb\ns,Nm,1/min\n0.0,1000,700.5\n0.1,1001,701\n"


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        PLAIN.replace("\n", "\r\n"),
        PLAIN.replace(",", ";"),
        PLAIN.replace(",", "\t"),
        PLAIN.replace(",", ";").replace(".", ","),
        PLAIN.replace(",", "\t").replace(".", ","),
        "\ufeff" + PLAIN,
        "# truck\n% 2nd to 3rd, 60 % pedal\n// x\n\n" + PLAIN,
        PLAIN.replace("s,Nm", "# units follow\ns,Nm"),
        "sep=;\n" + PLAIN.replace(",", ";"),
        PLAIN.replace("\n", ",\n"),
        PLAIN.rstrip("\n"),
        "time [s],EngTrq [Nm],nAb [1/min]\n0.0,1000,700.5\n0.1,1001,701\n",
        "time (s),EngTrq (Nm), nAb (1/min)\n0.0,1000,700.5\n0.1,1001,701\n",
        "time,EngTrq,nAb\n[s],[Nm],[1/min]\n0.0,1000,700.5\n0.1,1001,701\n",
        '"time","EngTrq","nAb"\n"s","Nm","1/min"\n"0,0","1000","700,5"\n"0,1","1001","701,0"\n',
        "EngTrq,nAb,time\nNm,1/min,ms\n1000,700.5,0\n1001,701,100\n",
        PLAIN.replace(",", "|"),
        PLAIN.replace(",", "\t").replace("EngTrq", '"EngTrq"').replace("\n", "\t\n"),
        PLAIN.replace(",", "   "),
        PLAIN.replace("0.0,", "seconds,double,double\n0.0,", 1),
        PLAIN.replace("s,Nm", "elapsed,crankshaft,tail\ns,Nm"),
        PLAIN.replace("s,Nm", "-,-,-\ns,Nm").replace("0.0,", "f8,f8,f8\n0.0,", 1),
        "Zeit;EngTrq;nAb\ns;Nm;1/min\n0,0;1,000E3;7,005e2\n,1;1001,;701\n",
    ],
)
def test_every_layout_gives_the_same_channels(text: str) -> None:
    log = read(text)
    assert [channel.name for channel in log.channels] == ["EngTrq", "nAb"]
    assert [(channel.unit or "").strip("[]") for channel in log.channels] == ["Nm", "1/min"]
    assert values(log, "EngTrq") == [1000.0, 1001.0]
    assert values(log, "nAb") == [700.5, 701.0]
    assert log.channels[0].time == pytest.approx([0.0, 0.1])
    assert log.warnings == ()


def test_utf16_and_latin1_text() -> None:
    text = "time;Öltemp\ns;°C\n0;80\n1;81\n"
    for data in (text.encode("utf-16"), text.encode("cp1252")):
        (channel,) = read(data).channels
        assert (channel.name, channel.unit) == ("Öltemp", "°C")


def test_an_empty_cell_is_no_sample_of_its_column_alone() -> None:
    log = read("time,slow,fast\ns,Nm,bar\n0,1,10\n1,,11\n2,3,12\n3, ,13\n")
    (slow,), (fast,) = log.get_channels("slow"), log.get_channels("fast")
    assert slow.time.tolist() == [0.0, 2.0]
    assert slow.values.tolist() == [1.0, 3.0]
    assert fast.values.tolist() == [10.0, 11.0, 12.0, 13.0]


def test_words_for_no_number_become_nan() -> None:
    log = read("time,x\ns,Nm\n0,1\n1,NaN\n2,n/a\n3,inf\n")
    assert np.isnan(values(log, "x")).tolist() == [False, True, True, True]


def test_a_text_column_is_set_aside_with_its_first_cell() -> None:
    log = read("time,state,x\ns,-,Nm\n0,D,1\n1,D,2\n")
    assert [channel.name for channel in log.channels] == ["x"]
    assert log.unreadable == {"state": "line 3: 'D' is no number"}


@pytest.mark.parametrize(
    "cell", ["1'460.5", "1.460,5", '"1,460.5"', "1\u202f460,5", "1 460.5", "-1'234'460"]
)
def test_signs_between_thousands_are_told(cell: str) -> None:
    log = read(f"time;x\ns;Nm\n0;1{',5' if ',5' in cell else '.5'}\n1;{cell}\n")
    assert "line 4: " in log.unreadable["x"]
    assert log.unreadable["x"].endswith("export without signs between thousands")


def test_an_underscore_is_no_part_of_a_number() -> None:
    assert "'1_0'" in read("time,x\ns,Nm\n0,1_0\n1,2\n").unreadable["x"]


def test_an_index_in_a_name_is_no_unit() -> None:
    log = read("time [s],p[2],p [1]\n0,1,2\n1,3,4\n")
    assert [(channel.name, channel.unit) for channel in log.channels] == [
        ("p[2]", None),
        ("p", "1"),
    ]


def test_a_cut_last_line_is_left_out_and_told() -> None:
    log = read("time,a,b\ns,Nm,Nm\n0,1,2\n1,3,4\n2,5")
    assert values(log, "b") == [2.0, 4.0]
    assert log.warnings == ("the file is cut: line 5, the last, has 2 of 3 fields and is left out",)


def test_the_time_column_can_be_stated() -> None:
    log = read("clock,x\n,Nm\n0,1\n10,2\n", TimeColumn("clock", "ms"))
    assert log.channels[0].time.tolist() == [0.0, 0.01]


@pytest.mark.parametrize(
    ("text", "error", "words"),
    [
        ("", FileFormatError, "the file is empty"),
        ("  \n\n", FileFormatError, "the file is empty"),
        (b"\x00\x01\x02MDF", FileFormatError, "binary or damaged: byte 0"),
        (PLAIN.encode() + b"\x00" * 9, FileFormatError, "byte 55 is no text"),
        ("# only\n# comments\n", FileFormatError, "only comments"),
        ("hello world\n", FileFormatError, "no columns found"),
        ("time,x\n", FileFormatError, "names but no samples"),
        ("time,x\ns,Nm\n", FileFormatError, "names but no samples"),
        ("0,1\n1,2\n", FileFormatError, "holds numbers in place of names"),
        ("time,x\ns,Nm\n0,1\n1\n2,3\n", FileFormatError, "line 4 has 1 fields, the names have 2"),
        ("time,x\ns,Nm\n0,1\n1,2,9\n2,3\n", FileFormatError, "line 4 has 3 fields"),
        ("time;x\ns;Nm\n0.5;1.000,5\n1.5;2,5\n", FileFormatError, "with point ('0.5')"),
        ('time,x\ns,Nm\n0,"1\n1,2\n', FileFormatError, "line 3: a quoted field does not end"),
        ("clock,x\n,Nm\n0,1\n", MissingChannelError, "no time column among clock, x"),
        ("x,lag\nNm,s\n0,1\n", MissingChannelError, "no time column among x, lag"),
        ("lag,lead\ns,s\n0,1\n", MissingChannelError, "no time column among lag, lead"),
        (
            "time,x\nNm,Nm\n0,1\n",
            MissingChannelError,
            "time, x; 'time' is in 'Nm', no unit of time",
        ),
        ("time,t,x\ns,s,Nm\n0,0,1\n", MappingError, "several time columns: time, t"),
        ("time,x\n,Nm\n0,1\n", UnitError, "no unit for its time column"),
        ("time,x\nparsec,Nm\n0,1\n", UnitError, "unknown time unit 'parsec'"),
        ("time,x\ns,Nm\n0,1\n12:01,2\n", TimeError, "line 4: '12:01' is no number"),
        ("time,x\ns,Nm\n0,1\n,2\n2,3\n", TimeError, "line 4 has no time stamp"),
    ],
)
def test_what_is_no_log_is_told(text: str | bytes, error: type[DrivetwinError], words: str) -> None:
    with pytest.raises(error) as caught:
        read(text)
    assert words in caught.value.what
    assert caught.value.remedy
    assert str(caught.value).startswith("log.csv")


def test_a_misspelt_time_column_gets_the_nearest_name() -> None:
    with pytest.raises(MissingChannelError, match="did you mean 'clock'"):
        read("clock,x\ns,Nm\n0,1\n", TimeColumn("Clok", "s"))


def test_date_and_clock_in_columns_of_their_own() -> None:
    log = read("Date;Time;n_in [rpm]\n03.05.2024;23:59:59,9;1200\n04.05.2024;00:00:00,1;1201\n")
    assert [channel.name for channel in log.channels] == ["n_in"]
    assert log.channels[0].time == pytest.approx([0.0, 0.2], abs=1e-9)


def test_a_german_date_and_clock_in_columns_of_their_own() -> None:
    log = read("Datum;Uhrzeit;n\n;;rpm\n03.05.2024;23:59:59,9;1200\n04.05.2024;00:00:00,1;1201\n")
    assert [channel.name for channel in log.channels] == ["n"]
    assert log.channels[0].time == pytest.approx([0.0, 0.2], abs=1e-9)


def test_a_unit_row_above_clock_times() -> None:
    log = read("Zeit,n_in\nhh:mm:ss.ms,rpm\n00:00:01.00,1200\n00:00:01.01,1201\n")
    assert log.channels[0].unit == "rpm"
    assert log.channels[0].time == pytest.approx([0.0, 0.01])


def test_a_broken_clock_time_is_told_with_its_line() -> None:
    with pytest.raises(TimeError, match="line 3: 'noon' is no clock time"):
        read("Time,n_in [rpm]\n12:00:00,1200\nnoon,1201\n")


def test_names_and_units_in_comment_lines() -> None:
    log = read("# logger 7, v2\n# time, n_in, te\n# s, rpm, Nm\n0.0,1200,5\n0.1,1201,6\n")
    assert [(one.name, one.unit) for one in log.channels] == [("n_in", "rpm"), ("te", "Nm")]
    log = read("% made by hand\n% time [s];n_in [rpm]\n0,0;1200\n0,1;1201\n")
    assert [(one.name, one.unit) for one in log.channels] == [("n_in", "rpm")]
    assert log.channels[0].time.tolist() == [0.0, 0.1]


ROWS = "".join(f"{k / 10},{1000 + k},700.5\n" for k in range(20))


@pytest.mark.parametrize(
    "head", ["Recorded by: N.N.\n\n", "Recorded by,N.N.\nVehicle,A 123\n", "a;b;c;d;e\n"]
)
def test_lines_of_another_form_above_the_names_are_told(head: str) -> None:
    log = read(head + "time,EngTrq,nAb\ns,Nm,1/min\n" + ROWS)
    assert [one.name for one in log.channels] == ["EngTrq", "nAb"]
    assert len(values(log, "EngTrq")) == 20
    (warning,) = log.warnings
    assert "above the names left out" in warning


def test_rows_of_numbers_above_the_names_are_no_head() -> None:
    with pytest.raises(FileFormatError):
        read("0.0,1000,700.5,3\n0.1,1000,700.5,3\ntime,EngTrq,nAb\n" + ROWS)


def test_a_row_without_time_below_the_units_is_no_row_of_types() -> None:
    with pytest.raises(TimeError, match="line 3"):
        read(PLAIN.replace("0.0,1000", "x,1000"))


@pytest.mark.parametrize(("unit", "factor"), [("s", 1.0), ("ms", 1e3)])
def test_stamps_from_1970_count_from_the_first(unit: str, factor: float) -> None:
    rows = [f"{factor * (1763866345 + k / 100):.15g},{k}" for k in range(20)]
    log = read("\n".join(["time,x", f"{unit},Nm", *rows]))
    assert log.channels[0].time == pytest.approx(np.arange(20) / 100, abs=1e-12)
    assert log.warnings == ("time counts from the first stamp, 1763866345 s",)


@pytest.mark.parametrize(
    "row", ["double,double,double", ",CAN1,XCP", "-,-,-", "s,double,1/min", "double,,"]
)
def test_comments_and_types_below_leave_the_names_their_units(row: str) -> None:
    log = read(f"time [s],EngTrq [Nm],nAb [1/min]\n{row}\n0.0,1000,700\n0.1,1001,701\n")
    assert {one.name: one.unit for one in log.channels} == {"EngTrq": "Nm", "nAb": "1/min"}
    assert log.channels[0].time.tolist() == [0.0, 0.1]


def test_a_unit_below_counts_where_brackets_in_the_name_hold_none() -> None:
    log = read("time,Prs [1],Trq [CAN],x\ns,bar,Nm,furlong\n0.0,1,2,3\n0.1,1,2,3\n")
    assert [one.unit for one in log.channels] == ["bar", "Nm", "furlong"]
    log = read("time [s],Trq [Nm],x\ndouble,double,double\n0.0,1,2\n0.1,1,2\n")
    assert [one.unit for one in log.channels] == ["Nm", None]


@pytest.mark.parametrize(
    "rows",
    [
        ['0,"1,001"', "1,990"],
        ['0,"1,001"', '1,"1,002"'],
        ['0,"-1,001"', '1,"121,500"'],
        ['0,"1,234,567"', '1,"1,002"'],
    ],
)
def test_commas_that_may_group_thousands_are_refused(rows: list[str]) -> None:
    with pytest.raises(FileFormatError, match="may separate decimals or thousands"):
        read("\n".join(["time,x", "ms,Nm", *rows]))


def test_whole_numbers_beside_commas_of_thousands_are_refused_in_each_column() -> None:
    with pytest.raises(FileFormatError, match="a column with '1,001' and '990'"):
        read("time;x\ns;Nm\n0,0;1,001\n0,1;990\n")
    log = read("time;x\ns;Nm\n0,0;1,001\n0,1;1,990\n")
    assert values(log, "x") == [1.001, 1.99]


@pytest.mark.parametrize("proof", ["0,990", "1,5", "1,0021", "1001,002", ",500", "1,001e3"])
def test_one_comma_that_groups_no_thousands_tells_for_its_column(proof: str) -> None:
    log = read(f"time;x\nms;Nm\n0;1,001\n1;{proof}\n2;990\n")
    assert values(log, "x") == [1.001, float(proof.replace(",", ".")), 990.0]


@pytest.mark.parametrize("day", ["11/22/2026", "31.02.2026", "Monday"])
def test_a_date_that_cannot_be_read_is_told_and_not_the_clock(day: str) -> None:
    with pytest.raises(TimeError, match=f"line 2: '{day}' is no date that can be read"):
        read(f"Date,Time,n_in [rpm]\n{day},23:59:59,1200\n11/23/2026,00:00:00,1201\n")


PAIRS = """t1;EngTrq;t2;nAb;PrsBrk2
s;Nm;ms;1/min;bar
0,00;1000;5;700,5;1,5
0,01;1001;25;701;
0,02;;;;
0,03;1003;;;
"""


@pytest.mark.parametrize(
    "text",
    [
        PAIRS,
        PAIRS.replace("t1", "time").replace("t2", "time"),
        re.sub("(?m)^(.*?;.*?);", r"\1;;", PAIRS),
        PAIRS.replace("0,02;;;;", "0,02;;NaN;NaN;NaN"),
    ],
)
def test_each_of_several_time_columns_is_that_of_the_columns_behind(text: str) -> None:
    log = read(text)
    found = {one.name: (one.time.tolist(), one.values.tolist()) for one in log.channels}
    assert found == {
        "EngTrq": ([0.0, 0.01, 0.03], [1000.0, 1001.0, 1003.0]),
        "nAb": ([0.005, 0.025], [700.5, 701.0]),
        "PrsBrk2": ([0.005], [1.5]),
    }
    (warning,) = log.warnings
    assert "each for the columns that follow it" in warning


def test_several_time_columns_keep_one_origin() -> None:
    log = read("t1 [ms],x [Nm],t2 [ms],y [Nm]\n1717151696123,1,1717151696120,2\n")
    assert [one.time.tolist() for one in log.channels] == [[0.003], [0.0]]


def test_a_summary_below_the_rows_is_refused_with_its_line() -> None:
    with pytest.raises(TimeError, match="line 5: 'Mean' is no number") as refusal:
        read("time,x\ns,Nm\n0,1\n0.1,2\nMean,1.5\n")
    assert "remove that line if it is a summary" in refusal.value.remedy


def test_a_value_beside_no_stamp_of_its_own_is_refused() -> None:
    with pytest.raises(TimeError, match=r"channel 'y': line 3 has no time stamp"):
        read("t1 [s],x [Nm],t2 [s],y [Nm]\n0,1,0,2\n1,2,,3\n")


@pytest.mark.parametrize(
    "names",
    ["time,timestamp,x,y", "time,x,timestamp,y", "time,x,y,time", "x,time,y,time"],
)
def test_time_columns_that_are_none_of_pairs_are_not_chosen_between(names: str) -> None:
    with pytest.raises(MappingError, match="several time columns"):
        read(f"{names}\ns,s,s,s\n0,1,2,3\n1,2,3,4\n")


def test_a_temperature_is_no_time() -> None:
    log = read("time,EngTrq,T1,T2\ns,Nm,degC,°C\n0.0,5,20,21\n0.1,6,20,21\n")
    assert [one.name for one in log.channels] == ["EngTrq", "T1", "T2"]


@pytest.mark.parametrize(
    "head",
    [
        "Run 5;;\nDriver;N.N.;\n",
        "Time;12:30;\nDate;03.05.2024;\n",
        "sep=;\nRun;5;\n",
        ";CAN1;XCP\n",
        "a;b;c\nd;e;f\n",
    ],
)
def test_rows_as_wide_as_the_table_may_stand_above_the_names(head: str) -> None:
    log = read(head + "time;EngTrq;nAb\ns;Nm;1/min\n0,0;1000;700,5\n0,1;1001;701\n")
    assert {one.name: one.unit for one in log.channels} == {"EngTrq": "Nm", "nAb": "1/min"}
    assert log.channels[0].time.tolist() == [0.0, 0.1]
    assert "above the names left out" in log.warnings[0]


@pytest.mark.parametrize("stamp", ["", "nan"])
def test_a_first_row_without_time_is_no_row_of_units(stamp: str) -> None:
    text = f"time [s],x [Nm],g\n{stamp},1000,1\n0.1,1001,1\n"
    if stamp:
        assert read(text).channels[0].values.tolist() == [1000.0, 1001.0]
    else:
        with pytest.raises(TimeError, match="line 2 has no time stamp"):
            read(text)
    assert read("time,g\ns,1\n0.0,0\n").channels[0].unit == "1"


@pytest.mark.parametrize("word", ["-nan", "-nan(ind)", "-1.#IND", "1.#QNAN0", "Infinity", "#NV"])
@pytest.mark.parametrize("other", ["", "5"])
def test_what_programs_write_for_no_number_is_none(word: str, other: str) -> None:
    column = values(read(f"time [s],x [Nm]\n0,{word}\n1,{other}\n2,6\n"), "x")
    assert not np.isfinite(column[0])
    assert column[1:] == ([5.0, 6.0] if other else [6.0])


def test_of_two_time_columns_that_of_numbers_is_taken() -> None:
    """A data frame with an index of dates keeps the time column that it had."""
    log = read(
        "timestamps,x,Time\n2024-07-03 15:32:45.500-03:00,1,10.5\n"
        "2024-07-03 15:32:45.600-03:00,2,10.6\n",
        TimeColumn(unit="s"),
    )
    assert [one.name for one in log.channels] == ["x"]
    assert np.diff(log.channels[0].time) == pytest.approx([0.1])
    assert any("Time is used, not timestamps" in one for one in log.warnings)


@pytest.mark.parametrize(
    ("texts", "values"),
    [
        (("b'Shift in process'", "b'Shift is not in process'"), [1.0, 0.0]),
        (("off", "on"), [0.0, 1.0]),
        (("inactive", "active"), [0.0, 1.0]),
        (("b'ShiftInProcess'", "b'ShiftInProcess'"), [1.0, 1.0]),
    ],
)
def test_texts_of_two_states_are_a_flag(texts: tuple[str, str], values: list[float]) -> None:
    log = read(f"time [s],flag\n0,{texts[0]}\n1,{texts[1]}\n")
    (flag,) = log.channels
    assert flag.values.tolist() == values
    assert "texts taken as a flag" in flag.notes[0]


@pytest.mark.parametrize("texts", [("eco", "sport"), ("on", "sport"), ("on", "active")])
def test_other_texts_are_no_flag(texts: tuple[str, str]) -> None:
    log = read(f"time [s],x,mode\n0,1,{texts[0]}\n1,2,{texts[1]}\n")
    assert [one.name for one in log.channels] == ["x"]


@pytest.mark.parametrize(
    "rows",
    [
        ["0,000,1540,2,1642,1", "0,010,1540,3,1642,7", "0,020,1541,1,1640,2"],
        ["0,1540,1642,1", "0,010,1540,1642,7", "0,020,1541,3,1640,2"],
        ["0,1540,1642", "1,1540,1642", "2,1541,1640", "3,010,1541,1640"],
    ],
    ids=["all", "some", "a late one"],
)
def test_a_comma_for_columns_and_decimals_is_named(tmp_path: Path, rows: list[str]) -> None:
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time,EngTrq,SpdIn", "s,Nm,rpm", *rows]) + "\n")
    with pytest.raises(FileFormatError, match=r"line \d .*seems to be the decimal sign") as caught:
        read_raw(path)
    assert "semicolon" in caught.value.remedy


@pytest.mark.parametrize("name", ["t_ms", "time_in_ms", "t.ms", "Trip Time(Since start)(ms)"])
def test_the_unit_of_a_time_is_in_its_name(tmp_path: Path, name: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(f"{name},EngTrq(actual)(Nm)\n0,1540\n10,1541\n20,1540\n")
    (torque,) = read_raw(path).channels
    assert (torque.name, torque.unit) == ("EngTrq(actual)", "Nm")
    assert torque.time.tolist() == pytest.approx([0.0, 0.01, 0.02])


def test_of_the_clocks_of_a_phone_the_fine_one_is_used(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    gps = "Wed Aug 05 18:57:56 GMT+01:00 2026"
    rows = [f"{gps},05-Aug-2026 18:57:56.{k:03d},0.0,{1540 + k}" for k in range(0, 40, 10)]
    head = "GPS Time, Device Time,Trip Time(Since journey start)(s),EngTrq(actual)(Nm)"
    path.write_text("\n".join([head, *rows]) + "\n")
    raw = read_raw(path)
    assert [one.name for one in raw.channels] == ["EngTrq(actual)"]
    assert raw.channels[0].time.tolist() == pytest.approx([0.0, 0.01, 0.02, 0.03])
    left = "Trip Time(Since journey start), GPS Time"
    assert f"several time columns: Device Time is used, not {left}" in raw.warnings

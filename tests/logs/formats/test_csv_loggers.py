# SPDX-License-Identifier: MIT
"""Tables as loggers and programs write them: heads, markers, footers, durations, absent values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from drivetwin.errors import DrivetwinError, FileFormatError, MappingError, TimeError
from drivetwin.logs.raw import RawLog
from tests.logs.formats.text_logs import read_csv

COUNT = 12
STEP = 0.01


def read(text: str | bytes) -> RawLog:
    data = text.encode() if isinstance(text, str) else text
    return read_csv(data)


def rows(
    separator: str = ",",
    stamp: Callable[[int], str] = lambda k: f"{STEP * k:.2f}",
    end: str = "",
    decimal: str = ".",
) -> str:
    lines = (separator.join([stamp(k), f"{1000 + k}.5", f"{700 - k}.25"]) + end
             for k in range(COUNT))  # fmt: skip
    return "\n".join(line.replace(".", decimal) for line in lines) + "\n"


def check(log: RawLog) -> None:
    found = {one.name: one for one in log.channels}
    assert set(found) == {"EngTrq", "nAb"}
    assert [found["EngTrq"].unit, found["nAb"].unit] == ["Nm", "rpm"]
    for one in found.values():
        assert one.time == pytest.approx(STEP * np.arange(COUNT), abs=1e-9)
    assert found["EngTrq"].values.tolist() == [1000.5 + k for k in range(COUNT)]
    assert found["nAb"].values.tolist() == [700.25 - k for k in range(COUNT)]


def count_from_start(log: RawLog) -> RawLog:
    start = log.channels[0].time[0]
    moved = (replace(one, time=one.time - start) for one in log.channels if one.name != "sats")
    return RawLog(tuple(moved), warnings=log.warnings)


NAMES = "Time,EngTrq,nAb\n"
UNITS = "s,Nm,rpm\n"
BESIDE = "Time [s],EngTrq [Nm],nAb [rpm]\n"
PLAIN = BESIDE + rows()
LINES = PLAIN.splitlines(keepends=True)

LVM_HEAD = """LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Multi_Headings\tYes
X_Columns\tOne
Time_Pref\tAbsolute
Date\t2023/11/24
Time\t10:11:12.0000000000
***End_of_Header***\t
\t
"""
LVM_SEGMENT = """Channels\t2\t
Samples\t12\t12
Date\t2023/11/24\t2023/11/24
Time\t10:11:12.0\t10:11:12.0
Y_Unit_Label\tNm\trpm
X_Dimension\tTime\tTime
X0\t0.0E+0\t0.0E+0
Delta_X\t0.01\t0.01
***End_of_Header***\t\t
X_Value\tEngTrq\tnAb\tComment
"""
TAB = rows("\t").splitlines(keepends=True)

VBO = """File created on 24/11/2023 at 10:11:12

[header]
satellites
time
EngTrq
nAb

[channel units]
Nm
rpm

[comments]
(c) 2001 - 2013
Version 1.0

[column names]
sats time EngTrq nAb

[data]
"""

HEADS: dict[str, str] = {
    "hp tuners": "HP Tuners CSV Log File\nVersion: 1.0\n\n[Log Information]\nNotes: \n\n"
    "[Channel Information]\n0,12,27\nOffset,EngTrq,nAb\ns,Nm,rpm\n\n[Channel Data]\n" + rows(),
    "cobb": "Time (sec),EngTrq (Nm),nAb (RPM),AP Info:[AP3-SUB-004 v1.7.4.0-17074]\n".replace(
        "RPM", "rpm"
    )
    + rows(),
    "labview": LVM_HEAD + LVM_SEGMENT + "".join(TAB),
    "labview segments": LVM_HEAD
    + LVM_SEGMENT
    + "".join(TAB[:5])
    + "\n"
    + LVM_SEGMENT
    + "".join(TAB[5:]),
    "labview comments": LVM_HEAD
    + LVM_SEGMENT
    + "".join(TAB[:4])
    + TAB[4].rstrip("\n")
    + "\tgear 3\n"
    + "".join(TAB[5:]),
    "tuner studio": '"rusEFI 2024"\n"Capture Date: Fri Nov 24 2023"\n'
    + (NAMES + UNITS).replace(",", "\t")
    + "".join(TAB[:3])
    + "MARK 001 - Manual - Fri Nov 24 10:11:14 UTC 2023\n"
    + "".join(TAB[3:]),
    "vcds": "Friday,24,November,2023,10:11:12:12345\n06A 906 032 HN,ADVMB,1.8L\n"
    "Marker,TIME,EngTrq,nAb\n,STAMP,Nm,rpm\n" + rows(stamp=lambda k: f",{STEP * k:.2f}"),
    "vbox": VBO + rows(" ", lambda k: f"008 {101112 + STEP * k:.2f}"),
    "motec": '"Format","MoTeC CSV File",,"Workbook",""\n"Venue","",,"Worksheet",""\n'
    '"Sample Rate","100.000","Hz"\n"Duration","0.12","s"\n\n'
    '"Time","EngTrq","nAb"\n"s","Nm","rpm"\n"","",""\n\n'
    + "".join(f'"{STEP * k:.2f}","{1000 + k}.5","{700 - k}.25"\n' for k in range(COUNT)),
    "aim": '"Format","AiM CSV File"\n"Session","Track"\n"Beacon Markers","33.1","63.2"\n\n'
    '"Time","EngTrq","nAb"\n"s","Nm","rpm"\n\n'
    + "".join(f'"{STEP * k:.2f}","{1000 + k}.5","{700 - k}.25"\n' for k in range(COUNT)),
    "diadem": "DIAdem Export\nName;Time;EngTrq;nAb\nUnit;s;Nm;rpm\nLength;12;12;12\n"
    + rows(";", lambda k: f";{STEP * k:.2f}", decimal=","),
    "canape": "sep=;\nTime[s];EngTrq[Nm];nAb[rpm]\n" + rows(";", decimal=","),
    "inca": "ETASAsciiItemFile\trecord\nsampleCount\t12\n"
    + "time\tEngTrq\tnAb\nf8\tf8\tf8\ns\tNm\trpm\n"
    + rows("\t"),
    "writetimetable": "Time,EngTrq [Nm],nAb [rpm]\n" + rows(stamp=lambda k: f"{STEP * k:.4g} sec"),
    "units above": UNITS + NAMES + rows(),
    "units above with a label": "Units,Nm,rpm\nTime (s),EngTrq,nAb\n" + rows(),
    "rates above": "100,100,100\n" + NAMES + UNITS + rows(),
    "long head": "".join(f"setting {k},{k}\n" for k in range(700)) + PLAIN,
    "footer": PLAIN + "\nEnd of data\n",
    "footer with commas": PLAIN + "End,of,data\n",
    "footer of blanks": PLAIN + ",,\n,,\n",
    "names again": "".join(LINES[:4]) + LINES[0] + "".join(LINES[4:]),
    "names and units again": NAMES
    + UNITS
    + "".join(LINES[1:5])
    + NAMES
    + UNITS
    + "".join(LINES[5:]),
    "markers with commas": "".join(LINES[:4])
    + "Lap 2,start\nEvent,3,by hand,12:00\n"
    + "".join(LINES[4:]),
    "early marker": LINES[0] + LINES[1] + "MARK 1\n" + "".join(LINES[2:]),
    "marker before the rows": LINES[0] + "MARK 0\n" + "".join(LINES[1:]),
    "time with its unit": PLAIN.replace("Time [s]", "time_s"),
    "blanks": NAMES.replace(",", "   ") + UNITS.replace(",", " ") + rows("   "),
    "bars": PLAIN.replace(",", "|"),
    "comma decimals between bars": (BESIDE + rows(decimal=".")).replace(",", "|").replace(".", ","),
    "quoted names": '"Time [s]","EngTrq [Nm]","nAb [rpm]"\n' + rows(),
    "trailing separators": BESIDE.replace("\n", ",\n") + rows(end=","),
    "old line ends": PLAIN.replace("\n", "\r"),
}


@pytest.mark.parametrize("name", HEADS)
def test_heads_markers_and_footers_of_loggers(name: str) -> None:
    log = read(HEADS[name])
    check(count_from_start(log))
    quiet = ("canape", "writetimetable", "time", "blanks", "bars", "comma", "quoted", "trailing")
    clean = name.startswith(quiet) or name in ("old line ends", "cobb", "footer of blanks")
    assert bool(log.warnings) is not clean


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_encodings(encoding: str, end: str) -> None:
    check(read(PLAIN.replace("\n", end).encode(encoding)))


STAMPS: dict[str, Callable[[int], str]] = {
    "sec": lambda k: f"{STEP * k:g} sec",
    "s": lambda k: f"{STEP * k:.3f}s",
    "ms": lambda k: f"{1e3 * STEP * k:g} ms",
    "min": lambda k: f"{STEP * k / 60:.12g} min",
    "hr": lambda k: f"{STEP * k / 3600:.15g} hr",
    "pandas": lambda k: f"0 days 00:00:00.{10 * k:03d}000",
    "pandas short": lambda k: f"0 days 00:00:00{f'.{10 * k:03d}000' if k else ''}",
    "python": lambda k: f'"1 day, 0:00:00.{10 * k:03d}000"',
    "clock": lambda k: f"00:00:01.{10 * k:03d}",
    "short clock": lambda k: f"1:02:03.{10 * k:03d}",
    "minutes": lambda k: f"02:03.{10 * k:03d}",
    "iso duration": lambda k: f"PT0.{10 * k:03d}S",
    "pandas iso": lambda k: f"P0DT0H0M0.{10 * k:03d}S",
    "negative": lambda k: f"-00:00:00.{990 - 10 * k:03d}",
    "date": lambda k: f"2023-11-24 10:11:12.{10 * k:03d}",
    "iso": lambda k: f"2023-11-24T10:11:12.{10 * k:03d}Z",
    "zone": lambda k: f"2023-11-24T10:11:12.{10 * k:03d}+01:00",
    "german": lambda k: f"24.11.2023 10:11:12.{10 * k:03d}",
    "american": lambda k: f"11/24/2023 10:11:12.{10 * k:03d} AM",
    "matlab": lambda k: f"24-Nov-2023 10:11:12.{10 * k:03d}",
    "slashes": lambda k: f"2023/11/24 10:11:12.{10 * k:03d}",
}


@pytest.mark.parametrize("name", STAMPS)
def test_stamps_written_as_text(name: str) -> None:
    log = read("Time,EngTrq [Nm],nAb [rpm]\n" + rows(stamp=STAMPS[name]))
    check(count_from_start(log))


@pytest.mark.parametrize("name", ["sec", "s", "pandas", "clock", "minutes"])
def test_stamps_written_as_text_with_decimal_commas(name: str) -> None:
    text = "Time;EngTrq [Nm];nAb [rpm]\n" + rows(";", STAMPS[name], decimal=",")
    times = read(text).channels[0].time
    assert np.diff(times) == pytest.approx(np.full(COUNT - 1, STEP), abs=1e-9)


@pytest.mark.parametrize("word", ["-", "--", "---", "", " ", "*", "?", "–"])
def test_signs_for_no_value_are_no_samples(word: str) -> None:
    text = "Time [s],a [Nm],b [bar]\n" + "".join(
        f"{k},{k if k % 3 == 0 else word},{k}\n" for k in range(COUNT)
    )
    a, b = read(text).channels
    assert a.time.tolist() == a.values.tolist() == [0.0, 3.0, 6.0, 9.0]
    assert b.values.size == COUNT


@pytest.mark.parametrize("word", ["NaN", "nan", "NA", "N/A", "#N/A", "null", "NULL", "<NA>"])
def test_words_between_slow_samples_are_no_samples(word: str) -> None:
    text = "Time [s],a [Nm],b [bar]\n" + "".join(
        f"{k},{k if k % 3 == 0 else word},{word if k == 5 else k}\n" for k in range(COUNT)
    )
    a, b = read(text).channels
    assert a.time.tolist() == a.values.tolist() == [0.0, 3.0, 6.0, 9.0]
    assert b.values.size == COUNT
    assert np.flatnonzero(np.isnan(b.values)).tolist() == [5]


def test_words_that_are_no_fill_stay_missing_samples() -> None:
    text = "Time [s],a [Nm]\n" + "".join(f"{k},{k if k < 4 else 'NaN'}\n" for k in range(COUNT))
    (a,) = read(text).channels
    assert np.isnan(a.values).sum() == COUNT - 4


REFUSED: dict[str, tuple[str, type[DrivetwinError], str]] = {
    "a row without a stamp": (
        PLAIN.replace("0.05,", "x,"), TimeError, "line 7: 'x' is no number"
    ),
    "a row of statistics": (PLAIN + "Average,1005,694\n", TimeError, "'Average' is no number"),
    "a wide row": (PLAIN.replace("0.05,", "0.05,7,"), FileFormatError, "line 7 has 4 fields"),
    "a narrow row": (
        PLAIN.replace(",695.25", ""), FileFormatError, "line 7 has 2 fields, the names have 3"
    ),
    "another table": (
        PLAIN + "Time,p,q\n0,1,2\n", FileFormatError, "line 14 begins another table"
    ),
    "hours or minutes": ("Time,a [Nm]\n10:11,5\n10:12,6\n", TimeError, "'10:11' is no number"),
    "a duration among others": (
        "Time,a\n0 sec,1\n1 sec,2\n2 parsec,3\n", TimeError, "line 4: '2 parsec' is no duration"
    ),
    "two times": ("Time,Timestamp,a\ns,s,Nm\n0,0,1\n1,1,2\n2,2,3\n", MappingError, "several time"),
    "no names": (rows(), FileFormatError, "line 1 holds numbers in place of names"),
    "a table above": (
        "1,2,3\n4,5,6\n7,8,9\n" + PLAIN, FileFormatError, ""
    ),
    "packed clock": (
        VBO + "008 101161.00 1 2\n008 101162.00 1 2\n", TimeError, "no clock time of the form"
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_open_is_refused(name: str) -> None:
    text, error, words = REFUSED[name]
    with pytest.raises(error) as caught:
        read(text)
    assert words in caught.value.what


def test_a_second_segment_that_starts_anew_is_left_to_the_check_of_time() -> None:
    log = read(LVM_HEAD + LVM_SEGMENT + "".join(TAB) + LVM_SEGMENT + "".join(TAB))
    assert log.channels[0].time.size == 2 * COUNT
    assert (np.diff(log.channels[0].time) < 0.0).sum() == 1


@pytest.mark.parametrize("cells", [1, 30, 40])
def test_columns_that_do_not_fit_at_once_are_read_in_passes(
    cells: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    pairs = "t1;EngTrq;t2;nAb\ns;Nm;s;rpm\n" + "".join(
        f"{STEP * k:.2f};{1000 + k}.5;{STEP * k:.2f};{700 - k}.25\n" for k in range(COUNT)
    )
    monkeypatch.setattr("drivetwin.logs.formats.csv._MOST_CELLS", cells)
    for text in (PLAIN, HEADS["labview segments"], pairs):
        check(read(text))


def test_cells_that_hold_no_sample_are_told_of() -> None:
    a, _ = read("Time [s],a [Nm],b [bar]\n0,1,1\n1,-,2\n2,3,3\n").channels
    assert a.notes == ("1 cells hold '-' for no sample",)

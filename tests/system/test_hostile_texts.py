# SPDX-License-Identifier: MIT
"""Hostile texts through every output: terminal, JSON, C, FMU, parameters, Modelica, HTML, CSV."""

from __future__ import annotations

import csv
import json
import re
import unicodedata
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.cli import main
from drivetwin.cli.output import print_blocks, print_json
from drivetwin.export.c import write_c
from drivetwin.export.entries import Subject
from drivetwin.export.modelica.model import write_modelica
from drivetwin.export.parameters.content import ParameterSet, Scalar
from drivetwin.export.parameters.files import ParameterFormat, read_parameters, write_parameters
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.read import read_raw
from drivetwin.logs.write import write_log
from drivetwin.report.blocks import FigureBlock, NotesBlock, Page, Section, make_table
from drivetwin.report.figure import Figure
from drivetwin.report.html import render_page
from tests.export.cases import paper_subject

HOSTILE = {
    "clear screen": "\x1b[2J\x1b[H",
    "colour": "\x1b[31merror\x1b[0m",
    "title of window": "\x1b]0;owned\x07",
    "link": "\x1b]8;;http://evil\x1b\\click\x1b]8;;\x1b\\",
    "clipboard": "\x1b]52;c;ZXZpbA==\x07",
    "C1 CSI": "\x9b2J",
    "C1 OSC": "\x9d0;owned\x9c",
    "DCS": "\x1bP+q544e\x1b\\",
    "backspaces": "evil\b\b\b\bgood",
    "carriage return": "evil\rgood",
    "line feed": "a\nerror: forged",
    "vertical": "a\x0b\x0cb",
    "NUL": "a\0b",
    "DEL": "a\x7fb",
    "bidi override": "gpj.\u202eexe",
    "bidi isolate": "\u2066a\u2069",
    "marks": "a\u200e\u200f\u061cb",
    "zero width": "P\u200b0\u200d\ufeff",
    "separators": "a\u2028b\u2029c",
    "tags": "a\U000e0041\U000e007f",
    "surrogate": "log\udcff",
    "comment end C": "*/ int main; /*",
    "overlapping comment": "*//*/ **/ /*/",
    "trigraph": "??/\n??)",
    "comment end XML": "--->",
    "many hyphens": "-----> <!--",
    "CDATA": "]]><![CDATA[",
    "entity": "&lt;&#27;&evil;",
    "markup": "<script>alert(1)</script>",
    "attribute": '" onmouseover="alert(1)',
    "template": "{{ 7*7 }}{% raw %}",
    "rich markup": "[bold red]x[/] [link=http://evil]y[/link] :smile:",
    "format": "%s%n{0}",
    "path": "../../etc/passwd",
    "device": "CON.csv\\\\.\\pipe",
    "homograph": "оutput_tоrque",
    "formula": "=cmd|' /C calc'!A0",
    "dots": "...",
    "long": "x" * 10_000,
    "long escapes": "\x1b[7m" * 2_500,
    "empty": "",
    "blank": " ",
}  # fmt: skip
BAD = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})

hostile = pytest.mark.parametrize("text", HOSTILE.values(), ids=list(HOSTILE))


def find_hidden(output: str) -> set[str]:
    """Return characters without a glyph, other than line end and tab."""
    return {one for one in output if unicodedata.category(one) in BAD and one not in "\n\t"}


@hostile
def test_terminal(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    print_blocks([make_table(text, (text,), [(text,)]), NotesBlock(text, [text])])
    printed = capsys.readouterr()
    assert not find_hidden(printed.out + printed.err)


@hostile
def test_json(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    print_json({text: [text]})
    printed = capsys.readouterr().out
    assert not find_hidden(printed)
    assert json.loads(printed) == {text: [text]}


@hostile
def test_usage_errors(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in ([text], ["inspect", "a", text], ["inspect", f"--x{text}"], ["fleet", text],
                      ["simulate", "a", "--input", text], ["inspect", f"{text}.csv"]):  # fmt: skip
        main(arguments)
        printed = capsys.readouterr()
        assert not find_hidden(printed.out + printed.err), arguments


def make_subject(text: str) -> Subject:
    """A model whose names and remarks are the text."""
    subject = paper_subject()
    first, second = subject.model.elements
    elements = (replace(first, name=f"{text}1"), replace(second, name=f"{text}2"))
    model = replace(subject.model, elements=elements)
    start = replace(subject.start, locked=(f"{text}1",))
    return Subject(name=text, model=model, start=start, note=text)


@hostile
def test_c_source(text: str, tmp_path: Path) -> None:
    write_c(make_subject(text), tmp_path)
    source = (tmp_path / "dt_twin.c").read_text()
    assert not find_hidden(source)
    comments = re.findall(r"/\*.*?\*/", source, re.DOTALL)
    assert comments[1].count("/*") == comments[1].count("*/") == 1
    assert comments[1].endswith("written by drivetwin. */")


@hostile
@pytest.mark.parametrize("kind", ParameterFormat)
def test_parameter_files(text: str, kind: ParameterFormat, tmp_path: Path) -> None:
    numbers = (Scalar(f"{text}.k", -1.5, "N*m", text), Scalar("c", 2.0, "1", text))
    path = tmp_path / f"file.{kind}"
    write_parameters(ParameterSet(text, numbers, (), (text, text)), path, kind)
    document = path.read_text(encoding="utf-8")
    assert not find_hidden(document)
    assert [one.value for one in read_parameters(path, kind).scalars] == [-1.5, 2.0]
    if kind is ParameterFormat.CSV:
        for cell in (one for row in csv.reader(document.splitlines()) for one in row):
            assert cell[:1] not in ("=", "+", "@")
            assert cell[:1] != "-" or cell in ("-1.5", "-")


@pytest.mark.parametrize("name", ["=torque", "@torque", "+a", "-a", "=a,b", "'=x", "-"])
def test_names_of_channels_read_back_from_csv(name: str, tmp_path: Path) -> None:
    time = np.arange(20) / 10.0
    path = tmp_path / "log.csv"
    write_log(path, [RawChannel(name, "-", time, np.sin(time) - 0.5)])
    lines = path.read_text().splitlines()
    assert not any(
        cell[:1] in ("=", "+", "-", "@") for row in csv.reader(lines[:2]) for cell in row
    )
    assert name in [one.name for one in read_raw(path).channels]


@hostile
def test_modelica(text: str, tmp_path: Path) -> None:
    path = tmp_path / "Model.mo"
    write_modelica(make_subject(text), None, path)
    source = path.read_text(encoding="utf-8")
    assert not find_hidden(source)
    plain = re.sub(r'"(?:[^"\\]|\\.)*"', "", source)  # without strings and their escapes
    assert plain.isascii()
    assert '"' not in plain


@hostile
def test_html(text: str) -> None:
    figure = Figure(layout={"title": {"text": text}})
    blocks = (
        NotesBlock(text, (text,)),
        make_table(text, (text,), [(text,)]),
        FigureBlock(figure, text),
    )
    page = render_page(
        Page(text, text, [Section("anchor", text, text, blocks)]), library="plotly.js"
    )
    assert not find_hidden(page)
    assert "<script>alert" not in page
    for document in re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', page):
        assert not find_hidden(json.dumps(json.loads(document), ensure_ascii=False))

# SPDX-License-Identifier: MIT
"""The C sources as a user gets them: strict compilers, no mutable data, sanitizers, the runner."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from drivetwin.errors import InputError
from drivetwin.export.c import write_c
from drivetwin.export.entries import InputDelays
from drivetwin.simulation.dual_clutch import FrictionTable
from tests.export.cases import (
    CASES,
    Case,
    paper_subject,
    write_source,
)

STRICT = (
    *("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror"),
    *("-Wshadow", "-Wdouble-promotion"),
)
SANITIZERS = ("-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
CORTEX_M = ("-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard")


@pytest.fixture
def sources(tmp_path: Path) -> list[Path]:
    """Paths of the C files of the paper's driveline."""
    return [path for path in write_c(paper_subject(), tmp_path) if path.suffix == ".c"]


def compiler(name: str) -> str:
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"{name} is not installed")
    return found


def call(*command: str | Path, text: str | None = None) -> str:
    done = subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, input=text, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


def table(case: Case) -> str:
    """Inputs of a case as the runner reads them."""
    rows = np.column_stack((case.time, case.inputs)).tolist()
    return "time,torque,off,on\n" + "\n".join(",".join(map(repr, row)) for row in rows)


@pytest.mark.parametrize("real", ["double", "float"])
def test_compiles_without_a_warning(sources: list[Path], tmp_path: Path, real: str) -> None:
    define = ["-DDT_FLOAT"] if real == "float" else []
    call(compiler("gcc"), *STRICT, *define, *sources, "-lm", "-o", tmp_path / "run")


def test_compiles_for_a_microcontroller_without_mutable_data(
    sources: list[Path], tmp_path: Path
) -> None:
    gcc = compiler("arm-none-eabi-gcc")
    size = compiler("arm-none-eabi-size")
    for source in sources:
        if source.name == "dt_run.c":
            continue
        target = tmp_path / f"{source.stem}.o"
        call(gcc, *CORTEX_M, *STRICT, "-O2", "-DDT_FLOAT", "-c", source, "-o", target)
        data, bss = call(size, target).splitlines()[1].split()[1:3]
        assert (source.name, data, bss) == (source.name, "0", "0")


def test_neither_heap_nor_recursion_nor_library_beyond_math(
    sources: list[Path], tmp_path: Path
) -> None:
    nm = compiler("nm")
    for source in sources:
        if source.name == "dt_run.c":
            continue
        target = tmp_path / f"{source.stem}.o"
        call(compiler("gcc"), "-std=c99", "-O2", "-fno-builtin", "-c", source, "-o", target)
        wanted = set(re.findall(r"^ +U (\w+)$", call(nm, target), re.M))
        foreign = {name for name in wanted if not name.startswith("dt_")}
        assert foreign <= {"exp", "pow", "sqrt", "fabs", "memcpy", "memset"}, source.name


@pytest.mark.parametrize("delays", [InputDelays(), InputDelays(-0.2, 0.02, as_logged=True)])
def test_runner_is_clean_under_sanitizers_and_within_the_reference(
    tmp_path: Path, delays: InputDelays
) -> None:
    case = CASES["tie_up"]()
    subject = replace(case.subject, delays=delays)
    sources = [path for path in write_c(subject, tmp_path) if path.suffix == ".c"]
    program = tmp_path / "run"
    call(compiler("gcc"), "-std=c99", *SANITIZERS, *sources, "-lm", "-o", program)
    for arguments in ([], ["hold"]):
        rows = call(program, *arguments, text=table(case)).splitlines()
        reported = np.genfromtxt(rows, delimiter=",", names=True)
        assert reported.size == case.time.size
        deviation = case.deviation(reported["output_torque"])
        assert (deviation < 1e-3) == (not arguments and not delays.as_logged)


@pytest.mark.parametrize(
    ("row", "code", "reported"),
    [("0.01,100,8e5", 6, "no row of four numbers"), ("0.01,nan,0,0", 2, "out of range after 0 s")],
)
def test_runner_tells_a_row_that_it_cannot_take(
    sources: list[Path], tmp_path: Path, row: str, code: int, reported: str
) -> None:
    program = tmp_path / "run"
    call(compiler("gcc"), "-std=c99", *sources, "-lm", "-o", program)
    text = f"time,torque,off,on\n\n0,100,8e5,0\n{row}\n0.02,100,8e5,0\n"
    done = subprocess.run([program], input=text, capture_output=True, text=True, check=False)
    assert done.returncode == code
    assert reported in done.stderr
    assert len(done.stdout.splitlines()) == 2


def test_what_c_cannot_hold_is_refused() -> None:
    subject = paper_subject()
    off, on = subject.model.elements
    slip = tuple(float(i) for i in range(65))
    long = replace(on, friction=FrictionTable(slip, (0.1,) * 65))
    with pytest.raises(InputError, match="friction table of B3 has 65 points"):
        write_source(replace(subject, model=replace(subject.model, elements=(off, long))))
    three = replace(subject.model, elements=(off, on, on))
    with pytest.raises(InputError, match="3 shift elements"):
        write_source(replace(subject, model=three))
    with pytest.raises(InputError, match="not a finite number: k_o"):
        write_source(replace(subject, model=replace(subject.model, k_o=float("nan"))))


def test_what_the_model_would_refuse_at_its_begin_is_refused() -> None:
    subject = paper_subject()
    for reported, model in (
        ("k_o = -1 N", replace(subject.model, k_o=-1.0)),
        ("eta = 85 1", replace(subject.model, eta=85.0)),
        ("J_out = 0 kg", replace(subject.model, J_out=0.0)),
        ("i_f = 0 1", replace(subject.model, i_f=0.0)),
    ):
        with pytest.raises(InputError, match=f"{reported}.* is impossible"):
            write_source(replace(subject, model=model))


@given(st.text(max_size=30).filter(lambda text: text.isprintable()))
@example("/*")
@example("*/*")
def test_any_name_of_a_twin_leaves_the_source_whole(text: str) -> None:
    source = write_source(replace(paper_subject(), name=text, note=text))
    assert source.count("/*") == source.count("*/")
    assert "#include" in source.splitlines()[3]

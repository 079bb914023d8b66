# SPDX-License-Identifier: MIT
"""Instructions of one run: a figure that does not depend on the load of the machine."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np

from benchmarks.speed import c_peer
from benchmarks.speed.core import Example
from tests.support.upshift.scenario import Scenario
from tests.support.upshift.statement import SAMPLES, STEP, Inputs, Problem, start

_TARGET = "haswell"
"""Instruction set of both counts: valgrind knows instructions up to AVX2."""
_DRIVER = """
#include <stdio.h>
int shift_sim(const double*, const double*, const double*, int, double, int, double*, double*, int);
static double numbers[{numbers}], out[4*{samples}], events[64];
int main(int count, char **names) {{
    FILE *file = count == 2 ? fopen(names[1], "rb") : 0;
    if (!file || fread(numbers, sizeof(double), {numbers}, file) != {numbers}) return 1;
    shift_sim(numbers, numbers + {first}, numbers + {inputs}, {steps}, {step}, 1, out, events, 64);
    return 0;
}}
"""


def measure_instructions(
    of: Problem, given: Inputs, example: Example, stated: Scenario, folder: Path
) -> dict[str, int]:
    """Return the instructions of one shift by program.

    There are none where valgrind is missing, or knows not all instructions of the build.
    """
    ours = [str(example.path), str(example.store("counted", stated)), "0"]
    try:
        found = {"drivetwin": count_instructions(ours, "*Plan*run_again", folder)}
    except (FileNotFoundError, subprocess.CalledProcessError):
        return {}
    if c_peer.SOURCE.exists():
        driver = _build_driver(of, given, folder)
        found[c_peer.PROGRAM] = count_instructions(driver, "shift_sim", folder)
    return found


def count_instructions(command: list[str], function: str, folder: Path) -> int:
    """Count instructions within a function of exactly this name and within its callees.

    A closure that also matches the pattern would end the count when it is entered.
    """
    out = folder / "callgrind.out"
    tool = ["valgrind", "--tool=callgrind", f"--toggle-collect={function}"]
    subprocess.run(
        [*tool, f"--callgrind-out-file={out}", *command], check=True, capture_output=True
    )
    lines = out.read_text("utf-8", errors="replace").splitlines()
    return int(next(line for line in lines if line.startswith(("totals:", "summary:"))).split()[1])


def _build_driver(of: Problem, given: Inputs, folder: Path) -> list[str]:
    """Build a program that runs the C peer once; return its command."""
    parts = [
        c_peer.list_parameters(of),
        np.array(start(of, given)),
        c_peer.stack_samples(given).ravel(),
    ]
    numbers = np.concatenate(parts)
    data, source, program = (folder / name for name in ("numbers", "driver.c", "driver"))
    data.write_bytes(numbers.tobytes())
    text = _DRIVER.format(
        numbers=numbers.size,
        samples=SAMPLES,
        first=parts[0].size,
        inputs=parts[0].size + parts[1].size,
        steps=SAMPLES - 1,
        step=STEP,
    )
    source.write_text(text, encoding="ascii")
    flags = ["-O3", f"-march={_TARGET}", str(source), str(c_peer.SOURCE), "-o", str(program), "-lm"]
    subprocess.run(["gcc", *flags], check=True, capture_output=True)
    return [str(program), str(data)]

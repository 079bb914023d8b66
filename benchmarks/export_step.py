# SPDX-License-Identifier: MIT
"""Cost of the exported C and of the core: time on this machine, instructions on a Cortex-M4F.

`python -m benchmarks.export_step` runs the upshift of `reference/dual_clutch_upshift` and writes
`docs/export-cost.md`. Without the ARM compiler and emulator a note replaces those rows.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import timeit
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drivetwin.export.c import write_c
from drivetwin.export.compiler import find_native_compiler
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import Accuracy, Signal
from tests.export.cases import CASES, Case

ROOT = Path(__file__).resolve().parents[1]
HERE = Path(__file__).resolve().parent / "export"
PAGE = ROOT / "docs" / "export-cost.md"
STEPS = (1, 10)
"""Steps measured [ms]."""
CLOCK = 168e6
CYCLES_PER_INSTRUCTION = 1.5
"""A Cortex-M4F at 168 MHz; cycles an instruction takes on it, loads and divisions included."""
REPEATS = 7
_CORTEX_M = (
    *("-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"),
    *("--specs=rdimon.specs", "-nostartfiles", "-T", str(HERE / "cortex_m.ld")),
)
_EMULATOR = (
    *("qemu-system-arm", "-machine", "mps2-an386", "-nographic", "-icount", "shift=0"),
    *("-semihosting-config", "enable=on,target=native", "-kernel"),
)


@dataclass(frozen=True)
class Cost:
    """Mean and largest cost of a call: ns on this machine, instructions on the Cortex-M."""

    mean: float
    largest: float


def read_costs(output: str) -> dict[str, Cost]:
    """Parse the output of `time_steps.c`, by name."""
    rows = (line.split() for line in output.splitlines())
    return {name: Cost(float(mean), float(most)) for name, mean, most in rows}


def build_program(folder: Path, case: Case, step: int, compiler: tuple[str, ...]) -> Path:
    """Build `time_steps.c` with the model of a case and every `step`-th of its inputs."""
    sources = [p for p in write_c(case.subject, folder) if p.suffix == ".c"]
    rows = case.inputs[::step].tolist()
    listed = ",\n".join("{" + ", ".join(f"DT_C({value!r})" for value in row) + "}" for row in rows)
    (folder / "inputs.h").write_text(
        f"#define INPUT_STEP DT_C({step * 1e-3!r})\n#define INPUT_ROWS {len(rows)}\n"
        f"static const dt_real input_rows[INPUT_ROWS][3] = {{\n{listed}\n}};\n",
        encoding="utf-8",
    )
    own = [HERE / "time_steps.c"]
    if "-mthumb" in compiler:
        own.append(HERE / "cortex_m.c")
    target = folder / "program"
    model = [str(path) for path in sources if path.name != "dt_run.c"]
    command = [*compiler, "-std=gnu99", "-O2", f"-I{folder}", *model, *map(str, own)]
    subprocess.run([*command, "-lm", "-o", str(target)], check=True, stderr=subprocess.DEVNULL)
    return target


def measure_here(case: Case, step: int, defines: tuple[str, ...]) -> dict[str, Cost]:
    """Return the smallest means of several runs [ns]."""
    with tempfile.TemporaryDirectory() as folder:
        path = build_program(Path(folder), case, step, (*find_native_compiler(), *defines))
        runs = [
            read_costs(subprocess.run([path], capture_output=True, text=True, check=True).stdout)
            for _ in range(REPEATS)
        ]
    return {name: min((run[name] for run in runs), key=lambda cost: cost.mean) for name in runs[0]}


def count_on_cortex_m(case: Case, step: int, defines: tuple[str, ...]) -> dict[str, Cost] | None:
    """Count instructions; None without the tools."""
    if not (shutil.which("arm-none-eabi-gcc") and shutil.which("qemu-system-arm")):
        return None
    with tempfile.TemporaryDirectory() as folder:
        compiler = ("arm-none-eabi-gcc", *_CORTEX_M, *defines)
        path = build_program(Path(folder), case, step, compiler)
        done = subprocess.run(
            [*_EMULATOR, str(path)], capture_output=True, text=True, check=True, timeout=120
        )
    return read_costs(done.stdout)


def measure_core(case: Case, step: int, accuracy: Accuracy) -> float:
    """Return the time of the core per step [ns], with the call from Python."""
    time_grid, inputs = case.time[::step], case.inputs[::step]
    torque, off, on = (Signal(time_grid, np.ascontiguousarray(column)) for column in inputs.T)
    subject = case.subject

    def run() -> None:
        pressures = {"B2": off, "B3": on}
        simulate(subject.model, torque, pressures, subject.start, time_grid, accuracy=accuracy)

    return 1e9 * min(timeit.repeat(run, number=1, repeat=5 * REPEATS)) / (len(time_grid) - 1)


def format_page(case: Case) -> str:
    """Measure everything and return the document."""
    host, arm = [], []
    for step in STEPS:
        for name, accuracy in (("exact", Accuracy(exact=True)), ("default", Accuracy())):
            spent = measure_core(case, step, accuracy)
            host.append(f"| {step} ms | core, {name} | {spent / 1e3:.2f} µs | |")
        for real, defines in (("double", ()), ("float", ("-DDT_FLOAT",))):
            measured = measure_here(case, step, defines)
            for name, label in (("step", "model"), ("observer", "observer")):
                cost = measured[name]
                host.append(
                    f"| {step} ms | C {label}, {real} | {cost.mean / 1e3:.2f} µs "
                    f"| {cost.largest / 1e3:.1f} µs |"
                )
        counted = count_on_cortex_m(case, step, ("-DDT_FLOAT",))
        for name, label in (("step", "model"), ("observer", "observer")):
            if counted is not None:
                arm.append(_format_arm(step, label, counted[name]))
    if not arm:
        arm = ["| | not measured: arm-none-eabi-gcc or qemu-system-arm is missing | | | |"]
    return _TEXT.format(host="\n".join(host), arm="\n".join(arm))


def _format_arm(step: int, label: str, cost: Cost) -> str:
    seconds = cost.largest * CYCLES_PER_INSTRUCTION / CLOCK
    return (
        f"| {step} ms | {label} | {cost.mean:,.0f} | {cost.largest:,.0f} "
        f"| {1e3 * seconds:.2f} ms, {100.0 * seconds / (step * 1e-3):.0f} % |"
    )


_TEXT = """# What the exported C costs

Written by `benchmarks/export_step.py`. One upshift, `reference/dual_clutch_upshift`, with inputs
linear between points 1 ms or 10 ms apart, 10 ms being the task of a usual transmission controller.

## On a PC

Smallest mean of several runs, one thread, `-O2`; the largest single call of that run holds what
the operating system took as well. The core's time has the call from Python in it, spread over the
steps.

| step | | mean of a call | largest |
|---|---|---|---|
{host}

## On a Cortex-M4F

Single precision, `-O2`, instructions counted by QEMU (`-icount`). The last column takes 1.5 cycles
an instruction at 168 MHz: the largest call, and its share of the task.

| step | | mean, instructions | largest | largest, of the task |
|---|---|---|---|---|
{arm}

What no input can exceed is stated in `dt_model.h`.
"""


def main() -> None:
    """Measure and write the page."""
    text = format_page(CASES["dual_clutch_upshift"]())
    PAGE.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: MIT
"""Times and memory that have a stated limit; exits with 1 if one is exceeded.

`python -m benchmarks.limits [NAME...]` measures all of them, or those named: `help` is the wall
time of `drivetwin --help`; `identify` the CPU time of an identification of a log that is loaded;
`slider` the server time of one move of a slider in the workbench, from the start state to the JSON
of the changed curves; `mdf` the memory for eight channels in a window of a large MDF 4 file.
`mdf=GIGABYTES` sets the size of that file; the stated limit is for 2 GB, the default is 0.3 GB,
because writing takes longer than reading. Imports wait until they are needed, so that the process
that reads holds nothing else.
"""

from __future__ import annotations

import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
import timeit
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # before NumPy reads it: one core is measured

import numpy as np

from drivetwin.logs.formats.detect import open_recording
from drivetwin.logs.formats.guarded import trust_parsers

CHANNELS, BLOCK, STEP = 58, 200_000, 1e-3
RECORD = 8 + 4 * CHANNELS
WANTED, WINDOW = range(3, 11), (100.0, 120.0)


@dataclass(frozen=True)
class Figure:
    """A measured value with its limit, both in `unit`."""

    text: str
    value: float
    limit: float
    unit: str

    def __str__(self) -> str:
        return f"{self.text}: {self.value:.3g} {self.unit}, limit {self.limit:g} {self.unit}"


def measure_help(_argument: str) -> Iterator[Figure]:
    """Measure the median wall time of `drivetwin --help`, import included."""
    command = [sys.executable, "-m", "drivetwin", "--help"]

    def call() -> None:
        subprocess.run(command, check=True, capture_output=True)

    median = statistics.median(timeit.repeat(call, number=1, repeat=11))
    yield Figure("drivetwin --help", median, 0.3, "s")


def measure_identify(_argument: str) -> Iterator[Figure]:
    """Measure identifications of a synthetic 6.6 s log at 1 kHz, by method.

    The least of several times is taken: other work on the machine only adds to them.
    """
    from drivetwin.cli.synth import write_run
    from drivetwin.dyno.dyno import run
    from drivetwin.dyno.scenario_file import load_scenario
    from drivetwin.estimation.result.method import Method
    from drivetwin.logs.read import read_log
    from drivetwin.pipeline import identify
    from drivetwin.shifts.detect import detect_shifts
    from drivetwin.vehicle.card import load_card

    with tempfile.TemporaryDirectory() as folder:
        log, card, _ = write_run(
            Path(folder) / "steps.csv", run(load_scenario("throttle_steps"), seed=1)
        )
        vehicle = load_card(card)
        recording = read_log(log, vehicle)
    found = detect_shifts(recording, vehicle)
    for method, limit in ((Method.LIKELIHOOD, 2.0), (Method.PAPER, 0.05)):
        times = []
        for _ in range(3):
            start = time.process_time()
            identify(recording, vehicle, found, method)
            times.append(time.process_time() - start)
        yield Figure(f"CPU time of an identification, {method}", min(times), limit, "s")


def measure_slider(_argument: str) -> Iterator[Figure]:
    """Measure the median of several moves over the paper's synthetic shift."""
    from dash import Patch
    from plotly.io.json import to_json_plotly

    from drivetwin.cli.synth import write_run
    from drivetwin.dyno.dyno import run
    from drivetwin.dyno.scenario_file import load_scenario
    from drivetwin.workbench.session import Sessions
    from drivetwin.workbench.workspace import Folder

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log, card, _ = write_run(folder / "bench.csv", run(load_scenario("paper_steps"), seed=1))
        sessions = Sessions(Folder.from_path(folder))
        session = sessions.get(sessions.create())
        session.open(session.get_folder_source(log.name), session.get_folder_source(card.name))
        session.identify(is_quick=True)
        while session.job is not None:
            session.collect_job_results()
            time.sleep(0.05)
        stiffness = iter(range(140_000, 200_000, 1000))

        def slide_once() -> None:
            patch = Patch()
            for place, change in session.apply_sliders({"k_o": float(next(stiffness))}).items():
                patch["data"][place]["x"], patch["data"][place]["y"] = change["x"], change["y"]
            to_json_plotly(patch)

        median = statistics.median(timeit.repeat(slide_once, number=1, repeat=30))
        yield Figure("move of a slider", 1e3 * median, 100.0, "ms")
        sessions.close()


def measure_mdf(gigabytes: str) -> Iterator[Figure]:
    """Measure the memory of a process that reads a window of a large file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.mf4"
        _write_mdf(path, float(gigabytes or 0.3))
        size = path.stat().st_size / 1e9
        command = [sys.executable, "-m", "benchmarks.limits", "--read", str(path)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    text = f"memory for a window of a {size:.2f} GB file"
    yield Figure(text, float(done.stdout) / 1e6, 500.0, "MB")


def _write_mdf(path: Path, gigabytes: float) -> None:
    """Write a file of 58 channels at 1 kHz, block by block."""
    import asammdf

    with asammdf.MDF(version="4.10") as mdf:
        for block in range(max(1, round(gigabytes * 1e9 / (BLOCK * RECORD)))):
            stamps = (block * BLOCK + np.arange(BLOCK)) * STEP
            values = [np.sin(stamps + k).astype(np.float32) for k in range(CHANNELS)]
            if block:
                mdf.extend(0, [(stamps, None), *((each, None) for each in values)])
                continue
            mdf.append(
                [
                    asammdf.Signal(samples=each, timestamps=stamps, name=f"ch{k}", unit="Nm")
                    for k, each in enumerate(values)
                ]
            )
        mdf.save(path, overwrite=True)


def _read_mdf(path: Path) -> None:
    """Read channels in a window and print the largest memory of this process in bytes."""
    trust_parsers()  # else it is a child that reads
    with open_recording(path) as recording:
        for index in WANTED:
            recording.load(index, WINDOW)
    # The largest memory in the resource usage of a child includes that of its parent.
    (kilobytes,) = re.findall(r"VmHWM:\s*(\d+) kB", Path("/proc/self/status").read_text("utf-8"))
    print(1024 * int(kilobytes))


MEASURES: dict[str, Callable[[str], Iterator[Figure]]] = {
    "help": measure_help,
    "identify": measure_identify,
    "slider": measure_slider,
    "mdf": measure_mdf,
}


def main() -> int:
    """Print the figures with their limits."""
    if sys.argv[1:2] == ["--read"]:
        _read_mdf(Path(sys.argv[2]))
        return 0
    exceeded = False
    for asked in sys.argv[1:] or MEASURES:
        name, _, argument = asked.partition("=")
        for figure in MEASURES[name](argument):
            print(figure, flush=True)
            exceeded |= figure.value > figure.limit
    return int(exceeded)


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: MIT
"""CPU time and peak memory of whole commands, beside other programs in the same run.

`python -m benchmarks.pipeline [--large]` writes benchmarks/results/pipeline.json with a profile of
each command that misses its limit; `python -m tools.results_page` builds
docs/benchmarks-pipeline.md from it. Each command is a process of its own on one BLAS thread.
`--large` adds the CSV log of one hour and the MDF file of 0.3 GB. The other programs are pandas
(its process, imports included), and a fit by SciPy's least squares with a simulator in C
(`peers/run_identify.py` of the shared data, where that is at hand).
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from benchmarks.code_version import ROOT
from benchmarks.large_logs import write_large_csv, write_large_mdf
from benchmarks.pipeline_profile import PROFILE_MARK
from benchmarks.raw_results import write_results
from benchmarks.whole_drives import DRIVES, write_drive

SHARED = ROOT.parent / "shared"
REPEATS, TURNS = 3, 5
"""Runs of each command, and of each of two programs in turns; the shortest counts."""
CLOCK = (
    "CPU time of the whole process, imports included, unless a row says otherwise; the "
    f"shortest run. A command and its other program take {TURNS} turns."
)

_FIT = """
import sys, time
from pathlib import Path
from drivetwin.estimation.result.method import Method
from drivetwin.logs.read import read_log
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import require_shifts
from drivetwin.vehicle.card import load_card
card = load_card(Path(sys.argv[2]))
log = read_log(Path(sys.argv[1]), card)
shifts = require_shifts(log, card)
start = time.process_time()
identify(log, card, shifts, Method.LIKELIHOOD)
print(time.process_time() - start)
"""
_PANDAS = """
import sys, time
import pandas
pandas.read_csv(sys.argv[1])
print(time.process_time())
"""


@dataclass(frozen=True)
class Measurement:
    """CPU time [s] and peak memory [GB] of a command, the limit of the time and that of the ratio.

    `peer` is the time [s] of the other program that does the same; None where there is none.
    `profile` is that of a command which misses a limit.
    """

    name: str
    seconds: float
    memory: float
    limit: float
    peer: float | None = None
    ratio_limit: float | None = None
    profile: str = ""

    @property
    def is_met(self) -> bool:
        """True where both limits hold."""
        if self.seconds > self.limit:
            return False
        if self.peer is None or self.ratio_limit is None:
            return True
        return self.seconds <= self.ratio_limit * self.peer


def run_process(
    command: Sequence[str], variables: Mapping[str, str] | None = None
) -> tuple[float, float, str]:
    """Run a command; return its CPU time [s], peak memory [GB] and output.

    `variables` are added to the environment.

    Raises CalledProcessError where it fails.
    """
    alone = {
        **os.environ,
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONPATH": f"{ROOT / 'python'}{os.pathsep}{ROOT}",
        **(variables or {}),
    }
    alone.pop("PYTHONDONTWRITEBYTECODE", None)  # an installed package is compiled
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(command, stdout=output, env=alone)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            raise subprocess.CalledProcessError(process.returncode, command)
        output.seek(0)
        text = output.read().decode()
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e6, text


def measure_command(
    name: str,
    arguments: Sequence[str],
    limit: float,
    peer: Callable[[], float] | None = None,
    ratio_limit: float | None = None,
) -> Measurement:
    """Measure `drivetwin` with these arguments; profile it where it misses a limit.

    `peer` runs the other program once and returns its time [s].
    """
    command = [sys.executable, "-m", "drivetwin", *arguments]
    runs, others = [], []
    for _ in range(TURNS if peer else REPEATS):
        others += [peer()] if peer else []
        runs.append(run_process(command)[:2])
    measured = Measurement(name, *min(runs), limit, min(others, default=None), ratio_limit)
    if measured.is_met:
        return measured
    command[2] = "benchmarks.pipeline_profile"
    return replace(measured, profile=run_process(command)[2].partition(PROFILE_MARK)[2])


def measure_completion() -> Measurement:
    """Measure the completion of an option at the shell."""
    line = "drivetwin identify --veh"
    asked = {"_DRIVETWIN_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": "2"}
    command = [sys.executable, "-m", "drivetwin"]
    taken = min(run_process(command, asked)[:2] for _ in range(REPEATS))
    return Measurement("completion at the shell", *taken, 0.2)


def measure_script(script: str, *arguments: str) -> tuple[float, float]:
    """Return the least time [s] that a script prints, and its memory [GB]."""
    runs = [run_process([sys.executable, "-c", script, *arguments]) for _ in range(REPEATS)]
    return min((float(text.split()[-1]), memory) for _, memory, text in runs)


def measure_peer_fit() -> float:
    """Return the CPU time [s] of the fit of `run_identify.py`."""
    script = str(SHARED / "peers" / "run_identify.py")
    return float(run_process([sys.executable, script])[2].split()[1])


def measure_paper_log(folder: Path) -> Iterator[Measurement]:
    """Measure the commands on `paper_like.csv`."""
    log = str(SHARED / "logs" / "paper_like.csv")
    card = str(ROOT / "examples" / "vehicles" / "paper_like.toml")
    out = str(folder / "out")
    identify = ("identify", log, "--vehicle", card, "-o", out)
    yield measure_command("`--help`", ["--help"], 0.15)
    yield measure_completion()
    whole = measure_command("`identify`", identify, 2.5, measure_peer_fit, 8.0)
    yield whole
    peer = whole.peer or 0.0
    fit = measure_script(_FIT, log, card)
    yield Measurement("fit with intervals alone", *fit, 3.0 * peer, peer, 3.0)
    yield measure_command("`identify --method paper`", [*identify, "--method", "paper"], 1.3)


def measure_drives(folder: Path) -> Iterator[Measurement]:
    """Measure `shifts` on whole drives and, where it is at hand, on a truck's log."""
    for drive in DRIVES:
        log, card = write_drive(drive, folder)
        command = ["shifts", str(log), "--vehicle", str(card)]
        yield measure_command(f"`shifts`, {drive.name}", command, drive.limit)
    truck = SHARED / "j1939" / "trucksentry_normal.log"
    if truck.is_file():
        card = ROOT / "examples" / "vehicles" / "j1939_class6.toml"
        command = ["shifts", str(truck), "--vehicle", str(card)]
        yield measure_command("`shifts`, 30 s of a truck's J1939 bus", command, 2.0)


def measure_large_files(folder: Path) -> Iterator[Measurement]:
    """Measure `inspect` on large files."""
    csv, mf4 = folder / "hour.csv", folder / "large.mf4"
    write_large_csv(csv)

    def parse() -> float:
        return float(run_process([sys.executable, "-c", _PANDAS, str(csv)])[2])

    yield measure_command(
        "`inspect`, CSV of 1 h × 1 kHz × 7", ["inspect", str(csv)], 12.0, parse, 3.5
    )
    csv.unlink()
    write_large_mdf(mf4)
    yield measure_command("`inspect`, MDF 4 of 0.3 GB", ["inspect", str(mf4)], 5.0)


def main() -> int:
    """Measure; return 1 where a limit is missed."""
    parts: list[Callable[[Path], Iterator[Measurement]]] = [measure_drives]
    if SHARED.is_dir():
        parts.insert(0, measure_paper_log)
    if "--large" in sys.argv:
        parts.append(measure_large_files)
    rows: list[Measurement] = []
    with tempfile.TemporaryDirectory() as folder:
        for part in parts:
            for one in part(Path(folder)):
                rows.append(one)
                print(f"{one.name}: {one.seconds:.2f} s", flush=True)
    found = {"commands": [asdict(one) for one in rows]}
    print(write_results("pipeline", found, clock=CLOCK, rounds=REPEATS))
    return 0 if all(one.is_met for one in rows) else 1


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: MIT
"""Compare identifications of synthetic logs with stored results: `make golden`.

Twelve scenarios of the virtual dynamometer and two seeds go through the command line by the paper's
method, by the likelihood and by its quick form, so that moves and renames inside the package leave
the comparison as it is. A number may differ by `RTOL` of the larger of its magnitude and its
standard deviation. `--write` stores the present results; each such change is listed under
"Numerical changes" in the changelog.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).with_name("results.jsonl")
KEYS = Path(__file__).with_name("keys.json")  # key in the stored results -> key today
SCENARIOS = (
    "paper",
    "paper_steps",
    "throttle_steps",
    "gearbox",
    "gearbox_chain",
    "power_on_down",
    "power_off_up",
    "power_off_down",
    "input_gear",
    "dual_clutch",
    "manual",
    "open_converter",
)
METHODS = {"paper": ("--method", "paper"), "quick": ("--quick",), "likelihood": ()}
"""Options by the name in the store."""
SEEDS = (0, 1)
RTOL = 1e-6

Numbers = dict[str, float | str | None]


@dataclass(frozen=True)
class Case:
    """One identification: scenario of the dynamometer, seed of the noise, method."""

    scenario: str
    seed: int
    method: str

    @property
    def name(self) -> str:
        return f"{self.scenario}/{self.seed}/{self.method}"


def run_case(case: Case) -> Numbers:
    """Make the log, identify it through the command line and return the numbers of the result.

    A refused identification is a result as well: its exit code stands under `exit`.
    """
    with tempfile.TemporaryDirectory() as folder:
        log = f"{case.scenario}.csv"
        synth = ("synth", "--scenario", case.scenario, "--seed", str(case.seed), "-o", log)
        _run_drivetwin(folder, *synth)
        card = f"{case.scenario}.card.toml"
        options = ("--vehicle", card, *METHODS[case.method], "-o", "out")
        code = _run_drivetwin(folder, "identify", log, *options)
        path = Path(folder, "out", "result.json")
        if not path.exists():
            return {"exit": float(code)}
        return extract_numbers(json.loads(path.read_text()))


def _run_drivetwin(folder: str, *arguments: str) -> int:
    command = (sys.executable, "-m", "drivetwin", *arguments)
    return subprocess.run(command, cwd=folder, capture_output=True, check=False).returncode


def extract_numbers(result: dict[str, Any]) -> Numbers:
    """Flatten estimates, friction laws, fits and lock-up times of a result file."""
    numbers: Numbers = {}
    for key, estimate in result["parameters"].items():
        numbers[f"{key}.verdict"] = estimate["verdict"]
        for field in ("value", "std_total"):
            if estimate[field] is not None:
                numbers[f"{key}.{field}"] = estimate[field]
    for element, curve in result["friction"].items():
        for field, value in (curve["stribeck"] or {}).items():
            if isinstance(value, float):
                numbers[f"friction.{element}.{field}"] = value
    for signal, fit in result["fit"].items():
        for field, value in fit["all"].items():
            numbers[f"fit.{signal}.{field}"] = value
    for number, shift in enumerate(result["shifts"]):
        if shift["lockup_time"] is not None:
            numbers[f"shifts.{number}.lockup_time"] = shift["lockup_time"]
    return numbers


def compare(stored: Numbers, today: Numbers, keys: dict[str, str]) -> list[str]:
    """List the differences; `keys` maps stored keys to those of today."""
    stored = {keys.get(key, key): value for key, value in stored.items()}
    differences = [f"{key}: only on one side" for key in sorted(stored.keys() ^ today.keys())]
    for key in sorted(stored.keys() & today.keys()):
        old, new = stored[key], today[key]
        if not isinstance(old, float) or not isinstance(new, float):
            close = old == new
        else:
            spread = stored.get(key.removesuffix(".value") + ".std_total", 0.0)
            scale = max(abs(old), spread if isinstance(spread, float) else 0.0)
            close = abs(new - old) <= RTOL * scale
        if not close:
            differences.append(f"{key}: stored {old}, today {new}")
    return differences


def main() -> int:
    """Run all cases; return 1 where a result differs from the stored one."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--write", action="store_true", help="store the present results")
    parser.add_argument("--only", default="", help="cases whose name contains this text")
    parser.add_argument("--jobs", type=int, default=2, help="identifications at a time")
    options = parser.parse_args()
    cases = [Case(*one) for one in product(SCENARIOS, SEEDS, METHODS)]
    cases = [case for case in cases if options.only in case.name]
    with ThreadPoolExecutor(options.jobs) as pool:
        results = dict(zip([case.name for case in cases], pool.map(run_case, cases), strict=True))
    if options.write:
        lines = [json.dumps({"case": name, **numbers}) for name, numbers in results.items()]
        RESULTS.write_text("\n".join(lines) + "\n")
        return 0
    stored = {row.pop("case"): row for row in map(json.loads, RESULTS.read_text().splitlines())}
    keys = json.loads(KEYS.read_text())
    failures = 0
    for name, numbers in results.items():
        differences = compare(stored[name], numbers, keys)
        failures += bool(differences)
        for difference in differences:
            print(f"{name}: {difference}")
    print(f"{len(results) - failures} of {len(results)} results as stored")
    return int(failures > 0)


if __name__ == "__main__":
    sys.exit(main())

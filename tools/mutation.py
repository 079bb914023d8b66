# SPDX-License-Identifier: MIT
"""Mutation tests of eight modules: the share of wrong lines that a test rejects.

`python -m tools.mutation draw` draws mutants by Cosmic Ray's operators into a file, `run` runs the
tests that cover the mutated line until one fails. The covering tests come from a run of the suite
with `-p tests.support.covering`. `table` prints the counts of one or two files of results.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = "python/drivetwin"
FOLDER = ROOT / "out" / "covering"
MODULES = (
    "simulation/network.py",
    "likelihood/gauss_newton.py",
    "likelihood/residual_covariance.py",
    "estimation/result/verdict.py",
    "logs/formats/csv.py",
    "_util/atomic.py",
    "workbench/access_control.py",
    "calibration/certificate.py",
)
COUNT = 40
"""Mutants of a module."""
PER_LINE = 2
"""Mutants of a line, at most."""
CPU_SECONDS = 60
"""CPU time for the tests of a mutant [s]."""
TEST_SECONDS = 40.0
"""Time of the tests chosen for a mutant, as measured without one [s]; the quickest come first."""
SURVIVED, KILLED, TIMEOUT, UNCOVERED = "survived", "killed", "timeout", "uncovered"


@dataclass(frozen=True)
class Mutant:
    """One changed place of a module; `line` is the first changed line, counted from 1."""

    module: str
    operator: str
    occurrence: int
    line: int
    before: str
    after: str


def draw_mutants(seed: int) -> Iterator[Mutant]:
    """Draw the mutants of all modules, those of docstrings and annotations left out."""
    from cosmic_ray.ast import Visitor, get_ast
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator, operator_names

    class Counting(Visitor):  # type: ignore[misc] # untyped library
        def __init__(self, operator: Any) -> None:
            self.operator, self.count = operator, 0

        def visit(self, node: Any) -> Any:
            self.count += len([*self.operator.mutation_positions(node)])
            return node

    names = [one for one in operator_names() if "Variable" not in one]  # these need arguments
    for module in MODULES:
        text = (ROOT / PACKAGE / module).read_text(encoding="utf-8")
        places = []
        for name in names:
            counting = Counting(get_operator(name)())
            counting.walk(get_ast(text))
            places += [(name, place) for place in range(counting.count)]
        chosen = random.Random(f"{seed} {module}")
        chosen.shuffle(places)
        drawn: list[Mutant] = []
        for name, place in places:
            changed = mutate_code(text, get_operator(name)(), place)
            mutant = _describe(module, name, place, text, changed)
            if mutant is not None and [one.line for one in drawn].count(mutant.line) < PER_LINE:
                drawn.append(mutant)
            if len(drawn) == COUNT:
                break
        yield from drawn


def _describe(module: str, name: str, place: int, text: str, changed: str | None) -> Mutant | None:
    """Describe a mutant; None if it is no program, or changes only an annotation (`a | b`)."""
    if changed is None or changed == text or "BitOr" in name:
        return None
    try:
        compile(changed, module, "exec")
    except SyntaxError:  # as `%,` for the star before named arguments
        return None
    old, new = text.splitlines(), changed.splitlines()
    codes = SequenceMatcher(None, old, new, autojunk=False).get_opcodes()
    _, start, end, other, last = next(code for code in codes if code[0] != "equal")
    return Mutant(
        module, name, place, start + 1, "\n".join(old[start:end]), "\n".join(new[other:last])
    )


def read_covering(folder: Path) -> tuple[Counter[str], dict[str, dict[str, set[str]]]]:
    """Read seconds by test, and covering tests by module and line, of all workers."""
    seconds: Counter[str] = Counter()
    lines: dict[str, dict[str, set[str]]] = {module: {} for module in MODULES}
    for path in sorted(folder.glob("*.json")):
        record = json.loads(path.read_text(encoding="utf-8"))
        seconds.update(record["seconds"])
        for module, by_line in record["lines"].items():
            for line, tests in by_line.items():
                lines[module].setdefault(line, set()).update(tests)
    return seconds, lines


def choose_tests(seconds: Counter[str], covering: set[str]) -> list[str]:
    """Choose the quickest tests of a line within the time for a mutant, at least one."""
    chosen: list[str] = []
    spent = 0.0
    for test in sorted(covering, key=lambda one: (seconds[one], one)):
        spent += seconds[test]
        if chosen and spent > TEST_SECONDS:
            break
        chosen.append(test)
    return chosen


def run_mutant(mutant: Mutant, tests: Sequence[str], tree: Path) -> dict[str, Any]:
    """Run tests on a tree with the mutant in it, and restore the tree."""
    path = tree / PACKAGE / mutant.module
    text = path.read_text(encoding="utf-8")
    lines = text.split("\n")
    first, count = mutant.line - 1, len(mutant.before.splitlines())
    if "\n".join(lines[first : first + count]) != mutant.before:
        raise SystemExit(f"{mutant.module}:{mutant.line} is not the line of the mutant")
    lines[first : first + count] = mutant.after.split("\n")
    path.write_text("\n".join(lines), encoding="utf-8")
    environment = os.environ | {
        "PYTHONPATH": str(tree / "python"),
        "PYTHONDONTWRITEBYTECODE": "1",
        "HYPOTHESIS_EXAMPLES": "10",
        "CI": "true",
    }
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-rfE", *tests]
    try:
        done = subprocess.run(
            command, cwd=tree, env=environment, capture_output=True, text=True,
            preexec_fn=_limit, check=False, timeout=20 * CPU_SECONDS,
        )  # fmt: skip
        code, output = done.returncode, done.stdout
    except subprocess.TimeoutExpired:
        code, output = -1, ""
    finally:
        path.write_text(text, encoding="utf-8")
    by = next(
        (
            one.split()[1]
            for one in output.splitlines()
            if one.startswith(("FAILED ", "ERROR tests"))
        ),
        "",
    )
    outcome = SURVIVED if code == 0 else TIMEOUT if code < 0 else KILLED
    return {"outcome": outcome, "by": by, "tests": len(tests)}


def _limit() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS))


def run_all(mutants: Sequence[Mutant], output: Path, workers: int) -> None:
    """Run all mutants that the file of results does not have; each worker has a tree of its own."""
    seconds, lines = read_covering(FOLDER)
    known = {json.dumps(one["mutant"]) for one in _read(output)}
    with tempfile.TemporaryDirectory() as folder, output.open("a", encoding="utf-8") as file:
        trees = [_copy_tree(Path(folder) / "main" / str(one)) for one in range(workers)]
        (Path(folder) / "main" / "shared").symlink_to(ROOT.parent / "shared")

        def run(mutant: Mutant) -> None:
            tests = choose_tests(seconds, lines[mutant.module].get(str(mutant.line), set()))
            tree = trees.pop()
            result = run_mutant(mutant, tests, tree) if tests else {"outcome": UNCOVERED, "by": ""}
            trees.append(tree)
            file.write(json.dumps({"mutant": asdict(mutant)} | result) + "\n")
            file.flush()

        waiting = [one for one in mutants if json.dumps(asdict(one)) not in known]
        with ThreadPoolExecutor(workers) as pool:
            [*pool.map(run, waiting)]


def _copy_tree(target: Path) -> Path:
    """Copy the tracked files and the native module."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True)
    native = (ROOT / PACKAGE).glob("_native*.so")
    names = [*listed.stdout.decode().strip("\0").split("\0")]
    for name in [*names, *(str(one.relative_to(ROOT)) for one in native)]:
        if (ROOT / name).is_file():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target / name)
    return target


def _read(path: Path) -> list[Any]:
    """Read a file of one JSON value a line; none if it is absent."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def print_table(files: Sequence[Path]) -> None:
    """Print the outcomes by module, and the mutants that only the first file killed."""
    runs = [{json.dumps(one["mutant"]): one for one in _read(file)} for file in files]
    for module in MODULES:
        cells = []
        for run in runs:
            found = Counter(r["outcome"] for r in run.values() if r["mutant"]["module"] == module)
            dead = found[KILLED] + found[TIMEOUT]
            cells.append(f"{dead} of {found.total()}")
        print(f"| `{module}` | {' | '.join(cells)} |")
    ended = (KILLED, TIMEOUT)
    for key, one in runs[0].items():
        if len(runs) > 1 and one["outcome"] in ended and runs[1][key]["outcome"] not in ended:
            print(one["mutant"]["module"], one["mutant"]["line"], one["mutant"]["after"], one["by"])


def main() -> None:
    """Draw, run or print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("action", choices=("draw", "run", "table"))
    parser.add_argument("files", nargs="+", type=Path, help="mutants; for `run` also results")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    if given.action == "draw":
        drawn = [json.dumps(asdict(one)) for one in draw_mutants(given.seed)]
        given.files[0].write_text("\n".join(drawn) + "\n", encoding="utf-8")
    elif given.action == "run":
        mutants = [Mutant(**one) for one in _read(given.files[0])]
        run_all(mutants, given.files[1], given.workers)
    else:
        print_table(given.files)


if __name__ == "__main__":
    main()

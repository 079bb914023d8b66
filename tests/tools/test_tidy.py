# SPDX-License-Identifier: MIT
"""Each rule finds what it forbids and leaves its neighbour alone."""

from __future__ import annotations

import subprocess
from pathlib import Path, PurePosixPath

import pytest

from tools import tidy
from tools.tidy_rules.base import Fault, Rule, Source, Tree, read_tree
from tools.tidy_rules.layers import (
    core_is_pure,
    core_layers,
    python_layers,
    units_at_the_edge,
)
from tools.tidy_rules.layout import tests_mirror_sources as mirror_rule
from tools.tidy_rules.sizes import file_bytes, file_lines, python_functions, rust_functions
from tools.tidy_rules.texts import licence_line, named_paths_exist, no_machine_paths

CORE = "crates/drivetwin-core/src"
PACKAGE = "python/drivetwin"
HOME = "/" + "home/"


def tree_of(files: dict[str, str]) -> Tree:
    sources = (Source(PurePosixPath(name), text.encode()) for name, text in files.items())
    return Tree(Path(), tuple(sources))


def faults(rule: Rule, files: dict[str, str]) -> list[tuple[str, int]]:
    return [(str(fault.path), fault.line) for fault in rule(tree_of(files))]


def python_function(body_lines: int, arguments: str = "", docstring: str = "") -> str:
    body = "".join(f"    x{number} = {number}\n" for number in range(body_lines))
    return f"def f({arguments}):\n{docstring}{body}"


@pytest.mark.parametrize(
    ("rule", "good", "bad", "line"),
    [
        (file_lines, {"a.py": "x\n" * 500}, {"a.py": "x\n" * 501}, 1),
        (file_bytes, {"a.csv": "x" * 1_000_000}, {"a.csv": "x" * 1_000_001}, 1),
        (
            python_functions,
            {"a.py": python_function(59, docstring='    """Long,\n    not counted."""\n')},
            {"a.py": python_function(60)},
            1,
        ),
        (
            python_functions,
            {"a.py": "def f(self, a, b, c, d, e, *f, g): ..."},
            {"a.py": "def f(a, b, c, d, e, f, *, g, h): ..."},
            1,
        ),
        (
            python_functions,
            {"tests/a.py": "def test_f(a, b, c, d, e, f, g, h): ..."},
            {"tests/a.py": "def f(a, b, c, d, e, f, g, h): ..."},
            1,
        ),
        (
            rust_functions,
            {"a.rs": "fn f<F: Fn(f64, f64) -> (u8, u8)>(&mut self, a: [f64; 7], g: F) {}"},
            {"a.rs": "\nfn f(a: A, b: A, c: A, d: A, e: A, f: A, g: A, h: A) {}"},
            2,
        ),
        (
            core_is_pure,
            {f"{CORE}/a.rs": '// pyo3\nlet s = "std::fs println!";'},
            {f"{CORE}/a.rs": "\neprintln!();"},
            2,
        ),
        (core_is_pure, {"other/a.rs": "use std::fs;"}, {f"{CORE}/a.rs": "use std::fs::File;"}, 1),
        (
            core_is_pure,
            {"crates/drivetwin-core/Cargo.toml": 'serde = "1"'},
            {"crates/drivetwin-core/Cargo.toml": "[dependencies]\npyo3.workspace = true"},
            2,
        ),
        (
            core_layers,
            {f"{CORE}/solver/a.rs": "use crate::network::Mode;"},
            {f"{CORE}/solver/a.rs": "use crate::{network::Mode, model::Clutch};"},
            1,
        ),
        (
            core_layers,
            {f"{CORE}/simulate/a.rs": "use crate::solver::Status;"},
            {f"{CORE}/network/a.rs": "use crate::solver::Status;"},
            1,
        ),
        (
            python_layers,
            {f"{PACKAGE}/shifts/a.py": "from drivetwin.logs.shiftlog import ShiftLog"},
            {f"{PACKAGE}/shifts/a.py": "from drivetwin.identify.result import Estimate"},
            1,
        ),
        (
            python_layers,
            {f"{PACKAGE}/__init__.py": "from drivetwin.cli import main"},
            {f"{PACKAGE}/logs/a.py": "import os\nfrom drivetwin import report"},
            2,
        ),
        (
            units_at_the_edge,
            {f"{PACKAGE}/logs/a.py": "x = p * 1e5", f"{PACKAGE}/shifts/b.py": "x = 2 * pi * f"},
            {f"{PACKAGE}/shifts/a.py": "x = p * 1e5"},
            1,
        ),
        (
            units_at_the_edge,
            {f"{PACKAGE}/identify/a.py": "x = 60 * dt"},
            {f"{PACKAGE}/identify/a.py": "x = w * 60 / (2 * np.pi)"},
            1,
        ),
        (
            units_at_the_edge,
            {f"{PACKAGE}/vehicle/a.py": "x = 1e5"},
            {f"{PACKAGE}/of_no_layer_yet.py": "\nx = n * math.pi / 30"},
            2,
        ),
        (
            licence_line,
            {"a.sh": "#!/bin/sh\n# SPDX-License-Identifier: MIT", "__init__.py": ""},
            {"a.rs": "//! SPDX is missing"},
            1,
        ),
        (
            no_machine_paths,
            {"Makefile": HOME, "a.md": "../home/x"},
            {"a.md": f"\nsee {HOME}x"},
            2,
        ),
        (
            named_paths_exist,
            {"README.md": "`docs/a.md` [a](docs/a.md) `J/eta` [w](https://x.y)", "docs/a.md": ""},
            {"README.md": "\n`docs/b.md`"},
            2,
        ),
        (
            named_paths_exist,
            {"docs/x/a.md": "[up](../b.md)", "docs/b.md": "`docs/x`"},
            {"docs/x/a.md": "[up](../c.md)"},
            1,
        ),
        (
            mirror_rule,
            {
                "tests/logs/test_csv_limits.py": "",
                "tests/logs/test_given_logs.py": "",
                f"{PACKAGE}/logs/csv.py": "",
            },
            {"tests/logs/test_csvx.py": "", f"{PACKAGE}/logs/csv.py": ""},
            1,
        ),
        (
            mirror_rule,
            {"tests/system/test_anything.py": ""},
            {"tests/tools/test_absent.py": "", "tools/tidy.py": ""},
            1,
        ),
    ],
)
def test_a_rule_tells_good_from_bad(
    rule: Rule, good: dict[str, str], bad: dict[str, str], line: int
) -> None:
    assert faults(rule, good) == []
    assert [found for _, found in faults(rule, bad)][:1] == [line]


@pytest.mark.parametrize(("statements", "found"), [(58, False), (59, True)])
def test_rust_function_length_runs_from_fn_to_brace(statements: int, *, found: bool) -> None:
    body = "    let a = '}'; // }\n" * statements
    assert bool(faults(rust_functions, {"a.rs": f"fn f() -> [f64; 3] {{\n{body}}}\n"})) is found


def test_unit_tests_of_a_rust_file_do_not_count_as_its_lines() -> None:
    text = "x\n" * 400 + "#[cfg(test)]\nmod tests {\n" + "x\n" * 400 + "}\n"
    assert faults(file_lines, {"a.rs": text}) == []


def test_a_module_outside_the_layers_is_named() -> None:
    assert faults(python_layers, {f"{PACKAGE}/somewhere.py": ""}) == [
        (f"{PACKAGE}/somewhere.py", 1)
    ]


def long_file() -> Tree:
    return tree_of({"a.py": "# SPDX-License-Identifier: MIT\n" * 501})


def test_an_exception_covers_its_fault() -> None:
    exemptions = tidy.read_exemptions(
        '[[exception]]\nrule = "file-lines"\npath = "a.py"\nreason = "one table"\n'
    )
    assert [fault.rule for fault in tidy.check(long_file(), ())] == ["file-lines"]
    assert tidy.check(long_file(), exemptions) == []


def test_a_stale_exception_is_a_fault() -> None:
    exemptions = tidy.read_exemptions(
        '[[exception]]\nrule = "file-lines"\npath = "b.py"\nreason = "gone"\n'
    )
    rules = [fault.rule for fault in tidy.check(long_file(), exemptions)]
    assert rules == ["file-lines", "stale-exception"]


def test_an_exception_without_reason_is_refused() -> None:
    with pytest.raises(ValueError, match="gives no reason"):
        tidy.read_exemptions('[[exception]]\nrule = "file-lines"\npath = "a.py"\n')


def test_the_tree_holds_new_files_but_no_ignored_or_deleted_ones(tmp_path: Path) -> None:
    subprocess.run(["git", "init", "--quiet"], cwd=tmp_path, check=True)
    (tmp_path / ".gitignore").write_text("*.so\n")
    for name in ("kept.py", "deleted.py", "ignored.so"):
        (tmp_path / name).touch()
    subprocess.run(["git", "add", "."], cwd=tmp_path, check=True)
    (tmp_path / "deleted.py").unlink()
    (tmp_path / "new.py").touch()
    names = [str(source.path) for source in read_tree(tmp_path).sources]
    assert names == [".gitignore", "kept.py", "new.py"]


def test_a_fault_reads_as_a_compiler_message() -> None:
    assert str(Fault("rule", PurePosixPath("a/b.py"), 3, "text")) == "a/b.py:3: [rule] text"

# SPDX-License-Identifier: MIT
"""Each rule finds what it forbids and leaves its neighbour alone."""

from __future__ import annotations

import subprocess
from pathlib import Path, PurePosixPath

import pytest

from tools.tidy_rules.base import Rule, Source, Tree, read_tree
from tools.tidy_rules.core import check_circles as check_core_circles
from tools.tidy_rules.core import check_layers, check_purity
from tools.tidy_rules.files import check_bytes, check_lines, check_tests
from tools.tidy_rules.imports import MAX_CIRCLE, check_circles, describe_circles
from tools.tidy_rules.prose import check_openers
from tools.tidy_rules.texts import check_licence, check_machine_paths, check_named_paths
from tools.tidy_rules.units import check_units
from tools.tidy_rules.words import WORDS, check_words

CORE = "crates/drivetwin-core/src"
PACKAGE = "python/drivetwin"
HOME = "/" + "home/"


def tree_of(files: dict[str, str]) -> Tree:
    sources = (Source(PurePosixPath(name), text.encode()) for name, text in files.items())
    return Tree(Path(), tuple(sources))


def faults(rule: Rule, files: dict[str, str]) -> list[tuple[str, int]]:
    return [(str(fault.path), fault.line) for fault in rule(tree_of(files))]


@pytest.mark.parametrize(
    ("rule", "good", "bad", "line"),
    [
        (check_lines, {"a.py": "x\n" * 500}, {"a.py": "x\n" * 501}, 1),
        (check_bytes, {"a.csv": "x" * 1_000_000}, {"a.csv": "x" * 1_000_001}, 1),
        (
            check_purity,
            {f"{CORE}/a.rs": '// pyo3\nlet s = "std::fs println!";'},
            {f"{CORE}/a.rs": "\neprintln!();"},
            2,
        ),
        (check_purity, {"other/a.rs": "use std::fs;"}, {f"{CORE}/a.rs": "use std::fs::File;"}, 1),
        (
            check_purity,
            {"crates/drivetwin-core/Cargo.toml": 'serde = "1"'},
            {"crates/drivetwin-core/Cargo.toml": "[dependencies]\npyo3.workspace = true"},
            2,
        ),
        (
            check_layers,
            {f"{CORE}/solver/a.rs": "use crate::network::Mode;"},
            {f"{CORE}/solver/a.rs": "use crate::{network::Mode, model::Clutch};"},
            1,
        ),
        (
            check_layers,
            {f"{CORE}/simulate/a.rs": "use crate::solver::Status;"},
            {f"{CORE}/network/a.rs": "use crate::solver::Status;"},
            1,
        ),
        (
            check_units,
            {f"{PACKAGE}/logs/a.py": "x = p * 1e5", f"{PACKAGE}/shifts/b.py": "x = 2 * pi * f"},
            {f"{PACKAGE}/shifts/a.py": "x = p * 1e5"},
            1,
        ),
        (
            check_units,
            {f"{PACKAGE}/estimation/a.py": "x = 60 * dt"},
            {f"{PACKAGE}/estimation/a.py": "x = w * 60 / (2 * np.pi)"},
            1,
        ),
        (
            check_units,
            {f"{PACKAGE}/vehicle/a.py": "x = 1e5"},
            {f"{PACKAGE}/of_no_layer_yet.py": "\nx = n * math.pi / 30"},
            2,
        ),
        (
            check_licence,
            {"a.sh": "#!/bin/sh\n# SPDX-License-Identifier: MIT", "__init__.py": ""},
            {"a.rs": "//! SPDX is missing"},
            1,
        ),
        (
            check_machine_paths,
            {"Makefile": HOME, "a.md": "../home/x"},
            {"a.md": f"\nsee {HOME}x"},
            2,
        ),
        (
            check_named_paths,
            {"README.md": "`docs/a.md` [a](docs/a.md) `J/eta` [w](https://x.y)", "docs/a.md": ""},
            {"README.md": "\n`docs/b.md`"},
            2,
        ),
        (
            check_named_paths,
            {"docs/x/a.md": "[up](../b.md)", "docs/b.md": "`docs/x`"},
            {"docs/x/a.md": "[up](../c.md)"},
            1,
        ),
        (
            check_openers,
            {f"{PACKAGE}/a.py": '"""Note of what it is."""'},
            {f"{PACKAGE}/a.py": '"""Names."""\n\nclass A:\n    """What it holds."""'},
            4,
        ),
        (
            check_tests,
            {
                "tests/logs/test_csv_limits.py": "",
                "tests/logs/test_given_logs.py": "",
                f"{PACKAGE}/logs/csv.py": "",
            },
            {"tests/logs/test_csvx.py": "", f"{PACKAGE}/logs/csv.py": ""},
            1,
        ),
        (
            check_tests,
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


def module(name: str, *imports: str) -> dict[str, str]:
    """Return a source file of the package that imports modules in several ways."""
    text = "".join(f"def f{k}():\n    from {one} import x\n" for k, one in enumerate(imports))
    return {f"python/{name.replace('.', '/')}.py": text}


def test_modules_of_one_package_may_form_a_small_circle() -> None:
    pair = module("drivetwin.a.b", "drivetwin.a.c") | module("drivetwin.a.c", "drivetwin.a.b")
    assert faults(check_circles, pair) == []
    names = [f"drivetwin.a.m{k}" for k in range(MAX_CIRCLE + 1)]
    ring = {
        path: text
        for name, after in zip(names, names[1:] + names[:1], strict=True)
        for path, text in module(name, after).items()
    }
    assert len(faults(check_circles, ring)) == 1
    assert describe_circles(tree_of(ring)).startswith(f"largest circle of modules {len(names)},")


def test_packages_must_not_import_each_other() -> None:
    there = module("drivetwin.a.x.b", "drivetwin.a.y.c") | module("drivetwin.a.y.c")
    assert faults(check_circles, there) == []
    back = module("drivetwin.a.y.d", "drivetwin.a.x.b")
    assert faults(check_circles, there | back) == [("python/drivetwin/a/x", 1)]


def test_circles_of_the_core_are_followed_through_groups_and_re_exports() -> None:
    files = {
        f"{CORE}/solver/mod.rs": "mod a;\nmod b;\nmod c;\npub use b::Step;\n",
        f"{CORE}/solver/a.rs": "use super::Step;\n",
        f"{CORE}/solver/b.rs": "use crate::{model::Clutch, solver::{c::{self, Run}}};\n",
        f"{CORE}/solver/c.rs": "fn f() { super::a::g() }\n",
        f"{CORE}/model/mod.rs": "pub struct Clutch;\n",
    }
    assert faults(check_core_circles, files) == [(CORE, 1)]
    files[f"{CORE}/solver/c.rs"] = "// super::a\n#[cfg(test)]\nmod tests {\n use super::a;\n}\n"
    assert faults(check_core_circles, files) == []


def test_private_words_are_found_as_files_folders_and_definitions() -> None:
    words = (
        "# comment\n"
        "python/drivetwin/*\tfolder\tapp\n"
        "python/drivetwin/logs/*\tfile\theld damage\n"
        "python/drivetwin/logs/*\tpython\treported Work ENOUGH\n"
        "crates/*\trust\tsprint Stuck\n"
    )
    files = {
        WORDS: words,
        f"{PACKAGE}/app/a.py": "",
        f"{PACKAGE}/cli/app.py": "def reported(): ...",
        f"{PACKAGE}/logs/held.py": "def estimated(): ...",
        f"{PACKAGE}/logs/a.py": "ENOUGH = 1\nclass A:\n    def reported(self): ...\n",
        "crates/a.rs": "// fn sprint\nenum A {\n    Stuck,\n    Open(u8),\n}\nfn sprint() {}\n",
    }
    assert sorted(faults(check_words, files)) == [
        ("crates/a.rs", 3),
        ("crates/a.rs", 6),
        (f"{PACKAGE}/app", 1),
        (f"{PACKAGE}/logs/a.py", 1),
        (f"{PACKAGE}/logs/a.py", 3),
        (f"{PACKAGE}/logs/held.py", 1),
    ]


def test_private_words_are_found_within_identifiers_and_texts() -> None:
    words = (
        f"{PACKAGE}/*\tname\tage part\n"
        f"{PACKAGE}/*\tphrase\ttold; age of the\n"
        "docs/*\tphrase\tformed anew\n"
    )
    files = {
        WORDS: words,
        f"{PACKAGE}/a.py": "# a part of an age\nmessage = 0\nsensor.age = 1\nstages = MyPart()\n",
        f"{PACKAGE}/b.toml": 'text = "The age\n  of the torque"\nuntold = 1\n',
        "docs/a.md": "It is reported.\n\nThe columns are Formed\nanew.\n",
    }
    assert sorted(faults(check_words, files)) == [
        ("docs/a.md", 3),
        (f"{PACKAGE}/a.py", 3),
        (f"{PACKAGE}/a.py", 4),
        (f"{PACKAGE}/b.toml", 1),
    ]


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

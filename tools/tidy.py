# SPDX-License-Identifier: MIT
"""Check the rules of ARCHITECTURE.md and CONTRIBUTING.md that no standard tool checks.

`python -m tools.tidy` prints one line for each fault, the figures that have a bar, and exits with 1
if there are faults. There are no exceptions to these rules.
"""

from __future__ import annotations

import sys
from pathlib import Path

from tools.budget import check_budget
from tools.results_page import describe_age
from tools.tidy_rules import core, figures, files, imports, prose, texts, units, words
from tools.tidy_rules.base import Fault, Rule, Tree, read_tree

RULES: tuple[Rule, ...] = (
    check_budget,
    core.check_purity,
    core.check_layers,
    core.check_circles,
    figures.check_figures,
    files.check_lines,
    files.check_bytes,
    files.check_tests,
    imports.check_circles,
    prose.check_names,
    prose.check_openers,
    texts.check_licence,
    texts.check_machine_paths,
    texts.check_named_paths,
    units.check_units,
    words.check_words,
)


def check(tree: Tree) -> list[Fault]:
    """Return all faults of the tree, by path and line."""
    faults = [fault for rule in RULES for fault in rule(tree)]
    return sorted(faults, key=lambda fault: (str(fault.path), fault.line, fault.rule))


def main() -> int:
    """Check the repository that contains this file."""
    tree = read_tree(Path(__file__).resolve().parent.parent)
    faults = check(tree)
    for fault in faults:
        print(fault)
    for warning in describe_age(tree.root):
        print(f"warning: {warning}")
    print(f"{imports.describe_circles(tree)}; {prose.describe_names(tree)}")
    print(f"tidy: {len(tree.sources)} files, {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: MIT
"""Checks the rules of ARCHITECTURE.md and CONTRIBUTING.md that a program can check.

`python -m tools.tidy` prints one line per fault and exits with 1 if there are any. An exception
to a rule stands with its reason in `tools/tidy_exceptions.toml`; one that is no longer needed is
a fault itself.
"""

from __future__ import annotations

import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from tools.tidy_rules import layers, layout, sizes, texts
from tools.tidy_rules.base import Fault, Rule, Tree, read_tree

EXCEPTIONS = "tools/tidy_exceptions.toml"

RULES: tuple[Rule, ...] = (
    sizes.file_lines,
    sizes.file_bytes,
    sizes.python_functions,
    sizes.rust_functions,
    layers.core_is_pure,
    layers.core_layers,
    layers.python_layers,
    layers.units_at_the_edge,
    texts.licence_line,
    texts.no_machine_paths,
    texts.named_paths_exist,
    layout.tests_mirror_sources,
)


@dataclass(frozen=True)
class Exemption:
    """One named exception: which rule, where, for which function (empty: the file), and why."""

    rule: str
    path: PurePosixPath
    name: str
    reason: str

    def covers(self, fault: Fault) -> bool:
        """Whether the fault is the one that is allowed."""
        return (self.rule, self.path, self.name) == (fault.rule, fault.path, fault.name)


def read_exemptions(text: str) -> tuple[Exemption, ...]:
    """Parse the exceptions file. Raises ValueError for one without a reason."""
    entries = tomllib.loads(text).get("exception", [])
    for entry in entries:
        if not entry.get("reason", "").strip():
            raise ValueError(f"{EXCEPTIONS}: {entry} gives no reason")
    return tuple(
        Exemption(
            entry["rule"], PurePosixPath(entry["path"]), entry.get("name", ""), entry["reason"]
        )
        for entry in entries
    )


def check(tree: Tree, exemptions: tuple[Exemption, ...]) -> list[Fault]:
    """All faults of the tree that no exception covers, and the exceptions that cover none."""
    found = [fault for rule in RULES for fault in rule(tree)]
    faults = [fault for fault in found if not any(item.covers(fault) for item in exemptions)]
    for item in exemptions:
        if not any(item.covers(fault) for fault in found):
            text = f"no longer needed: {item.rule} in {item.path} {item.name}".rstrip()
            faults.append(Fault("stale-exception", PurePosixPath(EXCEPTIONS), 1, text))
    return sorted(faults, key=lambda fault: (str(fault.path), fault.line, fault.rule))


def main() -> int:
    """Check the repository that this file stands in."""
    root = Path(__file__).resolve().parent.parent
    tree = read_tree(root)
    faults = check(tree, read_exemptions((root / EXCEPTIONS).read_text(encoding="utf-8")))
    for fault in faults:
        print(fault)
    print(f"tidy: {len(tree.sources)} files, {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())

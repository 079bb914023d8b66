# SPDX-License-Identifier: MIT
"""Rules on docstrings and function names of the package; the bars are those of peer projects."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import PurePosixPath

from tools.tidy_rules.base import PACKAGE, Fault, Tree

MAX_OPENERS = 0.005
"""Largest share of docstrings that open with a relative clause; those of tools are counted too."""
MIN_VERBS, MAX_OTHERS = 0.38, 0.08
"""Shares of functions named by a verb, and by a participle or preposition."""

_OPENERS = (
    *("What", "Which", "Those", "Whether", "The same"),
    *("Where ", "Who ", "None where", "All where"),
)
_PREPOSITIONS = frozenset(
    "of by at to from in with without over beside near beyond".split()  # noqa: SIM905
)
_IRREGULAR = frozenset(
    """
    told found shown known held taken seen made left kept cut built drawn written sent gone lost
    grown chosen thought spun split
    """.split()  # noqa: SIM905
)
_VERBS = frozenset(
    """
    accept add advance append apply as ask assemble assess attach build calculate call can
    check choose clip close collect compare compile compute connect convert copy correct
    count create cut decode delete describe detect draw drop emit encode encrypt ensure
    estimate evaluate expand export fetch filter find fit flatten format from generate get
    handle has identify import infer init initialise initialize integrate interpolate is
    iterate join judge linearise linearize list listen load locate log make map match
    measure merge minimise minimize mount must next note notify open optimise optimize parse
    plan plot predict prepare print propagate quantify query raise rank read record reduce
    refine refuse register reject remove render require resolve return run sample save scale
    scan search select send set should show simulate smooth solve split start step stop
    store submit summarise summarize to transform trim unwrap update validate warn wrap
    write
    """.split()  # noqa: SIM905
)
EXEMPT_FILES = frozenset(
    f"{PACKAGE}/estimation/likelihood/{name}.py"
    for name in (
        "coloured_noise", "diagnostics/misspecification", "noise/coloured_noise",
        "selection/aero_load", "selection/loss_law", "selection/per_shift_load",
        "selection/sampling_mode", "selection/touch_point_minima", "uncertainty/sensor_tolerance",
    )
)  # fmt: skip
"""Special cases of the likelihood method that one mechanism is to replace."""


def _classify(name: str) -> str:
    """Return the part of speech of a function's name: verb, preposition, participle or noun."""
    words = name.strip("_").split("_")
    ends = (words[0], words[-1])
    if words[0] in _VERBS:
        return "verb"
    if any(word in _PREPOSITIONS for word in ends):
        return "preposition"
    if any(word.endswith("ed") or word in _IRREGULAR for word in ends):
        return "participle"
    return "noun"


def _is_property(node: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    texts = [ast.unparse(decorator) for decorator in node.decorator_list]
    return any(text.endswith(("property", ".setter")) for text in texts)


def _count_names(tree: Tree) -> Counter[str]:
    """Count the functions of the package by part of speech, without properties and dunders."""
    return Counter(
        _classify(node.name)
        for source in tree.below(PACKAGE, ".py")
        if str(source.path) not in EXEMPT_FILES
        for node in ast.walk(ast.parse(source.data))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and not node.name.startswith("__")
        and not _is_property(node)
    )


def check_names(tree: Tree) -> Iterator[Fault]:
    """Reject a package whose functions are seldom named by verbs."""
    counts = _count_names(tree)
    total = counts.total()
    others = counts["preposition"] + counts["participle"]
    if total and (counts["verb"] < MIN_VERBS * total or others > MAX_OTHERS * total):
        text = f"{describe_names(tree)}; at least {MIN_VERBS:.0%} and at most {MAX_OTHERS:.0%}"
        yield Fault("function-names", PurePosixPath(PACKAGE), 1, text)


def describe_names(tree: Tree) -> str:
    """Return the shares of functions named by a verb and by a participle or preposition."""
    counts = _count_names(tree)
    total = counts.total() or 1
    others = counts["preposition"] + counts["participle"]
    return (
        f"functions named by a verb {100 * counts['verb'] / total:.0f} %, "
        f"by a participle or preposition {100 * others / total:.1f} %"
    )


def check_openers(tree: Tree) -> Iterator[Fault]:
    """Reject docstrings that open with a relative clause, if there are more than a few."""
    faults, count = [], 0
    for folder in (PACKAGE, "tools", "benchmarks"):
        for source in tree.below(folder, ".py"):
            if str(source.path) in EXEMPT_FILES:
                continue
            for node in ast.walk(ast.parse(source.data)):
                if not isinstance(
                    node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
                ):
                    continue
                text = ast.get_docstring(node)
                count += text is not None
                if text is not None and text.startswith(_OPENERS):
                    line = node.body[0].lineno
                    opening = " ".join(text.split()[:3])
                    text = f"docstring opens with {opening!r}: name the thing, or use an imperative"
                    faults.append(Fault("docstring-opener", source.path, line, text))
    if len(faults) > MAX_OPENERS * count:
        yield from faults

# SPDX-License-Identifier: MIT
"""Build the sections and pictures of pages that show raw results of benchmarks.

`python -m tools.results_page` fills what stands between `<!-- results NAME: SECTION -->` and
`<!-- end -->` on the pages of docs from benchmarks/results/NAME.json, and draws the pictures.
`--fresh` writes nothing and exits with 1 where results are too old for a release. `make tidy` fails
where a section or picture is not what the raw results give.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from tools.result_blocks import accuracy, pipeline, precision, speed
from tools.result_blocks.origin import Raw

ROOT = Path(__file__).resolve().parents[1]
RESULTS = "benchmarks/results"
SPEED = {"speed": speed.BLOCKS, "pipeline": pipeline.BLOCKS, "precision": precision.BLOCKS}
BLOCKS = {**SPEED, **accuracy.BLOCKS}
"""Sections by the name of their raw results."""
PICTURES: dict[str, tuple[str, Callable[[Raw], str]]] = {
    f"docs/img/work-precision-{name}.svg": ("precision", draw)
    for name, draw in precision.PICTURES.items()
}
"""Pictures by path: the name of their raw results, and how they are drawn."""
MOST_COMMITS = 200
"""Commits since the measurement from which on results are too old."""
_SECTION = re.compile(r"(<!-- results ([\w-]+): ([\w-]+) -->\n)(.*?)(<!-- end -->\n)", re.DOTALL)


def read_raw(name: str, root: Path = ROOT) -> Raw:
    """Read the raw results of a benchmark.

    Raises
    ------
    OSError
        There are none of that name.
    """
    raw: Raw = json.loads((root / RESULTS / f"{name}.json").read_text(encoding="utf-8"))
    return raw


def fill_page(page: str, read: Callable[[str], Raw] = read_raw) -> str:
    """Return the page with its sections as the raw results give them.

    Raises
    ------
    KeyError
        The page names a section that does not exist.
    """

    def fill(found: re.Match[str]) -> str:
        start, name, section, _, end = found.groups()
        return f"{start}{BLOCKS[name][section](read(name))}{end}"

    return _SECTION.sub(fill, page)


def describe_age(root: Path = ROOT) -> list[str]:
    """Describe the raw results that are too old, and those that are not of one commit."""
    names = [path.stem for path in sorted((root / RESULTS).glob("*.json"))]
    origins = {name: read_raw(name, root)["origin"] for name in names}
    words = []
    for name, origin in origins.items():
        since = _count_commits(origin["committed"], root)
        if since > MOST_COMMITS:
            words.append(f"{RESULTS}/{name}.json is {since} commits old: measure anew")
    if len({origins[name]["commit"] for name in SPEED}) > 1:
        words.append(f"{RESULTS}: files of several commits: measure together, `make figures`")
    return words


def _count_commits(since: str, root: Path) -> int:
    """Count the commits later than an instant: a commit that was measured may have been rebased."""
    command = ["git", "rev-list", "--count", f"--since={since}", "HEAD"]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    return int(done.stdout or 0)


def main() -> int:
    """Write pages and pictures, or only look whether results are fresh."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fresh", action="store_true", help="exit with 1 where results are old")
    if parser.parse_args().fresh:
        words = describe_age()
        print("\n".join(words) or "results are fresh")
        return 1 if words else 0
    for path in sorted((ROOT / "docs").rglob("*.md")):
        before = path.read_text(encoding="utf-8")
        if (after := fill_page(before)) != before:
            path.write_text(after, encoding="utf-8")
    for name, (raw, draw) in PICTURES.items():
        (ROOT / name).write_text(draw(read_raw(raw)), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())

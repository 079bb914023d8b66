# SPDX-License-Identifier: MIT
"""Pages show the figures of the raw results, of one commit that is not long ago."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from benchmarks.precision import peers
from tools import results_page
from tools.results_page import ROOT
from tools.tidy_rules.base import read_tree
from tools.tidy_rules.figures import check_figures

PAGE = Path("docs") / "benchmarks-pipeline.md"
MOST_LINES = 80
"""Lines of a peer's script."""


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A repository with the raw results and one of their pages."""
    for path in (PAGE, *(ROOT / "benchmarks" / "results").glob("*.json")):
        target = tmp_path / (path.relative_to(ROOT) if path.is_absolute() else path)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text((ROOT / path).read_text(encoding="utf-8"), encoding="utf-8")
    _run_git(tmp_path, "init", "--quiet")
    _run_git(tmp_path, "add", ".")
    return tmp_path


def _run_git(folder: Path, *words: str) -> None:
    names = ("-c", "user.name=a", "-c", "user.email=a@b")
    subprocess.run(["git", *names, *words], cwd=folder, check=True)


def _list_figures(folder: Path) -> list[tuple[str, int]]:
    return [(str(one.path), one.line) for one in check_figures(read_tree(folder))]


def test_a_figure_that_the_raw_results_do_not_give_is_a_fault(repository: Path) -> None:
    assert _list_figures(repository) == []
    page = repository / PAGE
    lines = page.read_text(encoding="utf-8").splitlines(keepends=True)
    row = next(n for n, line in enumerate(lines) if line.startswith("| `"))
    seconds = lines[row].split("|")[2]
    lines[row] = lines[row].replace(seconds, f" {float(seconds) - 0.01:.2f} ", 1)
    page.write_text("".join(lines), encoding="utf-8")
    assert _list_figures(repository) == [(PAGE.as_posix(), row + 1)]


def test_results_grow_old_and_belong_together(
    repository: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(results_page, "MOST_COMMITS", 1)
    paths = sorted((repository / "benchmarks" / "results").glob("*.json"))
    for path in paths:
        raw = json.loads(path.read_text(encoding="utf-8"))
        raw["origin"] |= {"commit": "0123456789", "committed": "2020-01-01T00:00:00+00:00"}
        path.write_text(json.dumps(raw), encoding="utf-8")
    _run_git(repository, "commit", "--quiet", "--all", "--message", "first")
    assert results_page.describe_age(repository) == []
    _run_git(repository, "commit", "--quiet", "--allow-empty", "--message", "second")
    assert len(results_page.describe_age(repository)) == len(paths)
    path = repository / "benchmarks" / "results" / "speed.json"
    raw["origin"]["commit"] = "a" * 10
    path.write_text(json.dumps(raw), encoding="utf-8")
    assert "several commits" in results_page.describe_age(repository)[-1]


def test_a_peer_is_short() -> None:
    scripts = [*Path(peers.__path__[0]).glob("*.py")]
    assert len(scripts) > 1
    long = [one for one in scripts if len(one.read_text("utf-8").splitlines()) > MOST_LINES]
    assert long == []

# SPDX-License-Identifier: MIT
"""Commit of the code that a page's figures are from."""

from __future__ import annotations

import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_CODE = ("python", "crates", "benchmarks", ":!benchmarks/results")


def read_commit() -> str:
    """Return the running commit, and whether its code was changed."""
    changed = _run_git("status", "--porcelain", "--", *_CODE)
    return _run_git("rev-parse", "--short=10", "HEAD") + (", changed" if changed else "")


def _run_git(*words: str) -> str:
    found = subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True, text=True)
    return found.stdout.strip()

# SPDX-License-Identifier: MIT
"""Raw results of benchmarks in benchmarks/results, with what they were measured on and with.

The pages on speed and accuracy are built from these files: `python -m tools.results_page`.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from benchmarks.code_version import ROOT, read_commit
from tools.result_blocks import accuracy

RESULTS = ROOT / "benchmarks" / "results"
DIGITS = 5
"""Significant digits of a number that are stored."""
_CORE = "cargo build --release (opt-level 3, thin LTO)"


def write_results(
    name: str,
    measured: Mapping[str, Any],
    *,
    clock: str,
    rounds: int,
    seeds: Sequence[int] = (),
    flags: Mapping[str, str] | None = None,
    packages: Sequence[str] = ("numpy", "scipy"),
) -> Path:
    """Write what was measured to benchmarks/results and return the path.

    Parameters
    ----------
    name
        Name of the file without its suffix.
    measured
        Numbers and texts by key.
    clock
        What the times are and how they were taken from the rounds.
    rounds, seeds
        How often the programs took turns, and the seeds of what was drawn.
    flags
        Flags of compilers by their name, beside those of the core.
    packages
        Installed distributions whose versions matter.
    """
    origin = _describe_origin("", packages, flags or {})
    times = {"clock": clock, "rounds": rounds, "seeds": list(seeds)}
    return _write_document(name, {"origin": {**origin, **times}, **measured})


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of a study whose outcomes docs/accuracy.md shows."""
    parser.add_argument("--rows", type=Path, help="file of outcomes, which is continued")
    parser.add_argument("--write", action="store_true", help="write benchmarks/results")
    parser.add_argument("--commit", default="", help="commit that the outcomes of --rows are of")


def finish_study(
    study: str,
    command: str,
    seeds: Sequence[int],
    tables: Mapping[str, Sequence[Mapping[str, Any]]],
    given: argparse.Namespace,
) -> None:
    """Print the sections of a study on docs/accuracy.md, and write its raw results if asked to.

    Parameters
    ----------
    study
        Name of the study; its file is accuracy-STUDY.json.
    command, seeds
        Module with its arguments, and the seeds of the outcomes.
    tables
        Rows of equal keys by the name of the table.
    given
        Options of `add_options`.
    """
    origin = _describe_origin(given.commit, ("numpy", "scipy"), {})
    source = {"command": f"python -m {command}", "seeds": list(seeds)}
    columns = {
        name: {"columns": list(rows[0]) if rows else [], "rows": [[*one.values()] for one in rows]}
        for name, rows in tables.items()
    }
    document = _shorten({"origin": {**origin, **source}, **columns})
    name = f"accuracy-{study}"
    for section in accuracy.BLOCKS[name].values():
        sys.stdout.write(f"{section(document)}\n")
    if given.write:
        _write_document(name, document)


def _describe_origin(
    commit: str, packages: Sequence[str], flags: Mapping[str, str]
) -> dict[str, Any]:
    """Describe code, machine, compilers and versions; `commit` is empty for the running one."""
    return {
        "commit": commit or read_commit(),
        "committed": _run("git", "log", "-1", "--format=%cI", *([commit] if commit else [])),
        "date": datetime.now(UTC).date().isoformat(),
        "machine": _describe_machine(),
        "compilers": {
            "rustc": _run("rustc", "--version"),
            "gcc": _run("gcc", "-dumpfullversion"),
        },
        "flags": {"core": f"{_CORE}{_read_rust_flags()}", **flags},
        "versions": _list_versions(packages),
    }


def _write_document(name: str, document: Mapping[str, Any]) -> Path:
    """Write a document, a list of plain values in one line."""
    text = json.dumps(_shorten(document), indent=1, ensure_ascii=False, allow_nan=False)
    text = re.sub(r"\[[^][{}]*\]", lambda found: re.sub(r"\n\s*", " ", found[0]), text)
    path = RESULTS / f"{name}.json"
    path.write_text(f"{text}\n", encoding="utf-8")
    return path


def _read_rust_flags() -> str:
    """Return the flags of the environment that the core is built in."""
    flags = os.environ.get("RUSTFLAGS", "")
    return f", {flags}" if flags else ", instruction set chosen at run time"


def _describe_machine() -> dict[str, Any]:
    loads = os.getloadavg() if hasattr(os, "getloadavg") else ()
    return {
        "system": platform.system(),
        "cpu": _read_processor(),
        "cores": os.cpu_count(),
        "load": [round(load, 1) for load in loads],
    }


def _read_processor() -> str:
    """Return the model of the processor with family, model and its widest vectors."""
    try:
        text = Path("/proc/cpuinfo").read_text("utf-8")
    except OSError:
        return platform.machine()
    facts = dict(line.partition(":")[::2] for line in text.split("\n\n")[0].splitlines())
    known = {key.strip(): value.strip() for key, value in facts.items()}
    vectors = next((one for one in ("avx512f", "avx2") if one in known.get("flags", "")), "")
    words = [known.get("model name", platform.machine())]
    words += [f"{key} {known[key]}" for key in ("cpu family", "model") if key in known]
    return ", ".join([*words, *([vectors] if vectors else [])])


def _list_versions(packages: Sequence[str]) -> dict[str, str]:
    """Return versions by name; packages that are not installed are left out."""
    versions = {"Python": platform.python_version()}
    for package in packages:
        try:
            versions[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return versions


def _run(*command: str) -> str:
    """Return what a command prints; empty where it is missing."""
    try:
        done = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return done.stdout.strip()


def _shorten(value: Any) -> Any:
    """Return the value with all its floats at `DIGITS` digits; None for one that is not finite."""
    match value:
        case bool() | int() | str() | None:
            return value
        case float():
            short = float(f"{value:.{DIGITS}g}")
            return short if abs(short) < float("inf") else None
        case Mapping():
            return {str(key): _shorten(one) for key, one in value.items()}
        case _:
            return [_shorten(one) for one in value]

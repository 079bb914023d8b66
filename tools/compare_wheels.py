# SPDX-License-Identifier: MIT
"""Compare two builds of the wheel: `python -m tools.compare_wheels FIRST SECOND`.

Prints the SHA-256 if both are the same bytes. Otherwise it names the members that differ, and exits
with 1.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Sequence
from pathlib import Path
from zipfile import ZipFile

_FIELDS = ("date_time", "external_attr", "compress_type")


def find_differences(first: Path, second: Path) -> list[str]:
    """Return one line for each difference between two archives; none for the same bytes."""
    if first.read_bytes() == second.read_bytes():
        return []
    with ZipFile(first) as one, ZipFile(second) as other:
        ours, theirs = one.namelist(), other.namelist()
        lines = [f"{name}: only in one wheel" for name in sorted({*ours} ^ {*theirs})]
        for name in sorted({*ours} & {*theirs}):
            if one.read(name) != other.read(name):
                lines.append(f"{name}: contents")
            lines += [
                f"{name}: {field}"
                for field in _FIELDS
                if getattr(one.getinfo(name), field) != getattr(other.getinfo(name), field)
            ]
    return lines or ["order of the members, or the archive's own data"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare the two wheels that the arguments name."""
    first, second = map(Path, sys.argv[1:] if arguments is None else arguments)
    differences = find_differences(first, second)
    if differences:
        print(*(f"differs: {line}" for line in differences), sep="\n", file=sys.stderr)
        return 1
    print(f"two builds are equal: {hashlib.sha256(first.read_bytes()).hexdigest()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

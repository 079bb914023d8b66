# SPDX-License-Identifier: MIT
"""`python -m reference [NAME ...]` solves the problems anew and rewrites their expected values."""

from __future__ import annotations

import sys
from importlib import import_module

from reference.problem import ROOT, load, names
from reference.tables import Solution, write


def solved(name: str) -> Solution:
    """The independent solution of one problem at its instants."""
    solution = import_module(f"reference.{name}.solve").solution(load(name).time)
    assert isinstance(solution, Solution)
    return solution


if __name__ == "__main__":
    for chosen in sys.argv[1:] or names():
        write(ROOT / chosen, solved(chosen))
        print(f"{chosen}: written")

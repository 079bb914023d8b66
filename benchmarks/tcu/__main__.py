# SPDX-License-Identifier: MIT
"""Held-out shifts and coverage of controller logs: `python -m benchmarks.tcu GENERATOR`.

GENERATOR is a folder with `gen.py` and `gen.c` of an independent simulator of such logs; `gcc`
compiles it beside the made logs. Identifies COUNT vehicles of 20 shifts from seed FIRST on, every
fifth shift held out, and prints the tables. With `--rows FILE` vehicles are appended to a file, and
those in it are not made again. `--clean` leaves out the errors that the plant has no law for.
`--wrong tyre` fits a plant whose tyre does not slip, `--wrong KEY` a card with an exact number two
standard deviations off.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from benchmarks.raw_results import add_options, finish_study
from benchmarks.rows import append_row, read_rows
from benchmarks.tcu.made import Generator
from benchmarks.tcu.study import list_tables, study_vehicle


def main() -> int:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("generator", type=Path, help="folder of the simulator")
    parser.add_argument("first", type=int, nargs="?", default=0, help="first seed")
    parser.add_argument("count", type=int, nargs="?", default=20, help="vehicles")
    parser.add_argument("--clean", action="store_true", help="vehicles that obey the plant")
    parser.add_argument("--wrong", default="", help="tyre, or a key of the card such as mass_kg")
    add_options(parser)
    given = parser.parse_args()
    vehicles = {one["seed"]: one for one in read_rows(given.rows)}
    wanted = range(given.first, given.first + given.count)
    with tempfile.TemporaryDirectory() as folder:
        generator = Generator.compile(given.generator, Path(folder), rough=not given.clean)
        for seed in wanted:
            if seed not in vehicles:
                vehicles[seed] = study_vehicle(generator, seed, given.wrong)
                append_row(given.rows, vehicles[seed])
    command = f"benchmarks.tcu GENERATOR {given.first} {given.count}{' --clean' * given.clean}"
    command += f" --wrong {given.wrong}" if given.wrong else ""
    finish_study("tcu", command, wanted, list_tables([vehicles[seed] for seed in wanted]), given)
    return 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: MIT
"""Coverage of the intervals of bus logs: `python -m benchmarks.bus`.

Makes and identifies COUNT drives from seed FIRST on, and prints the tables. With `--rows FILE` the
drives are appended to a file, and those in it are not made again.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict

from benchmarks.bus.study import Row, list_tables, study_drive
from benchmarks.raw_results import add_options, finish_study
from benchmarks.rows import append_row, read_rows


def main() -> int:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("first", type=int, nargs="?", default=0, help="first seed")
    parser.add_argument("count", type=int, nargs="?", default=40, help="drives")
    add_options(parser)
    given = parser.parse_args()
    known = ([Row(**row) for row in one["rows"]] for one in read_rows(given.rows))
    drives = {rows[0].seed: rows for rows in known}
    wanted = range(given.first, given.first + given.count)
    for seed in wanted:
        if seed in drives:
            continue
        drives[seed], seconds = study_drive(seed)
        rows = [asdict(one) for one in drives[seed]]
        append_row(given.rows, {"seconds": seconds, "rows": rows})
    command = f"benchmarks.bus {given.first} {given.count}"
    finish_study("bus", command, wanted, list_tables([drives[seed] for seed in wanted]), given)
    return 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: MIT
"""Coverage of the intervals of bus logs: `python -m benchmarks.bus`.

Makes and identifies COUNT drives from seed FIRST on, and prints the tables. With `--rows FILE` the
drives are appended to a file, and those in it are not made again: several processes may share the
work by seeds, and a last run with all files prints the tables.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from benchmarks.bus.study import Row, format_tables, study_drive, to_record


def main() -> int:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("first", type=int, nargs="?", default=0, help="first seed")
    parser.add_argument("count", type=int, nargs="?", default=40, help="drives")
    parser.add_argument("--rows", type=Path, action="append", default=[], help="files of drives")
    options = parser.parse_args()
    drives = {}
    for file in options.rows:
        for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else ():
            rows = [Row(**one) for one in json.loads(line)["rows"]]
            drives[rows[0].seed] = rows
    for seed in range(options.first, options.first + options.count):
        if seed in drives:
            continue
        rows, seconds = study_drive(seed)
        drives[seed] = rows
        if options.rows:
            with options.rows[0].open("a", encoding="utf-8") as file:
                file.write(json.dumps(to_record(rows, seconds)) + "\n")
    wanted = range(options.first, options.first + options.count)
    sys.stdout.write(format_tables([drives[seed] for seed in wanted]))
    return 0


if __name__ == "__main__":
    sys.exit(main())

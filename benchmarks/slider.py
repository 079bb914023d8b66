# SPDX-License-Identifier: MIT
"""Server time of one move of a slider in the workbench; fails above 100 ms.

Run with `python benchmarks/slider.py`: the synthetic shift of the paper with throttle steps, 1 kHz.
A move is the start state, the simulation, the comparison with the log, and the changed curves as
the JSON that the browser gets.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from pathlib import Path

from dash import Patch
from plotly.io.json import to_json_plotly

from drivetwin.app.folder import Folder
from drivetwin.app.session import Session, Sessions
from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenarios import paper_steps
from drivetwin.identify.method import Method

LIMIT = 0.1
MOVES = 30


def opened(folder: Path) -> Session:
    """A session that has identified the synthetic log."""
    log, card, _ = write_run(folder / "bench.csv", run(paper_steps(), seed=1))
    sessions = Sessions(Folder.at(folder))
    session = sessions.get(sessions.new())
    session.open(session.in_folder(log.name), session.in_folder(card.name))
    session.identify([Method.PAPER, Method.INTEGRAL])
    while session.job is not None:
        session.poll()
        time.sleep(0.05)
    return session


def seconds_of(session: Session, stiffness: float) -> float:
    """Wall time of one move, until its answer is text [s]."""
    start = time.perf_counter()
    patch = Patch()
    for place, change in session.slide({"k_o": stiffness}).items():
        patch["data"][place]["x"], patch["data"][place]["y"] = change["x"], change["y"]
    to_json_plotly(patch)
    return time.perf_counter() - start


def main() -> int:
    """Print the median of several moves; 1 if it is above the limit."""
    with tempfile.TemporaryDirectory() as folder:
        session = opened(Path(folder))
        samples = session.simulation().present.traces["output_torque"].time.size
        moves = [seconds_of(session, 1.4e5 + 1e3 * k) for k in range(MOVES)]
        session.close()
    median, worst = statistics.median(moves), max(moves)
    print(
        f"slider over {samples} samples: median {1e3 * median:.0f} ms, worst {1e3 * worst:.0f} ms "
        f"of {MOVES} moves, limit {1e3 * LIMIT:.0f} ms"
    )
    return int(median > LIMIT)


if __name__ == "__main__":
    sys.exit(main())

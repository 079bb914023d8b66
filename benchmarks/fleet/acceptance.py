# SPDX-License-Identifier: MIT
"""Acceptance of a synthetic fleet: `python -m benchmarks.fleet.acceptance COUNT [FOLDER]`.

Every healthy log must be done and every damaged one reported; level, drift and spread over units of
μ and P0 must lie in their 95 % intervals. A run in the named folder is resumed; without a name it
is a temporary one.
"""

from __future__ import annotations

import resource
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

from drivetwin.cli.fleet import RunProgress
from drivetwin.fleet.coordinator import FleetRun, run_fleet
from drivetwin.fleet.estimate import estimate_fleet
from drivetwin.fleet.mixed import Interval, JointEstimate
from drivetwin.fleet.rules import Sources, read_rules
from drivetwin.fleet.store import Store
from drivetwin.fleet.task import Event, Settled, State
from tests.support.synthetic_fleet import (
    ELEMENT,
    ODOMETER,
    Ageing,
    Made,
    Truth,
    make_fleet,
    plan,
)


def run_made_fleet(folder: Path, store: Path) -> dict[str, Settled]:
    """Run the fleet; return the last event of each file, by its name."""
    settled: dict[str, Settled] = {}
    request = FleetRun(
        sources=Sources([str(folder)]),
        rules=read_rules(folder / "rules.toml"),
        store=store,
        quick=True,
    )
    started = perf_counter()
    progress = RunProgress()

    def hear(event: Event) -> None:
        progress.handle(event)
        if isinstance(event, Settled):
            settled[Path(event.path).name] = event

    summary = run_fleet(request, hear)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{summary.computed} logs computed in {perf_counter() - started:.0f} s, "
          f"coordinator at most {memory:.0f} MiB")  # fmt: skip
    return settled


def check_states(planned: Sequence[Made], settled: dict[str, Settled]) -> list[str]:
    """Return the faults of states: healthy logs not done, damaged ones without an error."""
    faults = []
    for made in planned:
        end = settled.get(Path(made.path).name)
        wanted = State.BAD if made.damage else State.DONE
        if end is None or end.state is not wanted or bool(end.error) is not bool(made.damage):
            faults.append(f"{made.path} ({made.damage or 'healthy'}): {end}")
    return faults


def _check_interval(label: str, true: float, ci95: Interval | None) -> list[str]:
    assert ci95 is not None
    held = ci95[0] <= true <= ci95[1]
    print(f"  {label}: true {true:.5g}, 95 % {ci95[0]:.5g} to {ci95[1]:.5g}"
          f"{'' if held else '  <-- outside'}")  # fmt: skip
    return [] if held else [f"{label}: {true:.5g} is outside {ci95[0]:.5g} to {ci95[1]:.5g}"]


def compare(one: JointEstimate, true: Ageing, planned: Sequence[Made], key: str) -> list[str]:
    """Print and check one parameter."""
    print(f"{one.parameter}: {one.logs} logs, scatter {one.excess:.2f} of what they state")
    (drift,) = one.drifts
    level = true.mean + true.drift * (drift.reference - 0.5 * ODOMETER)
    found = _check_interval("level", level, one.ci95)
    found += _check_interval("drift", true.drift, drift.ci95)
    found += _check_interval("spread", true.spread, one.spread_ci95)
    units = {made.unit: getattr(made, key) - true.drift * (made.odometer - 0.5 * ODOMETER)
             for made in reversed(planned)}  # fmt: skip
    reach = [
        abs(units[unit.unit] - true.mean - unit.deviation) <= 1.96 * unit.std for unit in one.units
    ]
    share = sum(reach) / len(reach)
    print(f"  units inside their 95 % intervals: {100 * share:.0f} %")
    return found + ([] if share >= 0.85 else [f"{one.parameter}: units {share:.2f}"])


def check(folder: Path, count: int) -> list[str]:
    """Make and run a fleet and return all faults."""
    truth, store = Truth(), folder / "store"
    planned = plan(count, truth)
    if not (folder / "truth.json").is_file():
        make_fleet(folder, count, truth)
    settled = run_made_fleet(folder, store)
    faults = check_states(planned, settled)
    print(Counter((made.damage or "healthy") for made in planned))
    with Store(store) as opened:
        found = estimate_fleet(opened)
    by_name = {one.parameter: one for one in found}
    faults += compare(by_name[f"mu.{ELEMENT}"], truth.mu, planned, "mu")
    faults += compare(by_name[f"P0.{ELEMENT}"], truth.P0, planned, "P0")
    return faults


def main() -> int:
    """Check as many logs as asked for."""
    count = int(sys.argv[1])
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(sys.argv[2] if len(sys.argv) > 2 else temporary) / f"fleet_{count}"
        faults = check(folder, count)
    for fault in faults[:20]:
        print(f"FAULT {fault}")
    print("all as it should be" if not faults else f"{len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())

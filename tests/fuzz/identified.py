# SPDX-License-Identifier: MIT
"""Changed logs through the whole identification: `python -m tests.fuzz.identified --count 2000`.

Each must end as a result or a typed error. A harmless change must leave the undamaged values within
the intervals of the result, and the new ones within those of the undamaged. A result of a damaged
log that is off without a word about it is `silent`; those are listed by kind of damage, since some
(a gain error) nothing in a log can show.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from drivetwin.dyno import ScenarioName
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import convert_channels, format_card, load_scenario
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.mechanism import quick
from drivetwin.logs.read import read_log
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import require_shifts
from drivetwin.twin.build import build_twin
from drivetwin.validation.simulate_log import attach_validation
from drivetwin.vehicle.card import load_card
from tests.fuzz import harness
from tests.fuzz.mutate import mutate
from tests.fuzz.tables import DAMAGING, HARMLESS, TIME, Table
from tests.support.arrays import FloatArray

SCENARIOS = (ScenarioName.PAPER_STEPS, ScenarioName.THROTTLE_STEPS, ScenarioName.GEARBOX_CHAIN)
STEP = 4e-3
"""Sampling time of the logs [s]; the engine torque stays at the bus's own rate."""
MARGIN = 0.25
"""So much before the torque phase and after lock-up [s] belongs to the shift."""
BYTES = "bytes"
"""The damage that is done to the file itself."""
AGE = "te_delay"
"""Delay of the engine torque; a delay changes this parameter itself."""


def table_of(name: ScenarioName) -> tuple[Table, str]:
    """A log of a built-in scenario as a table, and its vehicle card."""
    bench = run(load_scenario(name), seed=5)
    channels = convert_channels(bench)
    count = int(channels[0].time[-1] / STEP)
    time = np.linspace(0.0, STEP * (count - 1), count).round(6)
    columns: dict[str, FloatArray] = {TIME: time}
    units = {TIME: "s"}
    for one in channels:
        held = np.searchsorted(one.time, time + 1e-9, side="right") - 1
        columns[one.name] = one.values[np.clip(held, 0, None)]
        units[one.name] = one.unit or ""
    return Table(columns, units, ()), format_card(bench.scenario)


@dataclass(frozen=True)
class Base:
    """An undamaged log, its card, and what it gives."""

    table: Table
    card: Path
    found: Identification


def base(name: ScenarioName, folder: Path, is_quick: bool = True) -> Base:
    """Identify the undamaged log of a scenario."""
    table, text = table_of(name)
    card = folder / f"{name}.toml"
    card.write_text(text)
    found = identified(written(table, folder), card, is_quick)
    busy = tuple((s.before[1] - MARGIN, s.lockup_time + MARGIN) for s in found.shifts)
    return Base(replace(table, busy=busy), card, found)


def written(table: Table, folder: Path) -> Path:
    """The table as a file in `folder`."""
    path = folder / "log.csv"
    path.write_text(table.text(), encoding="utf-8")
    return path


def identified(log: Path, card: Path, is_quick: bool = True) -> Identification:
    """All that the command line does with a log, but the report; by default with `--quick`."""
    vehicle = load_card(card)
    recording = read_log(log, vehicle)
    with quick(is_quick):
        found = identify(recording, vehicle, require_shifts(recording, vehicle))
    return attach_validation(found, build_twin(found, vehicle), recording)


def moved(found: Identification, sound: Identification, limit: float = 1.0) -> list[str]:
    """Parameters that are gone, or whose undamaged value lies outside the damaged interval.

    `limit` widens the intervals, which those of the undamaged value add to.
    """
    names = []
    for name, true in sound.estimates.items():
        if true.value is None or not true.std_total:
            continue
        other = found.estimates.get(name)
        if other is None or other.value is None or other.std_total is None:
            names.append(name)
            continue
        half = 1.96 * float(np.hypot(other.std_total, (limit - 1.0) * true.std_total))
        if abs(other.value - true.value) > limit * half:
            names.append(name)
    return names


def parted(found: Identification, sound: Identification) -> set[str]:
    """Parameters of which either value lies outside the interval of the other."""
    return {*moved(found, sound), *moved(sound, found)}


def reports_damage(found: Identification, sound: Identification) -> bool:
    """Whether a result says more than that of the undamaged log, or refuses more."""

    def said(one: Identification) -> int:
        reasons = [e for e in one.estimates.values() if e.reason]
        return len(one.findings) + len(reasons)

    fewer = len(found.shifts) < len(sound.shifts) or found.method is not sound.method
    return fewer or said(found) > said(sound)


def harmless(is_quick: bool, folder: Path) -> Callable[[int], str]:
    """A harmless change by seed: whether the values hold."""
    bases = [base(name, folder, is_quick) for name in SCENARIOS]
    kinds = list(HARMLESS.items())

    def changed(seed: int) -> str:
        one, (kind, change) = bases[seed % len(bases)], kinds[seed % len(kinds)]
        table = change(one.table, np.random.default_rng(seed))
        try:
            found = identified(written(table, folder), one.card, is_quick)
        except DrivetwinError as refusal:
            return f"{kind}: {type(refusal).__name__}"
        return f"{kind}: holds" if not parted(found, one.found) else f"{kind}: moved"

    return changed


def damaged(is_quick: bool, folder: Path) -> Callable[[int], str]:
    """A damage by seed: a typed error, a result that says so, one that holds, or a silent one."""
    bases = [base(name, folder, is_quick) for name in SCENARIOS]
    kinds = [*DAMAGING, BYTES]

    def changed(seed: int) -> str:
        one, kind = bases[seed % len(bases)], kinds[seed % len(kinds)]
        try:
            found = identified(_damaged(one.table, kind, seed, folder), one.card, is_quick)
        except DrivetwinError as refusal:
            return f"{kind}: {type(refusal).__name__}"
        if reports_damage(found, one.found):
            return f"{kind}: reported"
        off = [name for name in moved(found, one.found, 2.0) if (kind, name) != ("late", AGE)]
        return f"{kind}: silent" if off else f"{kind}: holds"

    return changed


def _damaged(table: Table, kind: str, seed: int, folder: Path) -> Path:
    if kind != BYTES:
        return written(DAMAGING[kind](table, np.random.default_rng(seed)), folder)
    path = written(table, folder)
    path.write_bytes(mutate(path.read_bytes(), seed))
    return path


def by_kind(outcomes: Mapping[str, int]) -> str:
    """One line per kind of change."""
    lines: dict[str, list[str]] = {}
    for what, count in sorted(outcomes.items(), key=lambda item: -item[1]):
        kind, _, result = what.partition(": ")
        lines.setdefault(kind, []).append(f"{result} {count}")
    return "\n".join(f"  {kind}: {', '.join(parts)}" for kind, parts in sorted(lines.items()))


def main() -> int:
    """Fuzz with harmless changes and with damage; 1 on a fault or too many lost results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=2_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--whole", action="store_true", help="try all models, as without --quick")
    options = parser.parse_args()
    bad = 0
    for title, prepare in (("harmless", harmless), ("damaged", damaged)):
        tally = harness.run(partial(prepare, not options.whole), options.count, options.first)
        bad += len(tally.faults)
        print(f"{title}: {tally}\n{by_kind(tally.outcomes)}", flush=True)
        if prepare is harmless:
            holds = sum(n for what, n in tally.outcomes.items() if what.endswith(": holds"))
            share = holds / max(tally.outcomes.total(), 1)
            bad += share < 0.95
            print(f"  {100.0 * share:.1f} % hold", flush=True)
    return 1 if bad else 0


if __name__ == "__main__":
    multiprocessing.set_start_method("forkserver")
    sys.exit(main())

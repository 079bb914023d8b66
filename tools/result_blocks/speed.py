# SPDX-License-Identifier: MIT
"""Sections of docs/benchmarks.md, from benchmarks/results/speed.json."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping

from tools.result_blocks.origin import Raw, write_origin, write_table

_OURS, _C = "drivetwin", "hand-written C"
_ONE_STEP = "RK4, 1 ms, events located"
_SPAN = 1.5
"""Simulated time of CoupledClutches and of the stated shift [s]."""
_BATCH_LIMIT = 10.0
"""Runs per second over those of C, on the most threads."""
_HEAD = (
    *("program", "setting", "least ms", "median of rounds", "ratio to C"),
    *("max error", "events, s"),
)
Times = Mapping[tuple[str, str], float]
"""Seconds of a run by program and setting."""


def _write_group(group: str) -> Callable[[Raw], str]:
    def write(raw: Raw) -> str:
        base = _collect_times(raw).get((_C, _ONE_STEP))
        rows = [one for one in raw["entries"] if one["group"] == group]
        cells = []
        for one in rows:
            least, middle = min(one["seconds"]), statistics.median(one["seconds"])
            ratio = "" if base is None else f"{least / base:.3g}"
            error = f"{one['error']:.2g} {one['unit']}" if "error" in one else ""
            events = "" if one.get("events") is None else f"{one['events']:.1g}"
            times = (f"{1e3 * least:.4g}", f"{1e3 * middle:.4g}")
            cells.append((one["program"], one["setting"], *times, ratio, error, events))
        return write_table(_HEAD, cells)

    return write


def _collect_times(raw: Raw) -> Times:
    return {(one["program"], one["setting"]): min(one["seconds"]) for one in raw["entries"]}


def _write_limits(raw: Raw) -> str:
    """Write ratios with their limits; none without the C program."""
    times = _collect_times(raw)
    if (_C, _ONE_STEP) not in times:
        return "No ratios: the C program was not beside the repository.\n"
    base = times[_C, _ONE_STEP]
    ours = {setting: seconds for (program, setting), seconds in times.items() if program == _OURS}
    ready, whole = ours["in Rust, network ready"], ours["six-speed gearbox, all members, shift 2-3"]
    called = ours["called from Python, nine columns"]
    ratios = [
        ("one shift, network ready, over C", ready / base, 0.3),
        ("the same, first run of a network", ours["in Rust, first run of a network"] / base, 0.3),
        ("the same with 8 states, over C", ours["the shift with 8 states"] / base, 0.5),
        ("the same with 12 states, over C", ours["the shift with 12 states"] / base, 0.7),
        (
            "CoupledClutches per simulated second, over C's shift",
            ours["CoupledClutches, 1.5 s"] / _SPAN / base,
            2.5,
        ),
        (
            "gearbox with all members over the stated shift, per simulated second",
            whole / raw["gearbox_span"] / (ready / _SPAN),
            5.0,
        ),
        (
            "16 derivatives over a plain run, both from Python",
            ours["16 parameters, called from Python"] / called,
            4.0,
        ),
    ]
    rows = [
        (name, f"{ratio:.3g}", f"{limit:g}", "met" if ratio <= limit else "missed")
        for name, ratio, limit in ratios
    ]
    extra = 1e3 * (called - ours["in Rust, from the elements on"])
    return write_table(("ratio of least times", "", "limit", ""), rows) + (
        f"\nThe call from Python adds {extra:.2g} ms to a run from the elements on.\n"
    )


def _write_batch(raw: Raw) -> str:
    batch = raw["batch"]
    runs, seconds = batch["runs"], batch["seconds"]
    rows = []
    for program, by_threads in sorted(seconds.items(), reverse=True):
        for threads, passes in by_threads.items():
            least = min(passes)
            ratio = f"{min(seconds[_C][threads]) / least:.3g}" if _C in seconds else ""
            rows.append((program, threads, f"{runs / least:,.0f}", ratio))
    text = write_table(("program", "threads", "runs per second", "times C"), rows)
    text += f"\nLimit: {_BATCH_LIMIT:g} times C on two threads.\n"
    if "errors" in batch:
        text += (
            f"\nErrors of T_o over {runs} runs [N·m], against C at {batch['fine_steps']} steps per "
            "sample:\n\n"
        )
        text += write_table(
            ("program", "median", "99 %", "worst", "failed"),
            [
                (program, *(f"{one[name]:.2g}" for name in ("median", "99 %", "worst", "failed")))
                for program, one in sorted(batch["errors"].items(), reverse=True)
            ],
        )
    memory = [(name, f"{size:,.0f}") for name, size in batch["memory"].items()]
    return text + "\n" + write_table(("kept of a batch", "bytes per run"), memory)


def _write_instructions(raw: Raw) -> str:
    counts = raw["instructions"]
    if not counts:
        return "Not counted: valgrind was missing, or did not know all instructions of the build.\n"
    base = counts.get(_C)
    rows = [
        (program, f"{count:,}", f"{count / base:.3g}" if base else "")
        for program, count in sorted(counts.items(), reverse=True)
    ]
    return write_table(("program, first run", "instructions of one shift", "ratio"), rows)


def _write_growth(raw: Raw) -> str:
    rows = [
        (name, ", ".join(f"{size}: {1e6 * one:.3g}" for size, one in times.items()))
        for name, times in raw["growth"].items()
    ]
    return write_table(("growing number", "size: time of a run [µs]"), rows)


BLOCKS: dict[str, Callable[[Raw], str]] = {
    "origin": write_origin,
    "shift": _write_group("One shift"),
    "general": _write_group("Larger and other drivelines"),
    "derivatives": _write_group("Derivatives"),
    "limits": _write_limits,
    "batch": _write_batch,
    "instructions": _write_instructions,
    "growth": _write_growth,
}

# SPDX-License-Identifier: MIT
"""`drivetwin report`: path of an identification's report, and comparison of several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from drivetwin.cli.input_files import read_twin_log
from drivetwin.cli.output import show_step
from drivetwin.cli.requests.use import Report
from drivetwin.errors import InputError, Where
from drivetwin.report.blocks import Outcome
from drivetwin.report.comparison import Trial, build_comparison_page, simulate_trials
from drivetwin.report.html import save_page
from drivetwin.report.results import MadeResult, open_result
from drivetwin.shifts.detect import require_shifts
from drivetwin.twin.twin import Twin


def report(request: Report) -> Outcome:
    """Find the report of one result, or compare several."""
    sources, output = request.sources, request.output
    made = [source for source in sources if _is_result(source)]
    logs = [source for source in sources if not _is_result(source)]
    if not made:
        raise InputError(
            "this is no result of an identification",
            "name a folder that 'drivetwin identify -o' wrote, its result.json or its twin.toml",
            Where(file=str(sources[0])),
        )
    if len(sources) == 1:
        return _find_report(open_result(made[0]))
    _write_comparison(made, logs, request.channels, output)
    return Outcome((), {"report": output, "compared": made, "logs": logs}, [output])


def _is_result(source: Path) -> bool:
    """Return True if a command wrote a source; all others are read as logs."""
    return source.is_dir() or source.suffix in (".json", ".toml")


def _find_report(made: MadeResult) -> Outcome:
    """Return verdict and path of the report of a result."""
    verdict = made.build_verdict()
    if verdict is None:
        raise InputError(
            "a twin alone has nothing to be compared with",
            "name further twins, or logs to simulate",
            Where(file=str(made.file)),
        )
    page = made.find_page()
    words = {name: getattr(verdict, name) for name in ("status", "reason", "action")}
    document = {"report": page, "result": made.file, "verdict": words}
    return Outcome([verdict], document, lines=[str(page)])


def _write_comparison(
    made: Sequence[Path], logs: Sequence[Path], channels: Path | None, output: Path
) -> None:

    with show_step("reading"):
        opened = {name: open_result(source) for name, source in _assign_names(made).items()}
        candidates = [one.to_candidate(name) for name, one in opened.items()]
        twins = {name: one.load_twin() for name, one in opened.items()} if logs else {}
    trials = [trial for log in logs for trial in _simulate_trials(twins, log, channels)]
    with show_step(f"writing {output.name}"):
        save_page(output, build_comparison_page(candidates, trials))


_PLAIN_NAMES = ("result", "bus", "fit", "twin")
"""Names of files that do not name their origin."""


def _assign_names(made: Sequence[Path]) -> dict[str, Path]:
    """Name each source by its folder or file; number the names that occur twice."""
    plain = [
        source.parent if source.is_file() and source.stem in _PLAIN_NAMES else source
        for source in made
    ]
    names: dict[str, Path] = {}
    for place, source in zip(plain, made, strict=True):
        called = (place.resolve().name if place.is_dir() else place.stem) or str(source)
        name, number = called, 1
        while name in names:
            number += 1
            name = f"{called} {number}"
        names[name] = source
    return names


def _simulate_trials(twins: Mapping[str, Twin], log: Path, channels: Path | None) -> list[Trial]:
    """Every shift of a log by every twin; shifts are found with the ratios of the first."""
    recording, card = read_twin_log(next(iter(twins.values())), log, None, channels)
    with show_step(f"simulating {log.name}"):
        return simulate_trials(twins, recording, require_shifts(recording, card).shifts, log.name)

# SPDX-License-Identifier: MIT
"""`drivetwin report`: path of an identification's report, and comparison of several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin._util.outputs import PAGE
from drivetwin._util.request import Request, argument, output_file
from drivetwin.cli.arguments import REPORT, RESULT, mapping_option, read_twin_log
from drivetwin.cli.output import print_blocks, print_json, print_line, show_step
from drivetwin.errors import InputError, ResultFileError, Where

if TYPE_CHECKING:
    from drivetwin.report.find_reports import Candidate, Trial
    from drivetwin.twin.twin import Twin


class Report(Request, command="report"):
    """Arguments of `report`."""

    sources: tuple[Path, ...] = argument(
        "Folders of 'identify -o', result.json, twin.toml, or logs.", "SOURCE..."
    )
    output: Path = output_file(
        "Page with the comparison.", "FILE.html", PAGE, Path("comparison.html")
    )
    channels: Path | None = mapping_option()


def report(request: Report, *, as_json: bool) -> None:
    """Print the path of a report, or compare several identifications.

    For one folder or result.json, print the path of its report. For several, or a twin and logs,
    write a page that compares parameters, friction, and the simulation of each log by each twin.
    """
    sources, output = request.sources, request.output
    made = [source for source in sources if _is_identification(source)]
    logs = [source for source in sources if not _is_identification(source)]
    if not made:
        raise InputError(
            "this is no result of an identification",
            "name a folder that 'drivetwin identify -o' wrote, its result.json or its twin.toml",
            Where(file=str(sources[0])),
        )
    if len(sources) == 1:
        if made[0].suffix == ".toml":
            raise InputError(
                "a twin alone has nothing to be compared with",
                "name further twins, or logs to simulate",
                Where(file=str(made[0])),
            )
        _print_page_name(made[0], as_json=as_json)
        return
    _write_comparison(made, logs, request.channels, output)
    if as_json:
        print_json({"report": output, "compared": made, "logs": logs})
        return
    print_line(f"wrote {output}")


def _is_identification(source: Path) -> bool:
    """Return True if a source was written by an identification; all others are read as logs."""
    return source.is_dir() or source.suffix in (".json", ".toml")


def _print_page_name(source: Path, *, as_json: bool) -> None:
    """Print verdict and path of the report of an identification."""
    from drivetwin.files.result_file import load_result
    from drivetwin.report.model_verdict import build_verdict_block, explain_result

    result = source / RESULT if source.is_dir() else source
    content = load_result(result)
    page = result.with_name(REPORT)
    if not page.is_file():
        raise ResultFileError(
            f"{REPORT} is not in the folder of {result.name}",
            "write all three files again with 'drivetwin identify LOG --vehicle CARD -o DIR'",
            Where(file=str(page)),
        )
    verdict = explain_result(content)
    if as_json:
        print_json(
            {"report": page, "result": result, "inputs": content.inputs, "verdict": vars(verdict)}
        )
        return
    print_blocks([build_verdict_block(verdict)])
    print_line(str(page))


def _write_comparison(
    made: Sequence[Path], logs: Sequence[Path], channels: Path | None, output: Path
) -> None:
    from drivetwin.report.comparison import save_comparison

    names = _assign_names(made)
    with show_step("reading"):
        candidates = [_load_candidate(name, source) for name, source in names.items()]
        twins = {name: _load_twin(source) for name, source in names.items()} if logs else {}
    trials = [trial for log in logs for trial in _simulate_trials(twins, log, channels)]
    with show_step(f"writing {output.name}"):
        save_comparison(output, candidates, trials)


def _assign_names(made: Sequence[Path]) -> dict[str, Path]:
    """Name each source by its folder or file; number the names that occur twice."""
    plain = [
        (source if source.is_dir() or source.stem not in ("result", "twin") else source.parent)
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


def _load_candidate(name: str, source: Path) -> Candidate:
    from drivetwin.files.result_file import load_result
    from drivetwin.report.find_reports import Candidate

    if source.suffix == ".toml":
        return Candidate.from_twin(name, _load_twin(source))
    return Candidate.from_result(name, load_result(source / RESULT if source.is_dir() else source))


def _load_twin(source: Path) -> Twin:
    """Load the twin of a source: the file itself, or the twin file next to its result."""
    from drivetwin.cli.file_kinds import find_twin
    from drivetwin.files.twin_file import load_twin

    return load_twin(find_twin(source))


def _simulate_trials(twins: Mapping[str, Twin], log: Path, channels: Path | None) -> list[Trial]:
    """Every shift of a log by every twin; shifts are found with the ratios of the first."""
    from drivetwin.report.comparison import simulate_trials
    from drivetwin.shifts.detect import require_shifts

    recording, card = read_twin_log(next(iter(twins.values())), log, None, channels)
    with show_step(f"simulating {log.name}"):
        return simulate_trials(twins, recording, require_shifts(recording, card).shifts, log.name)

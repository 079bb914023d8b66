# SPDX-License-Identifier: MIT
"""`drivetwin fit MODEL LOG...`: identify any driveline from recordings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drivetwin._util.request import FileRole, Request, argument, input_file, option, output_folder
from drivetwin.cli.arguments import logs_argument
from drivetwin.cli.output import print_blocks, print_json, print_line, show_step

if TYPE_CHECKING:
    from drivetwin.files.fit_file import FitFile
    from drivetwin.findings import Finding
    from drivetwin.fit.fit import HeldOut
    from drivetwin.fit.recording import Recording
    from drivetwin.fit.result import ModelFit

RESULT, MODEL, REPORT = "fit.json", "model.toml", "report.html"
"""Files that `fit -o` writes."""


class Fit(Request, command="fit"):
    """Arguments of `fit`."""

    model: Path = argument(
        "Model file (TOML); see 'drivetwin schema model'.", "MODEL", role=FileRole.OTHER
    )
    logs: tuple[Path, ...] = logs_argument("Recordings of any format.")
    hold_out: tuple[Path, ...] = input_file(
        "Predict a recording with the fit.", metavar="LOG", default=()
    )
    seed: int = option("Seed of the draws of the search.", minimum=0, default=0)
    output: Path | None = output_folder("Folder for result, model and report.")


def fit(request: Fit, *, as_json: bool) -> None:
    """Identify the unknowns of a model of any driveline from recordings.

    The model file has the elements of the driveline, the columns of the log for its inputs and
    outputs, and the unknowns with first guess and prior. Print the values with intervals and
    verdicts, the agreement of simulation and recordings, and the findings. The fitted model is
    written as a model file.
    """
    from drivetwin.fit.fit import fit_network, predict
    from drivetwin.fit.model_file import format_model, read_model

    logs, hold_out = request.logs, request.hold_out
    network, channels = read_model(request.model)
    answer = _Answer([one.name for one in logs], request.describe_settings())
    with show_step(f"reading {len(logs)} recordings"):
        recordings = list(_read_recordings(answer, logs, network, channels))
        held = list(_read_recordings(answer, hold_out, network, channels))
    with show_step(f"fitting {network.name}"):
        answer.found = found = fit_network(network, recordings, seed=request.seed)
    with show_step("predicting"):
        names = [one.name for one in hold_out]
        answer.held_out = dict(zip(names, predict(found, held), strict=True))
    files: Sequence[Path] = ()
    if request.output is not None:
        files = _write_outputs(request.output, answer, format_model(found.fitted, channels))
    if as_json:
        print_json(answer.build_file().model_dump(mode="json", by_alias=True))
        return
    _print_answer(answer)
    for file in files:
        print_line(f"wrote {file}")


@dataclass(eq=False)
class _Answer:
    """Everything that the command found."""

    logs: Sequence[str]
    settings: Mapping[str, str]
    remarks: tuple[Finding, ...] = ()
    found: ModelFit | None = None
    held_out: Mapping[str, HeldOut] | None = None

    def build_file(self) -> FitFile:
        """Build the result file."""
        from drivetwin.files.fit_file import build_fit_file

        assert self.found is not None
        held_out = self.held_out or {}
        return build_fit_file(self.found, self.logs, held_out, self.remarks, self.settings)


def _read_recordings(
    answer: _Answer, logs: Sequence[Path], network: Any, channels: Any
) -> Iterator[Recording]:
    from drivetwin.fit.read import read_recording

    for log in logs:
        recording, findings = read_recording(log, network, channels)
        answer.remarks += findings
        yield recording


def _write_outputs(folder: Path, answer: _Answer, model: str) -> tuple[Path, ...]:
    """Write result, fitted model and report, all or none."""
    from drivetwin.cli.atomic_outputs import write_texts
    from drivetwin.report.fit import render_fit

    assert answer.found is not None
    held_out = answer.held_out or {}
    texts = {
        RESULT: answer.build_file().to_json(),
        MODEL: model,
        REPORT: render_fit(answer.found, answer.logs, held_out, answer.remarks),
    }
    return write_texts(folder, texts)


def _print_answer(answer: _Answer) -> None:
    from drivetwin.report.fit import build_fit_blocks

    assert answer.found is not None
    print_blocks(build_fit_blocks(answer.found, answer.logs, answer.held_out or {}, answer.remarks))

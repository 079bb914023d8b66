# SPDX-License-Identifier: MIT
"""`drivetwin fit MODEL LOG...`: identify any driveline from recordings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin._util.request import FileRole, Request, argument, input_file, option, output_folder
from drivetwin.cli.options import FIT_RESULT, MODEL, REPORT, logs_argument, strict_flag
from drivetwin.cli.output import show_step
from drivetwin.report.blocks import Outcome

if TYPE_CHECKING:
    from drivetwin.findings import Finding
    from drivetwin.fit.model_file import ModelChannels
    from drivetwin.fit.network_model import NetworkModel
    from drivetwin.fit.recording import Recording
    from drivetwin.fit.result import ModelFit


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
    strict: bool = strict_flag("the model is valid, limits included")
    output: Path | None = output_folder("Folder for result, model and report.")


def fit(request: Fit) -> Outcome:
    """Identify the unknowns of a model of any driveline from recordings.

    The model file has the elements of the driveline, the columns of the log for its inputs and
    outputs, and the unknowns with first guess and prior. Print the values with intervals and
    verdicts, the agreement of simulation and recordings, and the findings. The fitted model is
    written as a model file.
    """
    return fit_logs(request)[1]


def fit_logs(request: Fit) -> tuple[ModelFit, Outcome]:
    """Read the recordings, fit the model, predict what is held out, and write the result."""
    from drivetwin.cli.output import write_texts
    from drivetwin.files.fit_file import build_fit_file
    from drivetwin.fit.fit import fit_network, predict
    from drivetwin.fit.model_file import format_model, read_model
    from drivetwin.report.fit import build_fit_blocks, build_fit_page

    network, channels = read_model(request.model)
    with show_step(f"reading {len(request.logs)} recordings"):
        recordings, remarks = read_recordings(request.logs, network, channels)
        held, doubts = read_recordings(request.hold_out, network, channels)
    with show_step(f"fitting {network.name}"):
        found = fit_network(network, recordings, seed=request.seed)
    with show_step("predicting"):
        predicted = predict(found, held)
    logs = [one.name for one in request.logs]
    held_out = dict(zip((one.name for one in request.hold_out), predicted, strict=True))
    shown = (found, logs, held_out, (*remarks, *doubts))
    file = build_fit_file(*shown, request.describe_settings())
    texts = {FIT_RESULT: file.to_json(), MODEL: format_model(found.fitted, channels)}
    files: Sequence[Path] = ()
    if request.output is not None:
        files = write_texts(request.output, {**texts, REPORT: build_fit_page(*shown)})
    blocks = build_fit_blocks(*shown)
    return found, Outcome(blocks, file.to_document(), files, found.status.is_confirmed)


def read_recordings(
    logs: Sequence[Path], network: NetworkModel, channels: ModelChannels
) -> tuple[list[Recording], list[Finding]]:
    """Read recordings of a network; return also the findings of the reader."""
    from drivetwin.fit.read import read_recording

    read = [read_recording(log, network, channels) for log in logs]
    return [one for one, _ in read], [finding for _, some in read for finding in some]

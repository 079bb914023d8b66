# SPDX-License-Identifier: MIT
"""`drivetwin fit MODEL LOG...`: identify any driveline from recordings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from drivetwin.cli.options import FIT_RESULT, MODEL, REPORT
from drivetwin.cli.output import show_step, write_texts
from drivetwin.cli.requests.identification import Fit
from drivetwin.files.fit_file import build_fit_file
from drivetwin.findings import Finding
from drivetwin.fit.fit import fit_network, predict
from drivetwin.fit.model_file import ModelChannels, format_model, read_model
from drivetwin.fit.network_model import NetworkModel
from drivetwin.fit.read import read_recording
from drivetwin.fit.recording import Recording
from drivetwin.fit.result import ModelFit
from drivetwin.report.blocks import Outcome
from drivetwin.report.fit import build_fit_blocks, build_fit_page


def fit(request: Fit) -> Outcome:
    """Fit the model to the recordings, and write the result."""
    return fit_logs(request)[1]


def fit_logs(request: Fit) -> tuple[ModelFit, Outcome]:
    """Read the recordings, fit the model, predict what is held out, and write the result."""
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
    read = [read_recording(log, network, channels) for log in logs]
    return [one for one, _ in read], [finding for _, some in read for finding in some]

# SPDX-License-Identifier: MIT
"""Shifts behind an open converter whose map on the card is off at every point.

    python -m benchmarks.estimation.converter [--logs N] [--first SEED] [--error SHARE]

Logs are those of `drivetwin synth --scenario open_converter`. Each capacity and each torque ratio
above 1 on the card has an error of its own, normal with the standard deviation SHARE.
"""

from __future__ import annotations

import argparse
import json
import re
import tempfile
import time
import tomllib
from pathlib import Path

import numpy as np

from benchmarks.code_version import read_commit
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.result.estimate import Z95, Verdict
from drivetwin.logs.read import read_log
from drivetwin.shifts.detect import detect_shifts
from drivetwin.validation.validated_model import identify_validated
from drivetwin.vehicle.card import load_card
from tests.support.synth import synthesize

FAR = 4.0
"""Error in standard deviations from which a value is called far off."""


def disturb_map(card: Path, rng: np.random.Generator, error: float) -> None:
    """Write errors of the points of the converter's map into a card."""
    text = card.read_text()
    # The cards of `synth` state exact sensors; a map that is off is no exact torque.
    text = re.sub(r"(?ms)^\[sensors\.engine_torque\].*?(?=^\[|\Z)", "", text)
    table = tomllib.loads(text)["converter"]
    for key in ("torque_ratio", "pump_torque_at_1000rpm_Nm"):
        exact = [key == "torque_ratio" and one == 1.0 for one in table[key]]
        factors = np.where(exact, 1.0, 1.0 + error * rng.standard_normal(len(exact)))
        values = [float(f"{one:.6g}") for one in factors * np.array(table[key])]
        if key == "torque_ratio":
            values = [max(one, 1.0) for one in values]
        text = re.sub(rf"(?m)^{key} = \[[^\]]*\]", f"{key} = {values}", text)
    card.write_text(text)


def study_log(seed: int, error: float) -> dict[str, float]:
    """Identify one log and compare with its truth; errors in standard deviations by id."""
    with tempfile.TemporaryDirectory() as folder:
        path, card_path, truth_path = synthesize(Path(folder) / "log.csv", "open_converter", seed)
        truth = json.loads(truth_path.read_text())["parameters"]
        disturb_map(card_path, np.random.default_rng(seed), error)
        card = load_card(card_path)
        log = read_log(path, card)
        found = identify_validated(log, card, detect_shifts(log, card))
    errors = {}
    for name, one in found.estimates.items():
        if one.verdict is Verdict.IDENTIFIED and name in truth and one.std_total:
            assert one.value is not None
            errors[name] = (one.value - truth[name]["value"]) / one.std_total
    return errors


def main() -> None:
    """Run the study and print its counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=40)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--error", type=float, default=0.03)
    options = parser.parse_args()
    print(f"Code of commit {read_commit()}.")
    every: list[dict[str, float]] = []
    for seed in range(options.first, options.first + options.logs):
        start = time.process_time()
        try:
            errors = study_log(seed, options.error)
        except DrivetwinError as fault:
            errors = {}
            print(f"{seed}: {fault}")
        every.append(errors)
        outside = {name: round(one, 1) for name, one in errors.items() if abs(one) > Z95}
        seconds = time.process_time() - start
        print(f"{seed}: {len(errors)} identified, outside {outside}, {seconds:.0f} s", flush=True)
    values = np.abs([one for errors in every for one in errors.values()])
    kept = max(len(one) for one in every) * len(every)
    print(
        f"{np.count_nonzero(values <= Z95)} of {values.size} identified values inside, "
        f"{np.count_nonzero(values > FAR)} beyond {FAR:g} deviations; kept {values.size} of {kept}"
    )


if __name__ == "__main__":
    main()

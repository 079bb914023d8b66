# SPDX-License-Identifier: MIT
"""Tables of fit: percent, error in display units, and the phase that is missed."""

from __future__ import annotations

from drivetwin._util.display_units import RPM, format_significant
from drivetwin.estimation.result.estimate import SignalFit
from drivetwin.report.blocks import Tone
from drivetwin.report.sections.fits import build_fit_table, find_missed_phase
from drivetwin.validation.simulate_log import attach_fit
from tests.report.sample import identification, validation

WHOLE = SignalFit(rmse=1.0, fit_percent=92.7)


def test_fit_table_shows_percent_and_rmse_in_display_units() -> None:
    found = attach_fit(identification(), [validation()])
    speed = next(row for row in build_fit_table(found.fit).rows if row[0].text == "input speed")
    rmse = found.fit["input_speed"]["all"].rmse
    assert speed[1].note == f"{format_significant(rmse * RPM.factor, 3)} rpm"


def test_a_phase_that_the_simulation_misses_is_marked_despite_a_good_fit_of_the_whole() -> None:
    fits = {"all": WHOLE, "before": WHOLE, "inertia": SignalFit(3.7, 60.1)}
    (row,) = build_fit_table({"input_speed": fits}).rows
    marked = [cell.text for cell in row if cell.tone is Tone.DOUBTFUL]
    assert marked == ["60.1 %"]


def test_a_phase_in_which_little_moves_is_not_missed() -> None:
    fits = {"all": WHOLE, "before": SignalFit(1.1, 55.0), "inertia": WHOLE}
    assert find_missed_phase(fits) == ""
    assert find_missed_phase({**fits, "all": SignalFit(1.0, 70.0)}) == "all"

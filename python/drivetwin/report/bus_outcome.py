# SPDX-License-Identifier: MIT
"""Result of the bus logs of one vehicle with its names and remarks: blocks, page and file."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from drivetwin.bus.identify import BusIdentification, identify_bus
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import InputError
from drivetwin.files.bus_file import BusFile, build_bus_file
from drivetwin.findings import Finding
from drivetwin.report.blocks import Block, Section
from drivetwin.report.bus import (
    BusVerdict,
    build_bus_blocks,
    build_bus_sections,
    explain_bus_identification,
    render_bus,
)
from drivetwin.vehicle.ratio_card import RatioCard


@dataclass(frozen=True, eq=False)
class BusOutcome:
    """Result with the names of its logs and the remarks of the reader."""

    logs: tuple[str, ...]
    found: BusIdentification
    remarks: tuple[Finding, ...]

    def build_file(self, settings: Mapping[str, str] | None = None) -> BusFile:
        """Build the result file with the settings of the run."""
        return build_bus_file(self.found, self.logs, self.remarks, settings)

    @property
    def verdict(self) -> BusVerdict:
        """Verdict on the quantities."""
        return explain_bus_identification(self.found)

    def build_blocks(self) -> list[Block]:
        """Build the blocks of the terminal."""
        return build_bus_blocks(self.found, self.remarks)

    def build_sections(self) -> list[Section]:
        """Build the sections of the report and of the workbench."""
        return build_bus_sections(self.found, self.remarks)

    def render(self, library: str | None = None) -> str:
        """Render the report as HTML, with plotly.js inside or in the file `library`."""
        return render_bus(self.found, self.logs, self.remarks, library)


def identify_vehicle(
    logs: Sequence[ShiftLog], card: RatioCard | None, held: Collection[int] = ()
) -> BusOutcome:
    """Identify one vehicle from its bus logs.

    Parameters
    ----------
    logs : logs of the vehicle
    card : ratios of the gears; None to take them from the speeds
    held : indices of the logs whose decays are predicted by the others

    Raises
    ------
    InputError
        If no log is left to identify.
    NoShiftError
        If no gear is held for long enough.
    """
    fitted = [log for k, log in enumerate(logs) if k not in held]
    if not fitted:
        raise InputError("all logs are held out", "leave at least one to identify")
    found = identify_bus(fitted, card, [log for k, log in enumerate(logs) if k in held])
    remarks = tuple(dict.fromkeys(one for log in logs for one in log.findings))
    return BusOutcome(tuple(Path(log.source).name for log in logs), found, remarks)

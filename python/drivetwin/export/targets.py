# SPDX-License-Identifier: MIT
"""Export targets of a twin and the closed sets of their options.

The command line imports them before anything numerical.
"""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Self

from drivetwin._util.request import REQUIRED, Request, input_file, option


class Names(StrEnum):
    """drivetwin's own ids, or what Simscape Driveline blocks call the same."""

    DRIVETWIN = "drivetwin"
    SIMSCAPE = "simscape"


class FmiVersion(StrEnum):
    """Version of FMI."""

    FMI2 = "2.0"
    FMI3 = "3.0"


class Platform(StrEnum):
    """A platform by its name on the command line."""

    LINUX = "linux"
    WINDOWS = "windows"
    MACOS = "macos"
    MACOS_ARM = "macos-arm"

    @property
    def suffix(self) -> str:
        """File name suffix of a shared library."""
        return {Platform.LINUX: ".so", Platform.WINDOWS: ".dll"}.get(self, ".dylib")


DEFAULT_STEP = 1e-3
"""Default communication step [s]: the sampling interval of pressure signals."""


class InputKind(StrEnum):
    """Interpolation of inputs between two communication points."""

    LINEAR = "linear"
    HOLD = "hold"


class Target(StrEnum):
    """A format of the twin for other programs: its name, and a label and a text for people.

    `ending` is that of its files, by default the name.
    """

    label: str
    text: str
    ending: str

    C = "c", "C sources", "C99 model of the shift for a controller, as an archive"
    FMU = "fmu", "FMU", "co-simulation, sources inside"
    MODELICA = "modelica", "Modelica", "the shift in components of the Standard Library", "mo"
    SSV = "ssv", "SSV", "parameter values for SSP and FMUs"
    CDFX = "cdfx", "CDFX", "calibration data, ASAM CDF"
    DCM = "dcm", "DCM", "calibration data, ETAS DAMOS"
    M = "m", "MATLAB", "script with all parameters"
    CSV = "csv", "CSV", "parameters with units and intervals as a table"

    @property
    def is_model(self) -> bool:
        """True for a model of the shift, false for a parameter file."""
        return self in (Target.C, Target.FMU, Target.MODELICA)

    def __new__(cls, value: str, label: str = "", text: str = "", ending: str = "") -> Self:
        """Make a member of its name on the command line and the words for it."""
        member = str.__new__(cls, value)
        member._value_ = value
        member.label, member.text, member.ending = label, text, ending or value
        return member


class ExportOptions(Request):
    """Target of an export and its options."""

    to: Target = option("Format of the export.", default=REQUIRED)
    names: Names = option(
        "For parameter files: naming convention of the parameters.", default=Names.DRIVETWIN
    )
    template: Path | None = input_file(
        "For parameter files: template with labels, units, axes and breakpoints (TOML)."
    )
    fmi: FmiVersion = option("For fmu: version of the standard.", default=FmiVersion.FMI2)
    platforms: tuple[Platform, ...] = option(
        "For fmu: target platform, built by zig; repeatable.", "--platform", default=()
    )

# SPDX-License-Identifier: MIT
"""Export targets of a twin and the closed sets of their options.

The command line imports them before anything numerical.
"""

from __future__ import annotations

from enum import StrEnum


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
    """A form of the twin for other programs."""

    C = "c"
    FMU = "fmu"
    MODELICA = "modelica"
    SSV = "ssv"
    CDFX = "cdfx"
    DCM = "dcm"
    M = "m"
    JSON = "json"
    CSV = "csv"

    @property
    def ending(self) -> str:
        """Ending of its files."""
        return "mo" if self is Target.MODELICA else self.value

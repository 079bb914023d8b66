# SPDX-License-Identifier: MIT
"""Exported text through an independent Modelica compiler, with `library.mo` as its library."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rumoca

from tests.support.arrays import FloatArray

_LIBRARY = Path(__file__).with_name("library.mo")
TOLERANCE = 1e-10


def run(
    text: str,
    time: FloatArray,
    variables: Sequence[str],
    folder: Path,
    tolerance: float = TOLERANCE,
) -> dict[str, FloatArray]:
    """Simulate the model `Shift` of a package and return variables of its driveline on `time`."""
    package = text.split(maxsplit=2)[1]
    file = folder / "package.mo"
    file.write_text(_LIBRARY.read_text("utf-8") + "\n" + text, "utf-8")
    model = rumoca.Session().load(str(file), model=f"{package}.Shift")
    result = model.simulate(
        t=(float(time[0]), float(time[-1])),
        dt=float(time[1] - time[0]),
        config=rumoca.SimConfig(rtol=tolerance, atol=tolerance),
    )
    instants = np.asarray(result.time)
    return {
        name: np.interp(time, instants, np.asarray(result[f"driveline.{name}"]))
        for name in variables
    }

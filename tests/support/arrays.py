# SPDX-License-Identifier: MIT
"""Types of arrays in the signatures of tests."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]

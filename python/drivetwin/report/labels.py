# SPDX-License-Identifier: MIT
"""How parameters are called in tables and figures."""

from __future__ import annotations

from drivetwin.parameters import spec_of


def parameter_label(parameter_id: str) -> str:
    """Symbol with the gear or element it belongs to, e.g. `J′ (2)`."""
    spec = spec_of(parameter_id)
    suffix = parameter_id.removeprefix(spec.stem).lstrip("_.")
    return f"{spec.symbol} ({suffix})" if suffix else spec.symbol

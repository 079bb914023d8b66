# SPDX-License-Identifier: MIT
"""Sections of docs/benchmarks-pipeline.md, from benchmarks/results/pipeline.json."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from tools.result_blocks.origin import Raw, write_origin, write_table


def _write_commands(raw: Raw) -> str:
    head = ("command", "CPU s", "GB", "other program s", "ratio", "limit", "")
    return write_table(head, map(_write_command, raw["commands"]))


def _write_command(one: Mapping[str, Any]) -> tuple[str, ...]:
    seconds, peer, limit = one["seconds"], one["peer"], one["ratio_limit"]
    ratio = None if peer is None else seconds / peer
    met = seconds <= one["limit"] and (ratio is None or limit is None or ratio <= limit)
    return (
        one["name"],
        f"{seconds:.2f}",
        f"{one['memory']:.2f}",
        "–" if peer is None else f"{peer:.2f}",
        "–" if ratio is None else f"{ratio:.1f}",
        f"{one['limit']:g} s" + (f", {limit:g} ×" if limit else ""),
        "met" if met else "missed",
    )


def _write_profiles(raw: Raw) -> str:
    profiled = [one for one in raw["commands"] if one["profile"]]
    return "\n".join(f"{one['name']}:\n\n```text\n{one['profile']}```\n" for one in profiled)


BLOCKS: dict[str, Callable[[Raw], str]] = {
    "origin": write_origin,
    "commands": _write_commands,
    "profiles": _write_profiles,
}

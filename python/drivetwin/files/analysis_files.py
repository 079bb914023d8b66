# SPDX-License-Identifier: MIT
"""Files of what was asked about an identification: experiments, profiles and the like; SI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict

from drivetwin._util.plain_values import format_json
from drivetwin.estimation.analysis.friction_shape import ShapedFriction
from drivetwin.estimation.analysis.profile_likelihood import Profile
from drivetwin.estimation.result.estimate import ExperimentRanking
from drivetwin.files.records import FrictionRecord, SuggestionRecord
from drivetwin.fit.examine import REPEATS, Improvement


def format_suggestions(found: tuple[ExperimentRanking, ...]) -> str:
    """`suggestions.json`: by parameter the experiments in order of worth; infinite widths null."""
    rows = [SuggestionRecord.from_result(one).model_dump(mode="json") for one in found]
    return format_json({"suggestions": rows})


def format_improvements(found: Sequence[Improvement], units: Mapping[str, str]) -> str:
    """`suggestions.json` of a fit: half widths of the intervals, and what would narrow them."""
    rows = [{**asdict(one), "repeats": REPEATS, "unit": units[one.unknown]} for one in found]
    return format_json({"suggestions": rows})


def format_profile(one: Profile, unit: str) -> str:
    """`profile.<parameter>.json`: rise of Q over the parameter, and both intervals."""
    return format_json(
        {
            "parameter": one.parameter,
            "unit": unit,
            "estimate": one.estimate,
            "ci95_profile": one.interval,
            "ci95_linear": one.linear,
            "values": one.values,
            "rise": one.rise,
        }
    )


def format_friction(one: ShapedFriction) -> str:
    """`friction.json`: μ over slip of the shape asked for, by element, with its 95 % band."""
    curves = {
        name: FrictionRecord.from_result(curve).model_dump(mode="json")
        for name, curve in one.curves.items()
    }
    return format_json({"shape": one.shape, "gain": one.gain, "bend": one.bend, "friction": curves})

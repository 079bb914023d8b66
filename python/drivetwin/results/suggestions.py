# SPDX-License-Identifier: MIT
"""Records of the experiments that would narrow a parameter, by the parameter; SI."""

from __future__ import annotations

from drivetwin.identify.experiment.catalogue import Experiment
from drivetwin.identify.experiment.suggest import Suggestion
from drivetwin.identify.result import Verdict
from drivetwin.parameters import spec_of
from drivetwin.results.records import OptionalFloat, Record


class ProspectRecord(Record):
    """What an experiment, so many times repeated, would make of the 95 % half width.

    `shift` is the shift of the log that it is built on, by its gears; empty where all are alike.
    """

    experiment: Experiment
    repeats: int
    half_width: OptionalFloat
    verdict: Verdict
    shift: str = ""


class SuggestionRecord(Record):
    """A parameter, its 95 % half width now (null where open), and all experiments by their worth.

    `text` names the best one, or says that none helps or why.
    """

    parameter: str
    unit: str
    verdict: Verdict
    half_width: OptionalFloat
    text: str
    experiments: list[ProspectRecord]

    @classmethod
    def of(cls, one: Suggestion) -> SuggestionRecord:
        """Record of a suggestion."""
        return cls(
            parameter=one.parameter,
            unit=spec_of(one.parameter).unit,
            verdict=one.verdict,
            half_width=one.half_width,
            text=one.text,
            experiments=[ProspectRecord(**vars(each)) for each in one.prospects],
        )

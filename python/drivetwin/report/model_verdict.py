# SPDX-License-Identifier: MIT
"""Verdict on a model in words: what report, terminal and workbench open with."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from drivetwin._util.display_units import format_significant
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.estimation.result.verdict import get_experiment
from drivetwin.files.result_file import ResultFile
from drivetwin.findings import Code, Finding, Severity, explain, report
from drivetwin.report.blocks import Tone, VerdictBlock
from drivetwin.report.figure import get_channel_label, get_parameter_name

STATUS_TONES = {
    ModelStatus.VALID: Tone.GOOD,
    ModelStatus.LIMITED: Tone.DOUBTFUL,
    ModelStatus.NOT_VALID: Tone.BAD,
    ModelStatus.NOT_VALIDATED: Tone.DOUBTFUL,
}
"""Colours of the statuses."""
_SHOWN = 2
"""Number of experiments, or of suspected entries of the card, that an action names."""

_USE = (
    "Use the model within the range that the log covers, and confirm it on a log that was not "
    "fitted."
)
_EFFECTS = {
    Code.EFFECT_FOUND: "shows an effect that the simulation lacks",
    Code.EFFECT_POSSIBLE: "may show an effect that the simulation lacks",
    Code.EFFECT_RESEMBLED: "shows something that resembles an effect, which does not explain it",
}
"""Findings of effects, as the begin of a sentence."""
_LISTED = 4
"""Number of parameters that a sentence names."""


@dataclass(frozen=True)
class ModelVerdict:
    """Status of a model with its `reason` and the next `action`, one or two sentences each."""

    status: ModelStatus
    reason: str
    action: str

    @property
    def text(self) -> str:
        """Reason and action."""
        return f"{self.reason} {self.action}"


def build_verdict_block(verdict: ModelVerdict) -> VerdictBlock:
    """Build the verdict on a model: status in its colour, reason and next action."""
    tone = STATUS_TONES[verdict.status]
    return VerdictBlock(verdict.status.value, verdict.reason, verdict.action, tone)


def explain_identification(found: Identification) -> ModelVerdict:
    """Explain the status of an identification."""
    percent = {
        signal: fits["all"].fit_percent for signal, fits in found.fit.items() if "all" in fits
    }
    return _explain(found.status, found.findings, found.estimates, percent)


def explain_result(content: ResultFile) -> ModelVerdict:
    """Explain the status in a result file."""
    percent = {
        signal: fits["all"].fit_percent
        for signal, fits in content.fit.items()
        if "all" in fits and fits["all"].fit_percent is not None
    }
    findings = [one.to_finding() for one in content.findings]
    estimates = {name: one.to_estimate(name) for name, one in content.parameters.items()}
    return _explain(content.status, findings, estimates, percent)


def _explain(
    status: ModelStatus,
    findings: Sequence[Finding],
    estimates: Mapping[str, Estimate],
    percent: Mapping[str, float],
) -> ModelVerdict:
    """Explain a status; `percent` is the fit of the whole simulation by signal [%]."""
    match status:
        case ModelStatus.VALID:
            reason, action = _praise(percent), _USE
        case ModelStatus.LIMITED:
            reason, action = _explain_limits(findings, estimates, percent)
        case ModelStatus.NOT_VALID:
            reason, action = _explain_failure(findings)
        case ModelStatus.NOT_VALIDATED:
            reason, action = _explain_gap(findings, estimates)
    return ModelVerdict(status, reason, action)


def _praise(percent: Mapping[str, float]) -> str:
    followed = "Driven by the measured inputs alone, the simulation follows the measurement"
    for signal, fit in percent.items():
        return f"{followed} ({get_channel_label(signal)}: fit {format_significant(fit, 3)} %)."
    return f"{followed}."


def _explain_limits(
    findings: Sequence[Finding], estimates: Mapping[str, Estimate], percent: Mapping[str, float]
) -> tuple[str, str]:
    """Name what limits the use of a model that follows the measurement, the gravest first."""
    grave = next((one for one in findings if _limits_use(one)), None)
    if grave is not None:
        return _name_cause(grave), grave.remedy or "Read the findings before use."
    if any(one.reason == explain(Code.NO_TORQUE_SCALE) for one in estimates.values()):
        scale = report(Code.NO_TORQUE_SCALE)
        return f"{_praise(percent)} {scale.cause}", scale.remedy
    open_ids = _select_ids(estimates, Verdict.NOT_IDENTIFIABLE)
    weak_ids = _select_ids(estimates, Verdict.WEAK)
    parts = [
        f"{_list_names(ids)} {word}"
        for ids, word in ((open_ids, "not identifiable from this log"), (weak_ids, "weak"))
        if ids
    ]
    if not parts:
        return _praise(percent), "Read the findings before use."
    experiments = _advise_experiments((*open_ids, *weak_ids))
    reason = f"{_praise(percent)[:-1]}, but {' and '.join(parts)}."
    return reason, f"Use the other values. To determine the rest, {experiments}"


def _limits_use(one: Finding) -> bool:
    """Return whether a finding on the whole model limits its use."""
    wide = (*_EFFECTS, Code.FRICTION_IMPLAUSIBLE, Code.SIMULATION_NOISY)
    return one.severity is Severity.ERROR or one.code in wide


def _name_cause(one: Finding) -> str:
    if one.code in _EFFECTS:
        return f"The log {_EFFECTS[one.code]}: {one.names['effect']} ({one.names['size']})."
    return _lead(one)


def _lead(one: Finding) -> str:
    """Cause of a finding, after its subject."""
    return one.cause if one.subject in one.cause else f"{one.subject}: {one.cause}"


def _explain_failure(findings: Sequence[Finding]) -> tuple[str, str]:
    """Name the first error and the entries of the card that are most likely wrong."""
    errors = [one for one in findings if one.severity is Severity.ERROR]
    cause = _lead(errors[0]) if errors else "The simulation does not follow the measurement."
    suspects = [one.names["entry"] for one in findings if one.code is Code.CARD_SUSPECT]
    suspects += [
        f"gain of {one.names['element']}, whose friction the log does not determine"
        for one in findings
        if one.code is Code.GAIN_NOT_DETERMINED
    ]
    if suspects:
        action = f"Check first: {'; '.join(suspects[:_SHOWN])}. Then identify again."
    elif errors and errors[0].code is not Code.SIMULATION_MISSES and errors[0].remedy:
        action = errors[0].remedy
    else:
        action = "Compare simulation and measurement in the plots, then check sensors and card."
    return f"{cause} No value counts as identified.", action


def _explain_gap(findings: Iterable[Finding], estimates: Mapping[str, Estimate]) -> tuple[str, str]:
    """Name why the model was not simulated: the parameters that it lacks, or another cause."""
    why = next((one.names["why"] for one in findings if one.code is Code.NOT_VALIDATED), "")
    reason = "The model was not simulated over the log, so nothing confirms its values"
    lacking = [one for one in _select_ids(estimates, Verdict.NOT_IDENTIFIABLE) if one in why]
    if lacking:
        action = f"Take no value as proven. To complete it, {_advise_experiments(lacking)}"
        return f"{reason}: {_list_names(lacking)} not identifiable from this log.", action
    action = "Take no value as proven; complete log or vehicle card and identify again."
    return f"{reason}: {why}." if why else f"{reason}.", action


def _select_ids(estimates: Mapping[str, Estimate], verdict: Verdict) -> tuple[str, ...]:
    return tuple(name for name, one in estimates.items() if one.verdict is verdict)


def _list_names(ids: Sequence[str]) -> str:
    """List names as the subject of a sentence, with its verb."""
    names = [get_parameter_name(one) for one in ids]
    names = [f"{one[0].lower()}{one[1:]}" for one in names]
    if len(names) > _LISTED:
        names = [*names[: _LISTED - 1], f"{len(names) - _LISTED + 1} others"]
    if len(names) == 1:
        return f"{names[0]} is"
    return f"{', '.join(names[:-1])} and {names[-1]} are"


def _advise_experiments(ids: Sequence[str]) -> str:
    """Name the recordings that would determine parameters, each once, as the end of a sentence."""
    texts = list(dict.fromkeys(map(get_experiment, ids)))[:_SHOWN]
    return "; ".join(f"{text[0].lower()}{text[1:].removesuffix('.')}" for text in texts) + (
        "." if texts else ""
    )

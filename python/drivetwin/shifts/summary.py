# SPDX-License-Identifier: MIT
"""Summary of the shifts of a drive by kind and pair of gears, and comparison of two drives."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.findings import Code, Finding
from drivetwin.shifts.detect import FoundShifts
from drivetwin.shifts.shift import RejectedShift, Shift
from drivetwin.vehicle.spec import ShiftKind

LEVEL = 0.05
"""Probability of a false alarm of each test, corrected for the number of tests made together."""
_FEWEST_FOR_OUTLIERS = 15
"""Fewest values of the outlier test: Rosner states its level from there on."""
_FEWEST = 4
"""Fewest values in each group: with three against three no rank test reaches the level."""


@dataclass(frozen=True)
class Trend:
    """Slope of a figure over time, in its unit per s, with its 95 % interval and p-value."""

    slope: float
    interval: tuple[float, float]
    p: float


@dataclass(frozen=True)
class Difference:
    """Typical difference of a second group from a first, with its 95 % interval and p-value."""

    shift: float
    interval: tuple[float, float]
    p: float


def find_outliers(values: FloatArray) -> tuple[int, ...]:
    """Find outliers by the generalised extreme Studentized deviate.

    Parameters
    ----------
    values : figures (n,); where all are positive the test is made on their logarithms, since
        durations and jerks are skewed

    Returns
    -------
    tuple of int
        Indices of the outliers, the farthest first; none for fewer than 15 values. At most a tenth
        of the values.

    Source: Rosner, Technometrics 25 (1983) 165.
    """
    from scipy.stats import t

    count = len(values)
    if count < _FEWEST_FOR_OUTLIERS:
        return ()
    left = np.log(values) if np.all(values > 0.0) else np.asarray(values, dtype=np.float64)
    left = left.copy()
    removed: list[int] = []
    found = 0
    for done in range(max(1, count // 10)):
        rest = count - done
        deviation = np.abs(left - np.nanmean(left))
        spread = float(np.nanstd(left, ddof=1))
        if not spread > 0.0:
            break
        farthest = int(np.nanargmax(deviation))
        quantile = float(t.ppf(1.0 - LEVEL / (2.0 * rest), rest - 2))
        limit = (rest - 1) * quantile / math.sqrt((rest - 2 + quantile**2) * rest)
        removed.append(farthest)
        if deviation[farthest] > limit * spread:
            found = len(removed)
        left[farthest] = np.nan
    return tuple(removed[:found])


def estimate_trend(time: FloatArray, values: FloatArray) -> Trend | None:
    """Estimate the slope of a figure over time.

    Parameters
    ----------
    time : times (n,) [s]
    values : figures (n,)

    Returns
    -------
    Trend or None
        Median of the slopes of all pairs; the p-value is that of Kendall's rank correlation. None
        for fewer than 4 values, or equal values.

    Source: Sen, J. Am. Stat. Assoc. 63 (1968) 1379.
    """
    from scipy.stats import kendalltau, theilslopes

    if len(values) < _FEWEST or np.ptp(values) == 0.0 or np.ptp(time) == 0.0:
        return None
    slope, _, low, high = theilslopes(values, time, 1.0 - LEVEL)
    p = float(kendalltau(time, values).pvalue)
    return Trend(float(slope), (float(low), float(high)), p)


def compare_groups(first: FloatArray, second: FloatArray) -> Difference | None:
    """Compare a figure of two groups of shifts.

    Parameters
    ----------
    first, second : figures (m,), (n,)

    Returns
    -------
    Difference or None
        Median of all differences of a value in `second` from one in `first`; its interval and the
        p-value are those of the rank-sum test. None for fewer than 4 values in a group.

    Source: Hodges and Lehmann, Ann. Math. Stat. 34 (1963) 598; Hollander, Wolfe, Chicken,
    Nonparametric Statistical Methods (2014), section 4.3.
    """
    from scipy.stats import mannwhitneyu, norm

    m, n = len(first), len(second)
    if min(m, n) < _FEWEST:
        return None
    differences = np.sort((second[:, None] - first[None, :]).ravel())
    half = float(norm.ppf(1.0 - LEVEL / 2.0)) * math.sqrt(m * n * (m + n + 1) / 12.0)
    outside = max(0, math.floor(0.5 * m * n - half))
    p = float(mannwhitneyu(first, second).pvalue)
    interval = (float(differences[outside]), float(differences[-1 - outside]))
    return Difference(float(np.median(differences)), interval, p)


def adjust_p_values(values: Sequence[float]) -> tuple[float, ...]:
    """Adjust the p-values of tests made together so that none is a false alarm by their number.

    Parameters
    ----------
    values : p-values

    Returns
    -------
    tuple of float
        Adjusted p-values in the order of `values`.

    Source: Holm, Scand. J. Stat. 6 (1979) 65.
    """
    order = sorted(range(len(values)), key=lambda index: values[index])
    adjusted, largest = [0.0] * len(values), 0.0
    for rank, index in enumerate(order):
        largest = max(largest, min(1.0, (len(values) - rank) * values[index]))
        adjusted[index] = largest
    return tuple(adjusted)


SUMMARIZED = (
    "shift_time",
    "inertia_phase_time",
    "response_time",
    "flare_speed",
    "wheel_jerk_max",
    "wheel_jerk_of_speed_max",
    "vibration_dose",
)
"""Figures of `QUALITY_UNITS` that are summarised; the largest is the worst."""


@dataclass(frozen=True)
class Outlier:
    """Figure of an outlying shift in its SI unit, and the time of its lock-up [s]."""

    time: float
    value: float


@dataclass(frozen=True)
class FigureSummary:
    """Distribution of one figure over `count` shifts in its SI unit.

    `low` and `high` contain the middle 80 %; `worst_time` is the lock-up of the worst [s].
    `trend` over time has a p-value adjusted for all trends of the drive. It and `outliers` are
    given for one pair of gears, since shifts of different gears differ.
    """

    count: int
    mean: float
    median: float
    low: float
    high: float
    worst: float
    worst_time: float
    outliers: tuple[Outlier, ...] = ()
    trend: Trend | None = None


@dataclass(frozen=True)
class ShiftGroup:
    """`count` shifts of one kind, in one pair of `gears` (`2→3`) or, if None, in all of them."""

    kind: ShiftKind
    gears: str | None
    count: int
    figures: dict[str, FigureSummary]


def summarize_shifts(shifts: Sequence[Shift]) -> tuple[ShiftGroup, ...]:
    """Group shifts by kind, each followed by its pairs of gears where there are several."""
    groups = []
    for kind in ShiftKind:
        pairs = {gears: alike for (own, gears), alike in _split(shifts).items() if own is kind}
        if len(pairs) > 1:
            groups.append(_summarize_group(kind, None, [one for one in shifts if one.kind is kind]))
        groups += [_summarize_group(kind, gears, pairs[gears]) for gears in sorted(pairs)]
    return _adjust_trends(groups)


def _split(shifts: Sequence[Shift]) -> Mapping[tuple[ShiftKind, str], list[Shift]]:
    """Shifts by kind and pair of gears."""
    found: dict[tuple[ShiftKind, str], list[Shift]] = {}
    for one in shifts:
        found.setdefault((one.kind, one.name), []).append(one)
    return found


def _summarize_group(kind: ShiftKind, gears: str | None, shifts: Sequence[Shift]) -> ShiftGroup:
    figures = {}
    for name in SUMMARIZED:
        found = [(one.quality[name], one.lockup_time) for one in shifts if name in one.quality]
        if not found:
            continue
        values, times = np.array(found).T
        low, median, high = np.quantile(values, (0.1, 0.5, 0.9))
        worst, when = max(found)
        summary = FigureSummary(
            *(len(found), float(values.mean())),
            *(float(median), float(low), float(high), worst, when),
        )
        if gears is not None:
            outliers = tuple(
                Outlier(float(times[index]), float(values[index]))
                for index in sorted(find_outliers(values))
            )
            summary = replace(summary, outliers=outliers, trend=estimate_trend(times, values))
        figures[name] = summary
    return ShiftGroup(kind, gears, len(shifts), figures)


def _adjust_trends(groups: Sequence[ShiftGroup]) -> tuple[ShiftGroup, ...]:
    """Adjust the p-values of all trends for their number."""
    trends = [one.trend for group in groups for one in group.figures.values() if one.trend]
    adjusted = iter(adjust_p_values([one.p for one in trends]))
    return tuple(
        replace(
            group,
            figures={
                name: replace(one, trend=replace(one.trend, p=next(adjusted))) if one.trend else one
                for name, one in group.figures.items()
            },
        )
        for group in groups
    )


@dataclass(frozen=True)
class FigureComparison:
    """One figure of the shifts of one kind and pair of gears in two drives, in its SI unit.

    `counts` and `medians` of the first and the second. `difference` has a p-value adjusted for all
    comparisons of the two drives; None with too few shifts.
    """

    kind: ShiftKind
    gears: str
    figure: str
    counts: tuple[int, int]
    medians: tuple[float, float]
    difference: Difference | None

    @property
    def differs(self) -> bool | None:
        """True where the drives differ, False where that is not shown, None with too few shifts."""
        return None if self.difference is None else self.difference.p < LEVEL


FiguresByKind = Mapping[tuple[ShiftKind, str, str], FloatArray]
"""Values (n,) of figures of shift quality in SI by kind, pair of gears and name of the figure."""


def compare_drives(first: Sequence[Shift], second: Sequence[Shift]) -> tuple[FigureComparison, ...]:
    """Compare the shift quality of two vehicles or software states.

    Parameters
    ----------
    first, second : shifts of one drive or of several

    Returns
    -------
    tuple of FigureComparison
        One for each figure of the shifts of a kind and pair of gears that both have, with p-values
        adjusted for their number.
    """
    return adjust_comparisons(compare_figures(_collect_figures(first), _collect_figures(second)))


def _collect_figures(shifts: Sequence[Shift]) -> FiguresByKind:
    return {
        (kind, gears, name): np.array([one.quality[name] for one in alike if name in one.quality])
        for (kind, gears), alike in _split(shifts).items()
        for name in SUMMARIZED
        if any(name in one.quality for one in alike)
    }


def compare_figures(first: FiguresByKind, second: FiguresByKind) -> tuple[FigureComparison, ...]:
    """Compare the figures that both groups have; p-values are those of the single tests.

    Parameters
    ----------
    first, second : figures of the groups

    Returns
    -------
    tuple of FigureComparison
    """
    return tuple(
        FigureComparison(
            *key,
            (first[key].size, second[key].size),
            (float(np.median(first[key])), float(np.median(second[key]))),
            compare_groups(first[key], second[key]),
        )
        for key in sorted(first.keys() & second.keys())
    )


def adjust_comparisons(comparisons: Sequence[FigureComparison]) -> tuple[FigureComparison, ...]:
    """Adjust the p-values of comparisons made together for their number."""
    tested = [one.difference for one in comparisons if one.difference is not None]
    adjusted = iter(adjust_p_values([one.p for one in tested]))
    return tuple(
        one
        if one.difference is None
        else replace(one, difference=replace(one.difference, p=next(adjusted)))
        for one in comparisons
    )


def collect_findings(shifts: Iterable[Shift]) -> tuple[tuple[Finding, tuple[str, ...]], ...]:
    """Return the first finding of each kind with the labels of all shifts that have it.

    Findings on different gears are of different kinds.
    """
    first: dict[tuple[Code, str], Finding] = {}
    labels: dict[tuple[Code, str], list[str]] = {}
    for shift in shifts:
        own = {(one.code, one.names.get("gear", "")): one for one in shift.findings}
        for key, one in own.items():
            first.setdefault(key, one)
            labels.setdefault(key, []).append(shift.name)
    return tuple((first[key], tuple(labels[key])) for key in first)


def collect_rejected(
    rejected: Iterable[RejectedShift],
) -> tuple[tuple[RejectedShift, int], ...]:
    """Return the first rejected candidate of each reason with their number."""
    first: dict[str, RejectedShift] = {}
    count: dict[str, int] = {}
    for one in rejected:
        first.setdefault(one.reason, one)
        count[one.reason] = count.get(one.reason, 0) + 1
    return tuple((first[reason], count[reason]) for reason in first)


def list_remarks(found: FoundShifts) -> Iterator[str]:
    """List each kind of finding and each reason of rejection once, with their number."""
    for finding, labels in collect_findings(found.shifts):
        names = ", ".join(dict.fromkeys(labels))
        more = f" ({len(labels)} shifts: {names})" if len(labels) > 1 else ""
        yield f"{finding.severity}: {finding.set_subject(labels[0]).text}{more}"
    for candidate, count in collect_rejected(found.rejected):
        start, end = candidate.time
        more = f" (first of {count} for this reason)" if count > 1 else ""
        yield f"rejected, {start:z.3f} s to {end:z.3f} s: {candidate.reason}{more}"

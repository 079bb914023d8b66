# SPDX-License-Identifier: MIT
"""Findings: remarks on a log, a fit or a run as data; `findings.toml` has their sentences."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum, auto
from functools import cache
from pathlib import Path
from string import Formatter

from drivetwin._util.display_units import format_with_unit
from drivetwin.errors import Where


class Severity(StrEnum):
    """Severity of a finding; an error means that its subject does not count as identified."""

    INFO = auto()
    WARNING = auto()
    ERROR = auto()


class Code(StrEnum):
    """Kind of a finding, the key of its entry in the catalogue."""

    RECORDING = auto()
    COLUMN_AMBIGUOUS = auto()
    NO_PRESSURE = auto()
    PRESSURE_STEPS = auto()
    OTHER_SENDERS = auto()
    UNIT_OVERRIDDEN = auto()
    CHANNEL_LEFT_OUT = auto()
    NO_SAMPLES = auto()
    STAMPS_REPEATED = auto()
    SAMPLES_MISSING = auto()
    SPIKES = auto()
    GLITCHES = auto()
    STUCK = auto()
    MESSAGES_LOST = auto()
    DROPOUTS = auto()
    OUTLIERS = auto()
    SATURATED = auto()
    AT_LARGEST_NUMBER = auto()
    AT_ONE_NUMBER = auto()
    COARSE_RESOLUTION = auto()
    CHANNEL_FILLED = auto()
    FILLING_UNKNOWN = auto()
    FINAL_DRIVE_DIFFERS = auto()
    TORQUES_DIFFER = auto()
    TORQUE_REVERSED = auto()
    CLOCK_LATE = auto()
    CLOCKS_DRIFT = auto()
    TORQUE_CLOCK_LATE = auto()
    TORQUE_LATE_OR_SLIP = auto()
    OUTPUT_TORQUE_ALIGNED = auto()
    TABLE_ROWS_COARSE = auto()
    SHIFTS_NOT_FITTED = auto()
    LOCKUP_UNKNOWN = auto()
    CONVERTER_MAP_EXACT = auto()
    INPUT_SPEED_SUBSTITUTED = auto()
    OUTPUT_SPEED_SUBSTITUTED = auto()
    POWER_STATE_UNKNOWN = auto()
    RATIO_DEVIATES = auto()
    RATIO_UNKNOWN = auto()
    PRESSURES_EXCHANGED = auto()
    PRESSURES_ABSOLUTE = auto()
    TORQUE_PHASE_EMPTY = auto()
    TORQUE_PHASE_SHARED_CLUTCH = auto()
    TORQUE_PHASE_FROM_TORQUE = auto()
    TORQUE_PHASE_FROM_FLAG = auto()
    TORQUE_PHASE_UNKNOWN = auto()
    SHIFT_FLAG_NOT_SET = auto()
    GEAR_SIGNAL_DIFFERS = auto()
    BEFORE_CUT = auto()
    AFTER_CUT = auto()
    SET_BY_HAND = auto()
    GEAR_POORLY_EXCITED = auto()
    LOAD_GROWS = auto()
    LOADS_DIFFER = auto()
    MEAN_SAMPLES = auto()
    SAMPLING_UNCERTAIN = auto()
    NULL_DIRECTION = auto()
    NULL_DIRECTIONS = auto()
    AT_BOUND = auto()
    RESIDUAL_COLOURED = auto()
    RESIDUAL_ORDER = auto()
    RESIDUAL_CORRELATED = auto()
    INPUT_NOISE_OMITTED = auto()
    SIMULATION_MISSES = auto()
    SIMULATION_NOISY = auto()
    SIMULATION_INCOMPLETE = auto()
    SIMULATION_OUTSIDE_SPREAD = auto()
    GAIN_NOT_DETERMINED = auto()
    FRICTION_IMPLAUSIBLE = auto()
    FRICTION_IMPOSSIBLE = auto()
    GAIN_REFUTED = auto()
    EFFICIENCY_IMPLAUSIBLE = auto()
    CARD_SUSPECT = auto()
    RESIDUAL_UNEXPLAINED = auto()
    RESIDUAL_ABOVE_NOISE = auto()
    SEARCH_LIMITED = auto()
    EFFECT_FOUND = auto()
    EFFECT_IN_PLANT = auto()
    EFFECT_POSSIBLE = auto()
    EFFECT_RESEMBLED = auto()
    EFFECT_EXCLUDED = auto()
    EFFECT_LARGE = auto()
    EFFECT_NOT_LINEAR = auto()
    EFFECTS_OMITTED = auto()
    OTHER_LOSS_LAW = auto()
    LIKELIHOOD_FAILED = auto()
    PAPER_BIASED = auto()
    PAPER_POORLY_EXCITED = auto()
    CARD_CONTRADICTED = auto()
    OUTSIDE_DESIGN_RANGE = auto()
    OUTSIDE_BOUNDS = auto()
    EFFICIENCY_ABOVE_ONE = auto()
    EFFICIENCY_ABOVE_ONE_BY_PAPER = auto()
    LOGS_AGREE = auto()
    LOGS_DISAGREE = auto()
    SIMULATION_ENDED_EARLY = auto()
    SIMULATION_DIVERGES = auto()
    OUTSIDE_IDENTIFIED_RANGE = auto()
    ACTUATOR_NOT_IDENTIFIED = auto()
    ACTUATOR_UNDETERMINED = auto()
    NOT_VALIDATED = auto()
    NOT_PREDICTED = auto()
    FRICTION_LAW_SUBSTITUTED = auto()
    NO_TORQUE_SCALE = auto()
    DELAY_NOT_EXCITED = auto()
    FIXED_BY_CARD = auto()
    CARD_DOMINATES = auto()
    PRIOR_DOMINATES = auto()
    PARTNER_FRICTION = auto()
    MU_GAIN_SLIP = auto()
    RATIO_REFINED = auto()
    RATIO_OFF_CARD = auto()
    FIXED_NUMBER_REFINED = auto()
    FIXED_NUMBER_OFF = auto()
    PRIOR_CONTRADICTED = auto()
    PRIOR_MISSED = auto()
    OMISSION_SHOWN = auto()
    GAIN_SUSPECT = auto()
    GAIN_ASSUMED = auto()
    MU_FOR_ASSUMED_GAIN = auto()
    GAINS_CONTRADICT = auto()
    PAPER_CARD_VALUE = auto()
    PAPER_NO_INTERVAL = auto()
    PAPER_DOUBTFUL_INERTIA = auto()
    PAPER_GRID_END = auto()
    INTERVAL_WIDER_THAN_VALUE = auto()
    OUTSIDE_LIMITS = auto()
    INTERVAL_WIDE = auto()
    INTERVAL_WIDE_WITH_PRIOR = auto()
    LOG_CONTRADICTS_CARD = auto()
    DEPENDS_ON_PRIOR = auto()
    DISAGREEING_LOG = auto()
    SENSOR_LIMITED = auto()
    CARD_RATIO_UNUSUAL = auto()
    CARD_EFFICIENCY_UNUSUAL = auto()
    CARD_GAIN_UNUSUAL = auto()
    CARD_GAINS_UNEQUAL = auto()
    CARD_GEOMETRY_UNUSUAL = auto()
    CARD_PRESSURE_UNUSUAL = auto()
    CARD_INERTIA_UNUSUAL = auto()
    CARD_TOLERANCE_UNUSUAL = auto()
    CARD_RATIO_DIFFERS = auto()
    CARD_INPUT_GEAR_DIFFERS = auto()
    CARD_FILL_ABOVE_LOG = auto()
    CARD_FILL_BELOW_LOG = auto()
    CARD_FRICTION_IMPLAUSIBLE = auto()
    CARD_FRICTION_UNUSUAL = auto()
    CARD_FRICTION_BOUND = auto()
    CARD_INERTIA_DIFFERS = auto()
    CARD_NOT_COMPARED = auto()
    NO_SENSOR_TOLERANCES = auto()
    MAPPED_COLUMN_ABSENT = auto()
    MAPPING_NOT_APPLIED = auto()
    IGNORED_COLUMN_ABSENT = auto()
    UNITS_REMEMBERED = auto()
    CONVERSION_NOT_USED = auto()
    OPTIONS_REMEMBERED = auto()
    BUS_ONE_SHIFT = auto()
    BUS_SHIFTS_CONTRADICT = auto()
    BUS_SCATTERS = auto()
    BUS_KINDS_DIFFER = auto()
    BUS_START_NOT_SEEN = auto()
    BUS_END_NOT_SEEN = auto()
    BUS_RATIO_DIFFERS = auto()
    BUS_CONVERTER = auto()
    BUS_TORQUE_OF_CONVERTER = auto()
    BUS_NO_DECAY = auto()
    BUS_DECAY_DAMPED = auto()
    BUS_DECAY_SAMPLED = auto()
    BUS_DECAY_SHORT = auto()
    BUS_NO_CLUTCH = auto()
    BUS_ENGINE_UNEXPLAINED = auto()
    BUS_NO_TORQUE = auto()
    BUS_NO_METER = auto()
    BUS_CLUTCH_CARRIES = auto()
    BUS_NO_SPAN = auto()
    BUS_NO_RADIUS = auto()
    BUS_LOAD_OF_SPANS = auto()


@dataclass(frozen=True)
class Entry:
    """Entry of the catalogue: sentence, remedy and severity of a code.

    The texts contain the numbers and names of a finding in braces. The subject leads the sentence
    unless `text` contains it.
    """

    text: str
    remedy: str = ""
    severity: Severity = Severity.WARNING
    columns: tuple[tuple[str, str], ...] = ()
    """Table of a finding with rows: head and template of each column."""
    alike: str = ""
    """Name, or `subject`, by which findings of this code differ that are shown as one."""
    worst: str = ""
    """Number that is least in the worst of these; without one the first is shown."""


@cache
def load_catalogue() -> dict[Code, Entry]:
    """Load the catalogue; raises ValueError for an unknown code or severity."""
    import tomllib

    tables = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    return {
        Code(code): Entry(
            table["text"],
            table.get("remedy", ""),
            Severity(table.get("severity", "warning")),
            tuple((head, cell) for head, cell in table.get("columns", ())),
            table.get("alike", ""),
            table.get("worst", ""),
        )
        for code, table in tables.items()
    }


def list_fields(code: Code) -> dict[str, str]:
    """List the names and numbers in the texts of a code, each with its format."""
    entry = load_catalogue()[code]
    parsed = Formatter().parse(f"{entry.text} {entry.remedy}")
    return {name: spec or "" for _, name, spec, _ in parsed if name and name != "subject"}


@dataclass(frozen=True)
class Number:
    """A number of a finding: `value` and `half_width` of its interval in the SI `unit`.

    In a template `{x}` is the number in its display unit, `{x:2}` the same with two digits and
    `{x:.1f}` the SI value alone.
    """

    value: float
    unit: str = "1"
    half_width: float | None = None

    def __format__(self, spec: str) -> str:
        if spec and not spec.isdecimal():
            return format(self.value, spec)
        return format_with_unit(self.value, self.unit, self.half_width, int(spec or 4))


Value = str | float | Number
"""Content of a field in a template: a name, a number without unit, or a number."""


@dataclass(frozen=True)
class Row:
    """Row of the table of a finding: `names` and `numbers` (SI) fill the templates of the columns
    of its code."""

    names: Mapping[str, str]
    numbers: Mapping[str, Number]


@dataclass(frozen=True)
class Finding:
    """Remark on `subject` (parameter id, channel or shift label; empty for the whole) at `place`.

    `numbers` (SI) and `names` fill the texts of `code`, `rows` its table.
    """

    code: Code
    subject: str = ""
    place: Where = field(default_factory=Where)
    numbers: Mapping[str, Number] = field(default_factory=dict, hash=False)
    names: Mapping[str, str] = field(default_factory=dict, hash=False)
    rows: tuple[Row, ...] = field(default=(), hash=False)

    @property
    def severity(self) -> Severity:
        """Severity of the code."""
        return load_catalogue()[self.code].severity

    @property
    def cause(self) -> str:
        """Cause with its numbers, as a sentence without the subject."""
        return self._fill(load_catalogue()[self.code].text)

    @property
    def remedy(self) -> str:
        """Remedy as a sentence; empty where nothing helps."""
        return self._fill(load_catalogue()[self.code].remedy)

    @property
    def reason(self) -> str:
        """Cause and remedy."""
        return " ".join(part for part in (self.cause, self.remedy) if part)

    @property
    def text(self) -> str:
        """Place, subject, cause and remedy."""
        is_named = "{subject}" in load_catalogue()[self.code].text
        heads = (str(self.place), "" if is_named else self.subject)
        return ": ".join(part for part in (*heads, self.reason) if part)

    @property
    def heads(self) -> tuple[str, ...]:
        """Heads of the columns of the table; empty without rows."""
        return tuple(head for head, _ in load_catalogue()[self.code].columns) if self.rows else ()

    @property
    def cells(self) -> list[tuple[str, ...]]:
        """Cells of the table, row by row."""
        columns = load_catalogue()[self.code].columns
        return [
            tuple(template.format(**row.numbers, **row.names) for _, template in columns)
            for row in self.rows
        ]

    def set_subject(self, subject: str) -> Finding:
        """Return the finding with a subject; unchanged if it has one."""
        return self if self.subject else replace(self, subject=subject)

    def set_file(self, file: str) -> Finding:
        """Return the finding with the file of its place."""
        return replace(self, place=replace(self.place, file=file))

    def _fill(self, template: str) -> str:
        """Fill a template; its sentence ends in a period, names within it do not."""
        names = {key: one.removesuffix(".") for key, one in self.names.items()}
        text = template.format(subject=self.subject, **self.numbers, **names)
        return f"{text}." if text and text[-1] not in ".?!" else text


def report(
    code: Code, subject: str = "", place: Where | None = None, /, **values: Value
) -> Finding:
    """Build a finding; texts among `values` are names, all others numbers."""
    names, numbers = _split_values(values)
    return Finding(code, subject, place or Where(), numbers, names)


def make_row(**values: Value) -> Row:
    """Build a row of a table; texts among `values` are names, all others numbers."""
    return Row(*_split_values(values))


def _split_values(values: Mapping[str, Value]) -> tuple[dict[str, str], dict[str, Number]]:
    names = {key: one for key, one in values.items() if isinstance(one, str)}
    numbers = {
        key: one if isinstance(one, Number) else Number(float(one))
        for key, one in values.items()
        if not isinstance(one, str)
    }
    return names, numbers


def explain(code: Code, subject: str = "", /, **values: Value) -> str:
    """Return cause and remedy of a code as text, for the reason of an estimate."""
    return report(code, subject, **values).reason


def select_warnings(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Return the findings that are more than information."""
    return tuple(one for one in findings if one.severity is not Severity.INFO)


_LISTED = 3
"""Number of equal findings that are named beside the worst."""


def render(findings: Iterable[Finding]) -> tuple[str, ...]:
    """Return the texts of findings; equal ones are one text, the worst with their number."""
    kinds: dict[tuple[str, str], dict[str, Finding]] = {}
    for one in findings:
        kind = (one.code, "" if load_catalogue()[one.code].alike else one.reason)
        kinds.setdefault(kind, {})[one.text] = one
    return tuple(_render_equal(list(each.values())) for each in kinds.values())


def _render_equal(equal: Sequence[Finding]) -> str:
    entry = load_catalogue()[equal[0].code]
    worst = min(equal, key=lambda one: one.numbers[entry.worst].value) if entry.worst else equal[0]
    if len(equal) == 1:
        return worst.text
    labels = [
        one.names.get(entry.alike) or ": ".join(filter(None, (str(one.place), one.subject)))
        for one in equal
        if one is not worst
    ]
    names = [*dict.fromkeys(labels)]
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return f"{worst.text} ({len(equal)} of this kind; also {', '.join(names[:_LISTED])}{more})"

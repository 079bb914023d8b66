# SPDX-License-Identifier: MIT
"""Write docs/reference/findings.md from the catalogue of findings.

`python -m tools.findings_page` lists each code with its severity, sentence and remedy, and links it
to a question of docs/questions.md.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CATALOGUE = ROOT / "python" / "drivetwin" / "findings.toml"
PAGE = ROOT / "docs" / "reference" / "findings.md"

_HEAD = """# Findings

All findings that a command can report, by their code in `result.json`. In braces stand the numbers
and names of a finding. The severity is `warning` where none is given. `python -m
tools.findings_page` writes this page. The last column leads to [questions and
answers](../questions.md).
"""
SENSORS = "Which sensors do I need?"
WEAK, INVALID, FAULTS, SHIFTLESS, LATE, MU, CARD, TWIN, METHODS = (
    *("All values are weak: what now?", "Not valid: what now?"),
    *("A channel has faults: does it matter?", "The log has no shift: what now?"),
    *("A signal is late: does it matter?", "May I trust μ?", "Is the card right?"),
    *("May I use the twin for a calibration?", "The methods disagree: which one is right?"),
)
"""Questions."""
_BY_GROUP = {
    "Log and its recording": FAULTS,
    "Detection of shifts": SHIFTLESS,
    "Estimation: what the data support": WEAK,
    "Estimation: agreement of model and data": INVALID,
    "Simulation of a log": TWIN,
    "Reasons of estimates": WEAK,
    "Plausibility of the vehicle card, before an identification": CARD,
    "Lock-up clutch of a converter": INVALID,
    "Bus logs": SENSORS,
}
_BY_CODE = (
    (r"clock|torque_late|delay", LATE),
    (r"friction|gain|^mu_", MU),
    (r"method|^paper_", METHODS),
    (r"card", CARD),
)
"""Patterns of codes whose question is not that of their group."""


def write_page() -> str:
    """Return the text of the page.

    Raises
    ------
    KeyError
        A group of the catalogue has no question.
    """
    text = CATALOGUE.read_text(encoding="utf-8")
    entries = tomllib.loads(text)
    lines = [_HEAD]
    for part in re.split(r"^# (?=[A-Z])", text, flags=re.MULTILINE)[1:]:
        group = re.split(r"[.\n]", part)[0]
        codes = re.findall(r"^\[(\w+)\]$", part, re.MULTILINE)
        if not codes:
            continue
        lines += [f"## {group}", "", "| code | sentence, remedy | answer |", "|---|---|---|"]
        lines += [_write_row(code, entries[code], _BY_GROUP[group]) for code in codes]
        lines.append("")
    return "\n".join(lines)


def make_anchor(title: str) -> str:
    """Return the anchor of a heading, as code hosts and the documentation site make it."""
    return re.sub(r"[^\w\s-]", "", title.lower()).replace(" ", "-")


def _write_row(code: str, entry: dict[str, str], question: str) -> str:
    for pattern, own in _BY_CODE:
        if re.search(pattern, code):
            question = own
            break
    severity = entry.get("severity", "")
    remedy = f". *{_escape(entry['remedy'])}.*" if "remedy" in entry else ""
    name = f"`{code}`" + (f" ({severity})" if severity else "")
    answer = f"[{question}](../questions.md#{make_anchor(question)})"
    return f"| {name} | {_escape(entry['text'])}{remedy} | {answer} |"


def _escape(text: str) -> str:
    """Escape the characters that are markup in a table cell."""
    return re.sub(r"([|*_<>\[\]])", r"\\\1", text)


def main() -> None:
    """Write the page."""
    PAGE.write_text(write_page(), encoding="utf-8")


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: MIT
"""A page is compared with the printed text of its commands."""

from __future__ import annotations

import pytest

from tools.run_page import find_outdated

PRINTED = " speed   1 229 rpm   identified\n\n mass  −4.50e3 kg\n"


@pytest.mark.parametrize(
    ("shown", "outdated"),
    [
        (" speed 1 229 rpm identified", []),
        ("…\n mass −4.51e3 kg", []),
        (" speed 1 400 rpm identified", [" speed 1 400 rpm identified"]),
        (" speed 1 229 rpm weak", [" speed 1 229 rpm weak"]),
        (" mass 4.50e3 kg", [" mass 4.50e3 kg"]),
    ],
)
def test_lines_that_were_not_printed_are_found(shown: str, outdated: list[str]) -> None:
    assert find_outdated(f"Text.\n\n```text\n{shown}\n```\n", PRINTED) == outdated

# SPDX-License-Identifier: MIT
"""Fields of J1939 identifiers."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.logs.formats.j1939.transport import decode_group, decode_receiver, decode_sender


@pytest.mark.parametrize(
    ("identifier", "group", "sender", "receiver"),
    [
        (0x0CF00400, 61444, 0x00, 0xFF),
        (0x18FEDF17, 65247, 0x17, 0xFF),
        (0x0C000003, 0, 0x03, 0x00),
        (0x1CECFF00, 0xEC00, 0x00, 0xFF),
        (0x19FEDF00, 65247 + 0x10000, 0x00, 0xFF),
    ],
)
def test_fields(identifier: int, group: int, sender: int, receiver: int) -> None:
    one = np.array([identifier], np.uint32)
    assert (decode_group(one)[0], decode_sender(one)[0], decode_receiver(one)[0]) == (
        group,
        sender,
        receiver,
    )

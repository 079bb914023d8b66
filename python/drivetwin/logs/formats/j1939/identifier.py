# SPDX-License-Identifier: MIT
"""The fields of a 29-bit J1939 identifier (SAE J1939-21)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_PDU1_BELOW = 240
"""Formats below this address one receiver: the next byte is its address, no part of the group."""


ENGINE, TRANSMISSION = 0x00, 0x03
"""Source addresses that SAE J1939 sets aside for the first engine and the first transmission."""


def decode_group(identifier: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return the parameter group number (n,) of each identifier."""
    page = (identifier >> 24) & 0x3
    pdu_format = (identifier >> 16) & 0xFF
    extension = np.where(pdu_format < _PDU1_BELOW, 0, (identifier >> 8) & 0xFF)
    return ((page << 16) | (pdu_format << 8) | extension).astype(np.uint32)


def decode_sender(identifier: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return the source address (n,) of each identifier."""
    return identifier & np.uint32(0xFF)


def decode_receiver(identifier: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return the destination address (n,); 255 for all, as for groups that name no receiver."""
    pdu_format = (identifier >> 16) & 0xFF
    return np.where(pdu_format < _PDU1_BELOW, (identifier >> 8) & 0xFF, 0xFF).astype(np.uint32)


def is_proprietary(group: int) -> bool:
    """Return True for a group whose content each sender defines for itself."""
    return group & 0xFFFF == 0xEF00 or group & 0xFF00 == 0xFF00

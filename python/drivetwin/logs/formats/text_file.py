# SPDX-License-Identifier: MIT
"""Bytes of a text file in blocks, and its first lines."""

from __future__ import annotations

import codecs
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import BinaryIO

from drivetwin.errors import FileFormatError, Where

_BLOCK = 1 << 22
"""Bytes that are read at a time."""

_HEAD = 1 << 16
"""Bytes of the head that are read at a time."""

_HEAD_LINES, _LONGEST_HEAD = 1000, 1 << 23
"""Lines of the head, and bytes in which they must lie."""

EXPORT = "export the log as text: one row of names, one of units, then one row for each sample"
_NO_TEXT = re.compile(rb"[\x00-\x08\x0e-\x1f]")

_WIDE = {codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
_LEAST_ZEROS = 0.8
"""Least share of zeros among the high bytes of Western text in UTF-16."""


@dataclass(frozen=True)
class TextFile:
    """An open text file. `wide` is its encoding where that has two bytes for each sign."""

    source: BinaryIO
    wide: str | None
    file: str

    def iterate_blocks(self, size: int = _BLOCK) -> Iterator[bytes]:
        """Yield the whole file, in UTF-8 or with one byte for each sign."""
        self.source.seek(0)
        decoder = codecs.getincrementaldecoder(self.wide)(errors="replace") if self.wide else None
        while block := self.source.read(size):
            yield decoder.decode(block).encode("utf-8", "replace") if decoder else block

    def estimate_lines(self, some: Sequence[str]) -> int:
        """Estimate from `some` lines how many the file has, with a margin."""
        size = self.source.seek(0, os.SEEK_END) // (2 if self.wide else 1)
        length = sum(len(line) + 1 for line in some) / max(1, len(some))
        return int(1.02 * size / max(2.0, length)) + 1

    def decode(self, text: bytes) -> str:
        """Text of bytes; cp1252 where they are no UTF-8, as older tools write ° and µ."""
        try:
            return text.decode("utf-8-sig")
        except UnicodeDecodeError:
            return text.decode("cp1252", errors="replace")

    def read_head(self) -> list[str]:
        """Return the first lines."""
        read, ends = bytearray(), 0
        for block in self.iterate_blocks(_HEAD):
            read += block
            ends += max(block.count(b"\n"), block.count(b"\r"))
            if ends >= _HEAD_LINES or len(read) > _LONGEST_HEAD:
                del read[max(read.rfind(b"\n"), read.rfind(b"\r")) + 1 or len(read) :]
                break
        head = bytes(read)
        if match := _NO_TEXT.search(head):
            raise make_binary_error(match.start(), self.file)
        lines = head.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n", _HEAD_LINES)
        if not any(map(bytes.strip, lines)):
            where = Where(file=self.file)
            raise FileFormatError("the file is empty", "record or export the log again", where)
        return self.decode(b"\n".join(lines[:_HEAD_LINES])).split("\n")


def make_binary_error(place: int, file: str) -> FileFormatError:
    """Return the error for a byte that is no text."""
    what = f"the file is binary or damaged: byte {place} is no text"
    return FileFormatError(what, EXPORT, Where(file=file))


def open_text(source: BinaryIO, file: str) -> TextFile:
    """Return the text file in `source`, which can be read again from its start."""
    head = source.read(4096)
    return TextFile(source, _WIDE.get(head[:2]) or _detect_wide(head), file)


def _detect_wide(head: bytes) -> str | None:
    """Return the encoding of a text with two bytes for each sign and without a mark."""
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) or len(head) < 16:
        return None
    even, odd = head[::2].count(0), head[1::2].count(0)
    if max(even, odd) < _LEAST_ZEROS * (len(head) // 2) or min(even, odd) > 0:
        return None
    return "utf-16-be" if even else "utf-16-le"

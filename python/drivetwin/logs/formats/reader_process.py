# SPDX-License-Identifier: MIT
"""Child process that reads one file: `python -m drivetwin.logs.formats.reader_process`.

It answers pickled requests from standard input. A reply is a line of JSON, followed by the time
stamps and the values of a column as bytes; stamps that are those of the column before are not sent
again. The process ends with its input.
"""

from __future__ import annotations

import json
import os
import pickle
import sys
import threading
import traceback
from dataclasses import asdict
from importlib import import_module
from queue import SimpleQueue
from time import sleep
from typing import IO, Any

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.child_process import GRACE, limit_computing_time, limit_memory
from drivetwin.errors import DrivetwinError
from drivetwin.logs.formats.guarded import (
    LoadRequest,
    OpenRequest,
    format_error,
    make_memory_error,
)
from drivetwin.logs.raw import Recording


def main() -> None:
    """Open the file of the first request, then load columns until the input ends."""
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints must not stand between the replies
    requests: SimpleQueue[LoadRequest | None] = SimpleQueue()
    opening: OpenRequest = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_read_requests, args=(requests,), daemon=True).start()
    limit_memory(opening.limits.memory)
    limit_computing_time(opening.limits.seconds)
    try:
        opener = getattr(import_module(opening.module), opening.function)
        with opener(opening.path, opening.options) as recording:
            columns = [asdict(column) for column in recording.columns]
            _send(replies, {"columns": columns, "warnings": recording.warnings})
            sent: FloatArray | None = None
            while (request := requests.get()) is not None:
                limit_computing_time(opening.limits.seconds)
                sent = _answer(replies, opening, recording, request, sent)
    except Exception as fault:
        _send_error(replies, opening, fault)
    os._exit(0)  # without the time that libraries take to be unloaded


def _read_requests(requests: SimpleQueue[LoadRequest | None]) -> None:
    """Hand on requests. End the process after its input, even if a library still reads."""
    try:
        while True:
            requests.put(pickle.load(sys.stdin.buffer))
    except EOFError:
        requests.put(None)
    sleep(GRACE)
    os._exit(1)


def _answer(
    replies: IO[bytes],
    opening: OpenRequest,
    recording: Recording,
    request: LoadRequest,
    sent: FloatArray | None,
) -> FloatArray | None:
    """Send a column; return its stamps, of which those `sent` last are not sent again."""
    try:
        channel = recording.load(request.index, request.window)
        time, values = (
            np.ascontiguousarray(numbers, np.float64) for numbers in (channel.time, channel.values)
        )
    except Exception as fault:
        _send_error(replies, opening, fault)
        return sent
    is_known = channel.time is sent
    head = {
        "name": channel.name,
        "unit": channel.unit,
        "group": channel.group,
        "notes": channel.notes,
        "size": time.size,
        "numbers": ("values",) if is_known else ("time", "values"),
        "warnings": recording.warnings,
    }
    _send(replies, head, *(() if is_known else (time.data,)), values.data)
    return channel.time


def _send_error(replies: IO[bytes], opening: OpenRequest, fault: Exception) -> None:
    if isinstance(fault, MemoryError):
        fault = make_memory_error(opening.path, opening.limits.memory)
    if isinstance(fault, DrivetwinError):
        _send(replies, format_error(fault))
    else:
        text = "".join(traceback.format_exception(fault))
        _send(replies, {"error": type(fault).__name__, "what": text})


def _send(replies: IO[bytes], head: dict[str, Any], *numbers: memoryview) -> None:
    replies.write(json.dumps(head).encode() + b"\n")
    for block in numbers:
        replies.write(block)
    replies.flush()


if __name__ == "__main__":
    main()

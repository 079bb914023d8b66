# SPDX-License-Identifier: MIT
"""A worker process: `python -m drivetwin.fleet.worker MODULE:FUNCTION BYTES`.

It reads one task a line from standard input and answers one line on standard output. It ends when
its input does, even in the middle of a log: a worker without a coordinator is of no use.
"""

from __future__ import annotations

import json
import os
import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from queue import SimpleQueue
from time import perf_counter
from typing import Any

from drivetwin._util.child_process import limit_memory
from drivetwin._util.optional_dependencies import get_program_version
from drivetwin.errors import DrivetwinError, StoreError
from drivetwin.fleet.parts import convert_write_errors, write_part
from drivetwin.fleet.task import Found, Outcome, State, Task, make_memory_outcome
from drivetwin.logs.formats.guarded import trust_parsers

Work = Callable[[Task], Found]

_ROOM = 1.25
"""The wall of the system stands this much above the limit, which is watched from outside: it is
for what grows too fast to be seen there."""


def run_task(work: Work, task: Task, memory: int) -> dict[str, Any]:
    """Run a task, write its part, and return its outcome; see `GuardedWorker` for the keys."""
    started = perf_counter()
    if task.recipe.version != get_program_version():
        versions = f"{get_program_version()} where the worker is, {task.recipe.version} here"
        return {"stop": f"drivetwin has version {versions}", "remedy": "install the same version"}
    try:
        found = work(task)
        outcome, rows = Outcome(State.DONE, tuple(found.shifts)), found.rows
    except MemoryError:
        return {
            "outcome": make_memory_outcome(memory).to_tree(),
            "seconds": perf_counter() - started,
        }
    except StoreError as fault:
        return {"stop": fault.what, "remedy": fault.remedy}
    except DrivetwinError as error:
        outcome, rows = _make_error_outcome(error), ()
    except OSError as fault:
        return {"outcome": _make_io_outcome(fault).to_tree(), "seconds": perf_counter() - started}
    except Exception as fault:
        # Whatever a log brings about must not end the run; it is named and the others go on.
        outcome, rows = _make_crash_outcome(fault), ()
    try:
        with convert_write_errors():
            write_part(Path(task.part), task.log, outcome, rows)
    except StoreError as fault:
        return {"stop": fault.what, "remedy": fault.remedy}
    return {"outcome": outcome.to_tree(), "seconds": perf_counter() - started}


def _make_io_outcome(fault: OSError) -> Outcome:
    """I/O error while reading a log. Not recorded as its outcome, because a retry may succeed."""
    return Outcome(
        State.QUARANTINED,
        error=type(fault).__name__,
        what=f"the system refused while it was worked on: {fault.strerror or fault}",
        remedy="see whether the file can be read, then run again with --retry",
    )


def _make_error_outcome(error: DrivetwinError) -> Outcome:
    """Convert a typed error to an outcome without the path, which is not unique."""
    place = str(replace(error.where, file=None))
    what = f"{place}: {error.what}" if place else error.what
    return Outcome(State.BAD, error=type(error).__name__, what=what, remedy=error.remedy)


def _make_crash_outcome(fault: Exception) -> Outcome:
    remedy = "try 'drivetwin identify' on the log; please report what it shows"
    return Outcome(State.BAD, error=type(fault).__name__, what=str(fault), remedy=remedy)


def _read_tasks(tasks: SimpleQueue[str]) -> None:
    for line in sys.stdin:
        tasks.put(line)
    os._exit(0)


def main() -> None:
    """Answer tasks until the input ends."""
    replies = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what a library prints must not stand between the answers
    module, name = sys.argv[1].split(":")
    memory = int(sys.argv[2])
    work: Work = getattr(import_module(module), name)
    import_module("pyarrow.parquet")  # or the first log would pay for it
    limit_memory(int(_ROOM * memory))
    trust_parsers()  # the coordinator guards this process
    tasks: SimpleQueue[str] = SimpleQueue()
    threading.Thread(target=_read_tasks, args=(tasks,), daemon=True).start()
    reply: dict[str, Any] = {"ready": os.getpid()}
    while True:
        replies.write(json.dumps(reply) + "\n")
        replies.flush()
        reply = run_task(work, Task.from_json(tasks.get()), memory)


if __name__ == "__main__":
    main()

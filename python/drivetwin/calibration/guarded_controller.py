# SPDX-License-Identifier: MIT
"""Child process for computations that call the user's controller.

A crash, an endless loop or a command that is not finite costs the child, and becomes a
ControllerError that names the task and its inputs.
"""

from __future__ import annotations

import multiprocessing
import pickle
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path
from time import monotonic
from typing import Any, NoReturn

from drivetwin._util.child_process import describe_end
from drivetwin._util.progress import attach_listener, notify_progress
from drivetwin.errors import ControllerError, Where
from drivetwin.simulation.driveline_run import Call, create_trace, read_calls

LONGEST_CALL = 5.0
"""Time [s] after which a call counts as an endless loop: ten thousand times that of a real task."""
_LOOK = 0.2
"""Time [s] between two looks at the trace."""


def run_guarded(library: Path, function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function of a module with picklable arguments in a child process.

    Parameters
    ----------
    library
        Compiled controller that the function calls.
    function
        Function; its progress is reported to the listener of this thread.
    *arguments
        Its arguments.

    Returns
    -------
    Any
        Its result.

    Raises
    ------
    ControllerError
        Where the controller ends the child, or a call lasts longer than `LONGEST_CALL`.
    DrivetwinError
        The errors of the function.
    """
    create_trace(library)
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe(duplex=False)
    child = context.Process(target=_work, args=(there, function, arguments), daemon=True)
    child.start()
    there.close()
    with _end(child), here:
        return _wait(here, child, library)


@contextmanager
def _end(child: SpawnProcess) -> Iterator[None]:
    """End the child at the end of the block."""
    try:
        yield
    finally:
        child.kill()
        child.join()


def _work(pipe: Connection, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    """Send progress as pairs, then the result or the error of the function."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends this process
    reply: tuple[Any, Exception | None]
    with attach_listener(lambda share, text: pipe.send_bytes(pickle.dumps((share, text)))):
        try:
            reply = function(*arguments), None
        except Exception as error:
            reply = None, error
    pipe.send_bytes(pickle.dumps([reply]))  # a list, as messages of progress are tuples


def _wait(pipe: Connection, child: SpawnProcess, library: Path) -> Any:
    """Receive progress and the result; watch the calls meanwhile."""
    seen: dict[tuple[int, int], float] = {}
    while True:
        if not pipe.poll(_LOOK):
            now = monotonic()
            calls = read_calls(library)
            seen = {key: seen.get(key, now) for key in ((one.place, one.number) for one in calls)}
            for call in calls:
                if now - seen[call.place, call.number] > LONGEST_CALL:
                    raise _make_error(f"has not returned for {LONGEST_CALL:g} s", call, library)
            continue
        try:
            message = pickle.loads(pipe.recv_bytes())
        except EOFError:
            child.join()
            _raise_crash(child, library)
        if isinstance(message, tuple):
            notify_progress(*message)
            continue
        [(result, error)] = message
        if error is not None:
            raise error
        return result


def _raise_crash(child: SpawnProcess, library: Path) -> NoReturn:
    """Name the call in progress when the child ended."""
    calls = read_calls(library)
    what = f"ended the program (it {describe_end(child.exitcode)})"
    raise _make_error(what, calls[0] if calls else None, library)


def _make_error(what: str, call: Call | None, library: Path) -> ControllerError:
    """Return the error of a controller with the inputs of its call."""
    place = Where(file=str(library))
    remedy = "correct the step function; it must return at each task, with finite commands"
    if call is None:
        return ControllerError(f"the controller {what}", remedy, place)
    inputs = ", ".join(f"{name} {value:.6g}" for name, value in call.inputs.items())
    return ControllerError(f"the controller {what} at a task with {inputs} (SI)", remedy, place)

# SPDX-License-Identifier: MIT
"""Method, workers and limits of a fleet run, as command line and Python state them."""

from __future__ import annotations

from drivetwin._util.request import MEBIBYTE, SECOND, Request, flag, option
from drivetwin.estimation.result.method import DEFAULT_METHOD, Method


class FleetOptions(Request):
    """Method, workers and limits of a fleet run.

    `workers` processes run on this machine, one for each core if None. With `scheduler`, the
    address of a Dask scheduler, the work is done there instead. A log may use `time_limit` [s] and
    `memory_limit` [bytes]. `retry` selects the quarantined logs.
    """

    method: Method = option("likelihood or paper.", metavar="METHOD", default=DEFAULT_METHOD)
    quick: bool = flag("Fit one model to each log, and try no other; for a survey of many logs.")
    workers: int | None = option("Processes on this machine; default: one per core.", minimum=1)
    scheduler: str | None = option("Work on a Dask cluster, tcp://host:port.", metavar="ADDRESS")
    time_limit: float = option("Time limit of one log.", unit=SECOND, minimum=0.1, default=600.0)
    memory_limit: int = option(
        "Memory limit of one worker.", unit=MEBIBYTE, minimum=64, default=4 * 2**30
    )
    attempts: int = option(
        "Number of attempts for a log that loses its worker.", minimum=1, default=3
    )
    retry: bool = flag("Retry the logs in quarantine.")
    reports: bool = flag("Also write the report of each log.")

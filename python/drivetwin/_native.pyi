# SPDX-License-Identifier: MIT
"""The compiled core. Private: use `drivetwin.simulation` and `drivetwin.gearbox`."""

from collections.abc import Sequence
from typing import final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "LANES",
    "ScannedTable",
    "TableScanner",
    "actuator_pressure",
    "batch_sensitivities",
    "element_schema",
    "gear_statics",
    "linearise",
    "network_response",
    "network_sensitivities",
    "reduce_shift",
    "simulate_batch",
    "simulate_controlled",
    "simulate_network",
    "whiten",
]

LANES: int

_Array = NDArray[np.float64]
_Options = tuple[float, float, int | None, bool, bool]
_Run = tuple[
    _Array,
    list[tuple[float, str, str, float]],
    str,
    list[float] | None,
]

_Output = tuple[str, Sequence[str]]
_Seeded = tuple[float, Sequence[tuple[int, float]]]
_Ratios = tuple[str, float, float, float]
_Sines = Sequence[tuple[str, float, float, float, float]]
_Scenario = tuple[
    tuple[Sequence[tuple[str, _Array, _Array, float]], _Sines],
    tuple[Sequence[tuple[str, float]], Sequence[tuple[str, float]], Sequence[str]],
]
_Sets = tuple[Sequence[str], _Array]
_Unknowns = tuple[int, Sequence[tuple[int, str, _Array]]]
_Ends = tuple[NDArray[np.uint32], _Array, list[tuple[int, str]]]

def linearise(
    driveline: str,
    locked: Sequence[str],
    slipping: Sequence[tuple[str, float, float]],
    outputs: Sequence[_Output],
) -> tuple[list[_Array], list[str], list[str]]: ...
def simulate_batch(
    driveline: str,
    scenarios: Sequence[_Scenario],
    sets: _Sets,
    grid: _Array,
    wanted: tuple[_Array, str],
    into: tuple[tuple[Sequence[_Output], int], _Array],
) -> _Ends: ...
def simulate_controlled(
    driveline: str,
    scenario: _Scenario,
    sets: _Sets,
    grid: _Array,
    controlled: str,
    into: tuple[tuple[Sequence[_Output], bool, int], _Array],
) -> _Ends: ...
def batch_sensitivities(
    driveline: str,
    scenarios: Sequence[_Scenario],
    sets: _Sets,
    grid: _Array,
    wanted: tuple[_Array, str],
    by: tuple[tuple[Sequence[_Output], int], _Unknowns],
) -> tuple[_Ends, tuple[_Array, _Array, _Array, list[tuple[int, str]]]]: ...
def whiten(
    factor: _Array, samples: tuple[_Array, NDArray[np.uint32], _Array], columns: _Array
) -> _Array: ...
def simulate_network(
    driveline: str,
    outputs: Sequence[_Output],
    scenario: _Scenario,
    grid: _Array,
    options: _Options,
) -> _Run: ...
def network_response(
    driveline: str,
    outputs: Sequence[_Output],
    scenario: _Scenario,
    grid: _Array,
    options: tuple[float, float],
) -> tuple[_Array, _Array, list[str], str]: ...
def element_schema() -> str: ...
def network_sensitivities(
    driveline: str,
    outputs: Sequence[_Output],
    signals: tuple[Sequence[tuple[str, _Array, _Array, _Seeded]], _Sines],
    start: tuple[Sequence[tuple[str, _Seeded]], Sequence[tuple[str, _Seeded]], Sequence[str]],
    grid: _Array,
    options: tuple[float, float, int],
) -> tuple[_Array, list[tuple[float, str, str, float]], str, list[_Array], _Array]: ...
def actuator_pressure(
    model: str, command: tuple[_Array, _Array], initial: float | None, at: _Array
) -> _Array: ...
def gear_statics(
    driveline: str, engaged: Sequence[str], input: str, output: str
) -> tuple[list[tuple[str, float | None]], list[tuple[str, str, float]], tuple[float, float]]: ...
def reduce_shift(
    driveline: str,
    from_elements: Sequence[str],
    to_elements: Sequence[str],
    dogs: Sequence[str],
    ends: tuple[str, str],
) -> tuple[_Ratios, _Ratios, list[str], list[tuple[str, float, float, float]]]: ...

_Text = tuple[bytes, int]

@final
class TableScanner:
    def __new__(
        cls,
        *,
        separator: int | None,
        width: int,
        least: int,
        time: int,
        time_is_text: bool,
        skip: int,
        labels: Sequence[bytes],
        numbers: Sequence[int],
        texts: Sequence[int],
        rows: int,
    ) -> TableScanner: ...
    def feed(self, block: bytes) -> None: ...
    def finish(self) -> ScannedTable: ...

@final
class ScannedTable:
    @property
    def rows(self) -> int: ...
    @property
    def last_line(self) -> int: ...
    @property
    def lines(self) -> list[tuple[int, int]]: ...
    @property
    def remarks(self) -> list[_Text]: ...
    @property
    def remark_count(self) -> int: ...
    @property
    def ragged(self) -> tuple[int, int] | None: ...
    @property
    def ragged_count(self) -> int: ...
    @property
    def quote(self) -> tuple[int, str] | None: ...
    @property
    def binary(self) -> int | None: ...
    @property
    def decimals(self) -> list[tuple[bytes | None, bytes | None, bytes | None, bool]]: ...
    @property
    def contents(self) -> list[tuple[int, list[_Text]]]: ...
    def take_numbers(self, index: int) -> tuple[_Array, NDArray[np.uint8]]: ...
    def take_texts(self, index: int) -> tuple[bytes, NDArray[np.uint64]]: ...

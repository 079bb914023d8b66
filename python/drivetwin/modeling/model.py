# SPDX-License-Identifier: MIT
"""Models of drivelines, one line per element.

model = Model("brake test")
wheel = model.inertia("wheel", 1.5)
brake = model.clutch("brake", wheel, model.ground, pressure=[(0, 0), (1, 50)])
model.start({wheel: 100.0})
run = model.simulate(2.0)
run[brake.power], run.events.select(brake)

The schematic shows nodes as vertical shafts and elements as boxes between them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from drivetwin.errors import InputError, suggest_spelling
from drivetwin.export.modelica.model import Run, format_package
from drivetwin.fit.expression import Expression
from drivetwin.fit.fit import fit_network
from drivetwin.fit.fixed_numbers import Tolerance
from drivetwin.fit.network_model import NetworkModel
from drivetwin.fit.recording import Recording
from drivetwin.fit.result import ModelFit
from drivetwin.fit.unknown import Unknown
from drivetwin.modeling.element_methods import ElementMethods
from drivetwin.modeling.model_components import Component, Node, Place
from drivetwin.report.notebook import import_pandas
from drivetwin.simulation.dual_clutch import Accuracy, EnergyAudit, Event, FloatArray, Signal
from drivetwin.simulation.element_schema import (
    as_array,
    find_element_faults,
    refuse_faults,
    require_number,
)
from drivetwin.simulation.network import NetworkRun, Output, Sine, Start, make_input, simulate
from drivetwin.simulation.network_sensitivity import NetworkSensitivities, Unknowns, differentiate


@dataclass(frozen=True)
class Events(Sequence[Event]):
    """Events of a run in their order."""

    all: tuple[Event, ...]

    def select(self, component: Component | str) -> tuple[Event, ...]:
        """Return the events of one element."""
        name = component if isinstance(component, str) else component.name
        return tuple(event for event in self.all if event.element == name)

    def __getitem__(self, index: Any) -> Any:
        return self.all[index]

    def __len__(self) -> int:
        return len(self.all)

    def __iter__(self) -> Iterator[Event]:
        return iter(self.all)


@dataclass(frozen=True)
class ElementBalance:
    """Energy of one element over a run [J]."""

    work: float
    heat: float
    stored: float


@dataclass(frozen=True, eq=False)
class ModelRun:
    """Quantities on `time` (n,) [s]: `run[brake.power]` is the column (n,) of one, in SI."""

    network: NetworkRun

    @property
    def time(self) -> FloatArray:
        """Instants (n,) [s]."""
        return self.network.time

    @property
    def status(self) -> str:
        """`completed`, or the reason why the run ended; the columns are NaN then."""
        return self.network.status

    @property
    def events(self) -> Events:
        """Events of the friction elements."""
        return Events(self.network.events)

    @property
    def audit(self) -> EnergyAudit | None:
        """Energy balance by the solver, where asked for."""
        return self.network.audit

    def __getitem__(self, output: Output) -> FloatArray:
        """Return the column (n,) of a quantity. Raises InputError where it was not recorded."""
        if output in self.network.columns:
            return self.network.columns[output]
        known = {_format_name(one): one for one in self.network.columns}
        hint = suggest_spelling(_format_name(output), known)
        raise InputError(
            f"{_format_name(output)!r} is not recorded{hint}", "name it in 'record' of the run"
        )

    def balance_energy(self) -> dict[str, ElementBalance]:
        """Return work, heat and gain of stored energy of every element over the run.

        The works of all elements vanish in sum; work less heat is the gain of stored energy, and
        for a source or load what it gave or took. A run has them unless `record` leaves them out.
        """
        names = [output[1] for output in self.network.columns if output[0] == "work"]
        balance = {}
        for name in names:
            energy = self[("energy", name)]
            work, heat = self[("work", name)], self[("heat", name)]
            balance[name] = ElementBalance(
                float(work[-1]), float(heat[-1]), float(energy[-1] - energy[0])
            )
        return balance

    def to_frame(self) -> Any:
        """Return a pandas data frame: a column per quantity over the time [s], in SI."""
        pandas = import_pandas()
        columns = {_format_name(key): value for key, value in self.network.columns.items()}
        return pandas.DataFrame(columns, index=self.time).rename_axis("time")


def _format_name(output: Output) -> str:
    return " ".join(output)


_STEP, _ROW, _TOP, _BOX = 150.0, 46.0, 46.0, (116.0, 32.0)
"""Distances of nodes and of rows, height of the head, and size of a box [px]."""


def draw_schematic(title: str, components: Sequence[Component], ground: Node) -> str:
    """Return the SVG text: nodes in their order from left to right, one shaft each.

    Elements between nodes span them; those at one node hang on it. Elements share a row where
    they do not overlap. The ground is the last shaft, hatched.
    """
    nodes = _order_nodes(components, ground)
    place = {node: _STEP * (0.6 + index) for index, node in enumerate(nodes)}
    spans = [
        (min(at), max(at))
        for at in (
            [place[port.node] for port in component.ports.values()] for component in components
        )
    ]
    rows = _assign_rows(spans)
    height = _TOP + _ROW * (max(rows, default=0) + 1.4)
    width = _STEP * (len(nodes) + 0.2)
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" '
        f'width="{width:g}" height="{height:g}" font-family="sans-serif" font-size="11">',
        f"<title>{escape(title)}</title>",
    ]
    for node in nodes:
        lines += _draw_node(node, place[node], height, is_ground=node is ground)
    for component, row in zip(components, rows, strict=True):
        lines += _draw_component(component, place, _TOP + _ROW * (row + 0.7))
    return "\n".join([*lines, "</svg>"]) + "\n"


def _order_nodes(components: Sequence[Component], ground: Node) -> list[Node]:
    nodes = dict.fromkeys(
        port.node for component in components for port in component.ports.values()
    )
    turning = [node for node in nodes if node is not ground]
    return [*turning, ground] if ground in nodes else turning


def _assign_rows(spans: Sequence[tuple[float, float]]) -> list[int]:
    """First row of each span in which it overlaps no earlier one."""
    ends: list[list[tuple[float, float]]] = []
    rows = []
    margin = 0.5 * _BOX[0] + 4.0
    for low, high in spans:
        wide = (low - margin, high + margin)
        row = next(
            (i for i, used in enumerate(ends) if all(wide[0] > b or wide[1] < a for a, b in used)),
            len(ends),
        )
        if row == len(ends):
            ends.append([])
        ends[row].append(wide)
        rows.append(row)
    return rows


def _draw_node(node: Node, x: float, height: float, *, is_ground: bool) -> list[str]:
    dash = ' stroke-dasharray="3 3"' if is_ground else ""
    return [
        f'<line x1="{x:g}" y1="{_TOP - 14:g}" x2="{x:g}" y2="{height - 10:g}" '
        f'stroke="#888" stroke-width="3"{dash}/>',
        f'<text x="{x:g}" y="{_TOP - 22:g}" text-anchor="middle">{escape(node.name)}</text>',
    ]


def _draw_component(component: Component, place: dict[Node, float], y: float) -> list[str]:
    at = [place[port.node] for port in component.ports.values()]
    width, height = _BOX
    x = 0.5 * (min(at) + max(at))
    kind = component.kind.replace("_", " ")
    return [
        f'<line x1="{min(at):g}" y1="{y:g}" x2="{max(at):g}" y2="{y:g}" stroke="#333"/>',
        *(f'<circle cx="{end:g}" cy="{y:g}" r="3" fill="#333"/>' for end in dict.fromkeys(at)),
        f'<rect x="{x - width / 2:g}" y="{y - height / 2:g}" width="{width:g}" '
        f'height="{height:g}" rx="4" fill="#eef3fb" stroke="#335"/>',
        f'<text x="{x:g}" y="{y - 3:g}" text-anchor="middle">{escape(component.name)}</text>',
        f'<text x="{x:g}" y="{y + 11:g}" text-anchor="middle" fill="#667">{kind}</text>',
    ]


_SAMPLING = 1e-3
"""Interval of the samples of a run that states its end only, s."""


class Model(ElementMethods):
    """A driveline: elements, their inputs and a start.

    An element method takes the places of its ports: a node, a port of another element, an element
    with one port, or the name of a node. A port that is left out gets a node of its own.
    """

    def start(
        self,
        speeds: Mapping[Place, float] | None = None,
        *,
        twists: Mapping[Component | str, float] | None = None,
        locked: Sequence[Component | str] = (),
    ) -> None:
        """Set the start: speeds of nodes [rad/s], twists of shafts [rad], elements without slip.

        Gears, locked elements and prescribed speeds determine what is not stated.
        """
        self._speeds = dict(speeds or {})
        self._twists = dict(twists or {})
        self._locked = tuple(locked)

    def simulate(
        self,
        time: float | FloatArray,
        *,
        record: Sequence[Output] | None = None,
        audit: bool = False,
        accuracy: Accuracy | None = None,
    ) -> ModelRun:
        """Simulate from time 0 to `time` [s], or on the instants `time` (n,) [s].

        Parameters
        ----------
        time
            End of the run, which is then sampled each millisecond, or instants.
        record
            Quantities to record; all that the model has if None. Without powers, works and
            energies a run may pass samples by exact operators, which is faster.
        audit
            True for the energy balance by the solver.
        accuracy
            Settings of the integration.

        Raises
        ------
        InputError
            With all faults of the model.
        """
        grid = self._make_grid(time)
        start = self._resolve_start()
        outputs = self.list_outputs() if record is None else list(record)
        inputs = self._make_inputs((float(grid[0]), float(grid[-1])))
        elements = [component.element for component in self.components]
        run = simulate(elements, inputs, start, grid, outputs, audit=audit, accuracy=accuracy)
        return ModelRun(run)

    def differentiate(
        self,
        time: float | FloatArray,
        unknowns: Unknowns,
        *,
        record: Sequence[Output] | None = None,
        accuracy: Accuracy | None = None,
    ) -> NetworkSensitivities:
        """Simulate with the exact derivatives of the recorded quantities by numbers of the model.

        Parameters
        ----------
        time
            End of the run, which is then sampled each millisecond, or instants [s].
        unknowns
            Paths such as `shaft.stiffness`, `start.engine`, `delay.torque`; see
            `drivetwin.simulation.network_sensitivity`.
        record
            Quantities to record; the speeds of all nodes if None.
        accuracy
            Settings of the integration.

        Raises
        ------
        InputError
            With all faults of the model, or for a path without a derivative.
        """
        grid = self._make_grid(time)
        speeds = [node.speed for node in self.nodes if node is not self.ground]
        return differentiate(
            [component.element for component in self.components],
            self._make_inputs((float(grid[0]), float(grid[-1]))),
            self._resolve_start(),
            grid,
            speeds if record is None else list(record),
            unknowns,
            accuracy=accuracy,
        )

    def fit(
        self,
        recordings: Recording | Sequence[Recording],
        unknowns: Mapping[str, Unknown | tuple[float, float] | float],
        outputs: Mapping[str, Output],
        *,
        tolerances: Mapping[str, Tolerance] | None = None,
        expressions: Mapping[str, Expression] | None = None,
        seed: int = 0,
    ) -> ModelFit:
        """Identify numbers of the model from recordings.

        Parameters
        ----------
        recordings
            One or several; their channels take the place of the inputs of the model. Start speeds
            and twists of the model are first guesses unless a recording states them.
        unknowns
            By path, such as `shaft.stiffness`, `B3.friction.mu_c`, `delay.torque`; or by any name
            with the paths that share it. `gain`, `offset` and `delay` of a channel, such as
            `gain.torque`, and `start` of a node are numbers too. A number is a first guess, a pair
            is value and standard deviation.
        outputs
            Quantity that each measured output is, by its name in the recordings.
        tolerances
            Distributions of numbers that are not unknowns, by path, such as `gear.ratio` or
            `gain.torque`, or by element where they are exact; usual ones where nothing is stated.
        expressions
            Functions of unknowns by the path of the number that they set, or by any name.
        seed
            Seed of the draws from which the search starts.

        Returns
        -------
        ModelFit
            Estimates with intervals and verdicts.

        Raises
        ------
        InputError
            With all faults of the model, the path of a wrong unknown, or the name of a channel.
        IdentificationError
            Where no start leads to a minimum.
        """
        several = [recordings] if isinstance(recordings, Recording) else list(recordings)
        model = self.describe(unknowns, outputs, tolerances, expressions)
        return fit_network(model, several, seed=seed)

    def describe(
        self,
        unknowns: Mapping[str, Unknown | tuple[float, float] | float],
        outputs: Mapping[str, Output],
        tolerances: Mapping[str, Tolerance] | None = None,
        expressions: Mapping[str, Expression] | None = None,
    ) -> NetworkModel:
        """Return the network as a model file has it: with unknowns, compared quantities, tolerances
        and functions of unknowns.

        Raises InputError with all faults of the model.
        """
        elements = [component.element for component in self.components]
        sought = {name: Unknown.read(one) for name, one in unknowns.items()}
        given = elements, self.inputs, self._resolve_start(), outputs, sought
        return NetworkModel(self.name, *given, tolerances or {}, expressions or {})

    def list_outputs(self) -> list[Output]:
        """List everything that a run records."""
        nodes = [node for node in self.nodes if node is not self.ground]
        of_nodes = [output for node in nodes for output in (node.speed, node.acceleration)]
        return [
            *of_nodes,
            *(one for component in self.components for one in component.list_outputs(self.ground)),
        ]

    def draw(self) -> str:
        """Return a schematic as SVG text: nodes as vertical lines, elements as boxes."""
        return draw_schematic(self.name, self.components, self.ground)

    def to_modelica(self, time: float | None = None) -> str:
        """Return a Modelica package; with the end `time` [s], inputs and start are in it too."""
        refuse_faults(self._find_faults())
        run = None
        if time is not None:
            span = (0.0, require_number("end time", time))
            run = Run(self._make_inputs(span), self._resolve_start(), span)
        return format_package(self.name, [component.element for component in self.components], run)

    def _make_grid(self, time: float | FloatArray) -> FloatArray:
        if np.ndim(time) > 0:
            return as_array(time)
        end = require_number("end time", time)
        return np.linspace(0.0, end, max(round(end / _SAMPLING), 1) + 1)

    def _make_inputs(self, span: tuple[float, float]) -> dict[str, Signal | Sine]:
        return {name: make_input(name, value, span) for name, value in self.inputs.items()}

    def _resolve_start(self) -> Start:
        refuse_faults(self._find_faults())
        speeds = {self._get_node(at).name: speed for at, speed in self._speeds.items()}
        twists = {_get_name(component): twist for component, twist in self._twists.items()}
        return Start(speeds, twists, tuple(_get_name(component) for component in self._locked))

    def _find_faults(self) -> list[str]:
        """All faults of elements and start, with suggestions for misspelt names."""
        faults = [
            *self.faults,
            *find_element_faults([component.element for component in self.components]),
        ]
        nodes = [node.name for node in self.nodes]
        for at in self._speeds:
            if isinstance(at, str) and at not in nodes:
                faults.append(f"start: no node {at!r}{suggest_spelling(at, nodes)}")
        names = [component.name for component in self.components]
        for component in (*self._twists, *self._locked):
            if _get_name(component) not in names:
                hint = suggest_spelling(_get_name(component), names)
                faults.append(f"start: no element {_get_name(component)!r}{hint}")
        return faults


def _get_name(component: Component | str) -> str:
    return component if isinstance(component, str) else component.name

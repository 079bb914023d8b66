# SPDX-License-Identifier: MIT
"""Form of a request: a choice for each argument that has a closed set of values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from enum import Enum
from typing import Any, get_type_hints

from dash import ALL, Input, State
from dash.development.base_component import Component

from drivetwin._util.request import Request, get_arguments
from drivetwin.errors import RefusedError
from drivetwin.workbench.session import Session
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.fields import ControlId


def build_choices(request: type[Request]) -> list[Component]:
    """Build the choices of a request, labelled with the help texts of its options."""
    hints, arguments = get_type_hints(request), get_arguments(request)
    return [
        ui.make_choice(
            {"request": request.__name__, "id": one.name},
            arguments[one.name].help,
            {each.value: each.value for each in hints[one.name]},
            one.default.value,
        )
        for one in fields(request)
        if isinstance(one.default, Enum)
    ]


def register_choices(page: ui.Page, request: type[Request]) -> None:
    """Register the callback that keeps the chosen values in the session."""
    pattern = {"request": request.__name__, "id": ALL}

    @page.callback(Input(pattern, "data-value"), State(pattern, "id"), initially=True)
    def choose(session: Session, values: Sequence[str], ids: Sequence[ControlId]) -> None:
        """Keep the chosen values."""
        session.choices[request] = parse_choices(request, values, ids)


def parse_choices(
    request: type[Request], values: Sequence[str], ids: Sequence[ControlId]
) -> dict[str, Any]:
    """Return the chosen values by argument. Raises RefusedError for a value that is no choice."""
    hints = get_type_hints(request)
    try:
        return {one.id: hints[one.id](value) for one, value in zip(ids, values, strict=True)}
    except (KeyError, TypeError, ValueError):
        raise RefusedError("there is no such choice", "use the controls of the page") from None

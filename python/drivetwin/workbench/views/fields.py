# SPDX-License-Identifier: MIT
"""Border for what a browser sends: requests and fields of callbacks are checked by their types.

A page sends what its controls contain; a program may send anything. The type hints of a callback
are the schema of its fields.
"""

from __future__ import annotations

import inspect
import json
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Annotated, Any, get_type_hints

from dash import Dash, ctx
from dash.exceptions import CallbackException
from flask import Flask, Response, request
from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from drivetwin._util.text import show_json_escapes
from drivetwin.errors import RefusedError
from drivetwin.workbench.access_control import make_refusal

CALLBACK_PATH = "_dash-update-component"
_REMEDY = "load the page again and use its controls"
_STRICT = ConfigDict(strict=True, allow_inf_nan=False)
Index = Annotated[str, Field(pattern=r"^[0-9]{1,6}$")]
"""Number of a row as a choice sends it."""


class UploadField(BaseModel, strict=True):
    """Content of the store of an upload: its key and its label."""

    key: str
    name: str


class ControlId(BaseModel, strict=True):
    """Id of a control of a table: the parameter of its row; other keys are ignored."""

    id: str


class _Property(BaseModel):
    """A property of a component and its value."""

    id: str | dict[str, str | int | list[str]]
    property: str
    value: Any = None


class _CallbackRequest(BaseModel):
    """Body of a request that calls a callback; keys beside these are the library's."""

    output: str
    inputs: list[_Property | list[_Property]]
    state: list[_Property | list[_Property]] = []
    changedPropIds: list[str] = []


def check_callback_requests(server: Flask, app: Dash) -> None:
    """Refuse requests whose body calls no callback of the page."""

    @server.before_request
    def refuse_malformed() -> Response | None:
        if not request.path.endswith(CALLBACK_PATH) or request.method != "POST":
            return None
        try:
            called = _CallbackRequest.model_validate_json(request.get_data())
            described = app.callback_map[called.output]
            counts = len(called.inputs) == len(described["inputs"])
            counts = counts and len(called.state) == len(described["state"])
            if not counts or not all(map(_is_property_name, called.changedPropIds)):
                raise KeyError(called.output)
        except (ValidationError, KeyError):
            return _refuse()
        return None

    @server.errorhandler(CallbackException)
    def refuse_outputs(error: CallbackException) -> Response:
        # The classes below it are faults of the callback itself.
        if type(error) is not CallbackException:
            raise error
        return _refuse()


def _refuse() -> Response:
    return make_refusal(400, f"this request is not one of the page -> {_REMEDY}")


def escape_callback_responses(server: Flask) -> None:
    """Show the escapes of characters without a glyph in what callbacks return."""

    @server.after_request
    def escape_response(response: Response) -> Response:
        if request.path.endswith(CALLBACK_PATH) and response.is_json:
            response.set_data(show_json_escapes(response.get_data(as_text=True)))
        return response


def check_fields(callback: Callable[..., Any], values: Sequence[object]) -> list[Any]:
    """Return the values of the parameters of `callback` but the session, as their types.

    Raises RefusedError where a value has another type, and where lists differ in length: they are
    the columns of one table. Values of another group of controls are tuples.
    """
    names, model = _make_model(callback)
    document = {f"field{number}": value for number, value in enumerate(values)}
    try:
        checked = list(vars(model.model_validate_json(json.dumps(document))).values())
    except ValidationError as error:
        fault = error.errors(include_url=False, include_input=False)[0]
        number = str(fault["loc"][0]).removeprefix("field") if fault["loc"] else ""
        name = names[int(number)].strip("_") if number else ""
        raise RefusedError(
            f"the field {name or 'event'!r} has an invalid value: {fault['msg'][:200]}",
            _REMEDY,
        ) from None
    if len({len(one) for one in checked if isinstance(one, list)}) > 1:
        raise RefusedError("the columns of a table differ in length", _REMEDY)
    return checked


def get_triggered_part(name: str) -> str:
    """Return a part of the id of the control that called. Raises RefusedError if it has none."""
    id = ctx.triggered_id
    part = id.get(name) if isinstance(id, Mapping) else None
    if not isinstance(part, str):
        raise RefusedError("the request names no control of the page", _REMEDY)
    return part


def get_place(id: str, ids: Sequence[ControlId]) -> int:
    """Return the row of a control. Raises RefusedError if no row has its id."""
    names = [one.id for one in ids]
    if id not in names:
        raise RefusedError("the request names no row of the table", _REMEDY)
    return names.index(id)


def parse_positions(values: Sequence[float | str | None], ids: Sequence[str]) -> dict[str, float]:
    """Return the numbers of sliders by id; empty ones are left out. Raises RefusedError."""
    found: dict[str, float] = {}
    for id, value in zip(ids, values, strict=True):
        if value is None:
            continue
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise RefusedError(f"the slider {id[:80]!r} has no number", "type a number")
        found[id] = number
    return found


@cache
def _make_model(callback: Callable[..., Any]) -> tuple[list[str], type[BaseModel]]:
    """Return the names of the parameters but the session, and the schema of their values."""
    hints = get_type_hints(callback, include_extras=True)
    names = [name for name in inspect.signature(callback).parameters if name != "session"]
    fields: dict[str, Any] = {
        f"field{number}": (hints[name], ...) for number, name in enumerate(names)
    }
    return names, create_model("Fields", __config__=_STRICT, **fields)


def _is_property_name(text: str) -> bool:
    """Return True for `id.property`, where the id is a text or a JSON object."""
    id, dot, _ = text.rpartition(".")
    try:
        return bool(dot) and (not id.startswith("{") or isinstance(json.loads(id), dict))
    except (ValueError, RecursionError):
        return False

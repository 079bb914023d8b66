# SPDX-License-Identifier: MIT
"""Values that no control sends, in every field of every callback: a message, never HTTP 500."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.workbench.conftest import CARD, LOG, enter

HERE = "http://127.0.0.1:8050"
DAILY: tuple[Any, ...] = (
    None, -1, 10**400, float("nan"), "\ud800", "../" * 50, ["x"], {"shapes[0].x0": 10**400},
)  # fmt: skip
"""Values of each type."""
REPEATS: tuple[Any, ...] = (
    True, "", "x", [], {}, {"id": []},
    0, 3.5, 1e308, float("inf"), "\0", "/", "a" * 10_000, "\x1b[2J", "-1", "1e999", "\u0661",
    [[]], [None], {"key": 1}, {"key": "x", "name": {}}, {"shapes[0].x0": "x"},
)  # fmt: skip
VALUES = [*DAILY, *(pytest.param(one, marks=pytest.mark.exhaustive) for one in REPEATS)]
LABELS = [f"{number}-{str(one)[:12]!a}" for number, one in enumerate([*DAILY, *REPEATS])]


class Bench:
    """A server without a socket and the key of a session that holds a log."""

    def __init__(self, app: Any, sessions: Any) -> None:
        """Open the log."""
        self.app, self.sessions = app, sessions
        self.client = self.app.server.test_client()
        enter(self.client, "right")
        self.client.get("/_dash-dependencies", base_url=HERE)
        self.key = self.sessions.create()
        session = self.sessions.get(self.key)
        session.open(session.get_folder_source(LOG), session.get_folder_source(CARD))

    def post(self, body: Any) -> Any:
        data = body if isinstance(body, str) else json.dumps(body)
        return self.client.post(
            "/_dash-update-component", data=data, base_url=HERE, content_type="application/json"
        )

    def make_body(self, output: str, **values: Any) -> dict[str, Any]:
        """Return a request for a callback; `values` by place of the field, None elsewhere."""
        known = self.app.callback_map[output]
        parts = [_make_part(one) for one in (*known["inputs"], *known["state"])]
        for place, part in enumerate(parts):
            one = part[0] if isinstance(part, list) else part
            if one["id"] == "session":
                one["value"] = self.key
            if str(place) in values:
                one["value"] = values[str(place)]
        count = len(known["inputs"])
        first = parts[0][0] if isinstance(parts[0], list) else parts[0]
        id = first["id"]
        spelled = id if isinstance(id, str) else json.dumps(id, separators=(",", ":"))
        return {
            "output": output,
            "outputs": [] if known.get("no_output") else _make_outputs(output),
            "inputs": parts[:count],
            "state": parts[count:],
            "changedPropIds": [f"{spelled}.{first['property']}"],
        }


def _make_part(one: dict[str, str]) -> Any:
    """Return a field of a request: a list for a pattern."""
    id = one["id"]
    if not id.startswith("{"):
        return {"id": id, "property": one["property"], "value": None}
    shape = {key: "k_o" if isinstance(v, list) else v for key, v in json.loads(id).items()}
    value = shape if one["property"] == "id" else None
    return [{"id": shape, "property": one["property"], "value": value}]


def _make_outputs(output: str) -> Any:
    names = output.strip(".").split("...")
    made = [
        _make_part(dict(zip(("id", "property"), one.rsplit(".", 1), strict=True))) for one in names
    ]
    return made if output.startswith("..") else made[0]


@pytest.fixture(scope="module")
def bench(place: Path, serve: Callable[..., Any]) -> Bench:
    return Bench(*serve(place))


@pytest.mark.parametrize("value", VALUES, ids=LABELS)
def test_every_field_of_every_callback(bench: Bench, value: Any) -> None:
    tried = 0
    for output, known in bench.app.callback_map.items():
        if "callback" not in known:  # runs in the browser
            continue
        for place in range(len(known["inputs"]) + len(known["state"])):
            answer = bench.post(bench.make_body(output, **{str(place): value}))
            assert answer.status_code in (200, 204, 400), (output, place)
            tried += 1
    assert tried > 50


@pytest.mark.parametrize(
    "body",
    ["", "x", "[]", "null", "{}", '{"output": 1}', '{"output": "x.y"}', "[" * 100_000,
     '{"output": "session.data"}', '{"output": "session.data", "inputs": {}}',
     '{"output": "session.data", "inputs": [], "state": []}', '{"output": "\ud800"}',
     '{"output": "session.data", "inputs": [{"id": "a", "property": "b"}], '
     '"state": [{"id": "a", "property": "b"}], "changedPropIds": ["{.x"]}'],
)  # fmt: skip
def test_requests_that_call_nothing(bench: Bench, body: str) -> None:
    data = body.encode("utf-8", "surrogatepass")
    answer = bench.client.post(
        "/_dash-update-component", data=data, base_url=HERE, content_type="application/json"
    )
    assert answer.status_code == 400
    assert "load the page again" in answer.json["error"]


def test_a_wrong_value_is_named(bench: Bench) -> None:
    output = next(o for o in bench.app.callback_map if o.startswith("workspace-names.children"))
    answer = bench.post(bench.make_body(output, **{"1": ["no", "text"]}))
    message = answer.json["sideUpdate"]["message"]["children"]
    assert "'name'" in message
    assert "valid string" in message

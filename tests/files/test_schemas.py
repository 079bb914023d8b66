# SPDX-License-Identifier: MIT
"""Each schema takes what the program takes, by another validator, and refuses a wrong key."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from drivetwin.channels.mapping_file import format_mapping
from drivetwin.channels.roles import ChannelSpec
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.files.bus_file import BusFile, TcuFile, format_tcu_twin
from drivetwin.files.fit_file import build_fit_file
from drivetwin.files.result_file import ResultFile
from drivetwin.files.schemas import FileKind, build_json_schema
from drivetwin.files.twin_file import save_twin
from drivetwin.fit.model_file import format_model
from drivetwin.fit.synthesize import ModelName, read_builtin
from drivetwin.simulation.element_schema import ELEMENT_FIELDS
from drivetwin.tcu.card import ControllerCardFile, make_card
from drivetwin.tcu.identify import TcuTwin
from drivetwin.tcu.problem import RowNoise
from drivetwin.tcu.synthesize import CARD, format_card
from drivetwin.tcu.unknowns import Own
from drivetwin.twin.build import build_twin
from drivetwin.twin.twin import Twin
from tests.report import sample
from tests.support.fits import fit_log

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "python" / "drivetwin"
REFERENCE = ROOT / "docs" / "reference"


def toml_files(folder: Path) -> list[str]:
    return [path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.toml"))]


def fenced(page: Path, language: str) -> list[str]:
    text = page.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def twin() -> Twin:
    return build_twin(sample.identification(), sample.card())


def make_tcu_twin() -> TcuTwin:
    card = make_card(ControllerCardFile.model_validate(CARD))
    noise = RowNoise({"engine_speed": 0.1}, {"engine_speed": 9.0})
    return TcuTwin(card, ("J_engine",), np.zeros(1), np.eye(1), noise, ("1-2",), {Own.FILL: 0.5})


def elements() -> list[dict[str, Any]]:
    """Examples of the reference page, one of each type."""
    found = map(json.loads, fenced(REFERENCE / "elements.md", "json"))
    return [one for one in found if isinstance(one, dict)]


def documents(kind: FileKind, folder: Path) -> Iterator[Mapping[str, Any]]:
    """Files of a kind that the program itself reads or writes."""
    match kind:
        case FileKind.RESULT:
            yield json.loads(ResultFile.from_result(sample.identification()).to_json())
        case FileKind.TCU:
            empty_log = TcuFile(
                version="1",
                logs=[],
                status=ModelStatus.VALID,
                reason="",
                shifts={},
                parameters={},
                noise={},
                held_out=[],
            )
            yield json.loads(empty_log.to_json())
        case FileKind.TCU_TWIN:
            yield json.loads(format_tcu_twin(make_tcu_twin()).to_json())
        case FileKind.FIT:
            yield json.loads(build_fit_file(fit_log(ModelName.TIP_IN), ["a.csv"], {}).to_json())
        case FileKind.BUS:
            empty = BusFile(
                version="1", logs=[], ratios={}, parameters={}, shifts=[], decays={}, findings=[]
            )
            yield json.loads(empty.to_json())
        case _:
            yield from (tomllib.loads(text) for text in _toml(kind, folder))


def _toml(kind: FileKind, folder: Path) -> list[str]:
    match kind:
        case FileKind.VEHICLE_CARD:
            return toml_files(ROOT / "examples" / "vehicles")
        case FileKind.GEARBOX_CARD:
            return toml_files(PACKAGE / "gearbox" / "cards")
        case FileKind.POWERTRAIN:
            return toml_files(PACKAGE / "drive" / "powertrains")
        case FileKind.CHANNEL_MAPPING:
            written = format_mapping({"pressure.B2": ChannelSpec("p2", unit="bar", sign=-1)})
            return [written, *fenced(REFERENCE / "channel-mapping.md", "toml")]
        case FileKind.MODEL:
            page = fenced(REFERENCE / "model-file.md", "toml")
            made = [format_model(*read_builtin(name)) for name in ModelName]
            return [*toml_files(PACKAGE / "fit" / "examples"), *made, *page]
        case FileKind.RATIO_CARD:
            return fenced(ROOT / "docs" / "howto" / "bus-only.md", "toml")
        case FileKind.TCU_CARD:
            return [format_card(), *fenced(ROOT / "docs" / "howto" / "controller-log.md", "toml")]
        case FileKind.FLEET_RULES:
            return fenced(ROOT / "docs" / "howto" / "fleet.md", "toml")[:1]
        case _:
            save_twin(folder / "twin.toml", twin())
            return toml_files(folder)


@pytest.mark.parametrize("kind", [kind for kind in FileKind if kind is not FileKind.ELEMENTS])
def test_files_of_the_program_fit_their_schema_and_a_wrong_key_does_not(
    kind: FileKind, tmp_path: Path
) -> None:
    schema = build_json_schema(kind)
    Draft202012Validator.check_schema(schema)
    validator = Draft202012Validator(schema)
    found = list(documents(kind, tmp_path))
    assert found
    for document in found:
        validator.validate(document)
        assert not validator.is_valid({**document, "nonsense": 1})


def network_validator() -> Draft202012Validator:
    schema = build_json_schema("elements")
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


@pytest.mark.parametrize("example", elements(), ids=lambda one: str(one["type"]))
def test_a_network_fits_its_schema_and_wrong_fields_do_not(example: Mapping[str, Any]) -> None:
    validator, fields = network_validator(), ELEMENT_FIELDS[example["type"]]
    validator.validate([example])
    validator.validate([{**example, **{key: None for key in fields if not fields[key].required}}])
    assert not validator.is_valid([{**example, "nonsense": 1}])
    assert not validator.is_valid([{**example, "type": "nonsense"}])
    for key, field in fields.items():
        assert not validator.is_valid([{**example, key: []}]), key
        rest = {name: value for name, value in example.items() if name != key}
        assert validator.is_valid([rest]) != field.required, key
        if field.kind.name == "NUMBER" and field.limit and field.limit.describe():
            assert not validator.is_valid([{**example, key: refused(field.limit)}]), key


def refused(limit: Any) -> Any:
    """Return a number just outside a range."""
    if limit.least is not None:
        return limit.least - 1e-9
    return limit.excluded[0] if limit.above is None else limit.above


def test_the_schema_of_a_network_has_units_ranges_and_descriptions() -> None:
    spring = build_json_schema("elements")["$defs"]["spring_damper"]["properties"]
    assert spring["damping"] == {
        "type": "number",
        "minimum": 0.0,
        "description": "Damping.",
        "unit": "N·m·s/rad",
        "default": 0.0,
    }


def test_the_page_lists_every_kind() -> None:
    page = (REFERENCE / "schemas.md").read_text(encoding="utf-8")
    assert re.findall(r"^\| `([\w-]+)` \|", page, re.MULTILINE) == list(FileKind)


def test_a_kind_that_does_not_exist_is_refused() -> None:
    with pytest.raises(ValueError, match="card"):
        build_json_schema("card")

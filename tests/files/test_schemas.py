# SPDX-License-Identifier: MIT
"""Each schema takes what the program takes, by another validator, and refuses a wrong key."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from drivetwin.channels.channel_spec import ChannelSpec
from drivetwin.channels.mapping_text import format_mapping
from drivetwin.export.parameters.json_file import format_json
from drivetwin.export.parameters.of_twin import collect_parameters
from drivetwin.files.result_file import ResultFile
from drivetwin.files.schemas import FileKind, build_json_schema
from drivetwin.files.twin_conversion import save_twin
from drivetwin.twin.build import build_twin
from drivetwin.twin.twin import Twin
from tests.report import sample

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


def documents(kind: FileKind, folder: Path) -> Iterator[Mapping[str, Any]]:
    """Files of a kind that the program itself reads or writes."""
    match kind:
        case FileKind.RESULT:
            yield json.loads(ResultFile.from_result(sample.identification()).to_json())
        case FileKind.PARAMETERS:
            yield json.loads(format_json(collect_parameters(twin())))
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
        case FileKind.FLEET_RULES:
            return fenced(ROOT / "docs" / "howto" / "fleet.md", "toml")[:1]
        case _:
            save_twin(folder / "twin.toml", twin())
            return toml_files(folder)


@pytest.mark.parametrize("kind", FileKind)
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


def test_the_page_lists_every_kind() -> None:
    page = (REFERENCE / "schemas.md").read_text(encoding="utf-8")
    assert re.findall(r"^\| `([\w-]+)` \|", page, re.MULTILINE) == list(FileKind)


def test_a_kind_that_does_not_exist_is_refused() -> None:
    with pytest.raises(ValueError, match="card"):
        build_json_schema("card")

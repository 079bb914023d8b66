# SPDX-License-Identifier: MIT
"""Lists of parts: needs, schema, and nothing that differs between two builds."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tools import notices, python_packages


@pytest.mark.parametrize("path", [notices.SBOM, python_packages.SBOM])
def test_the_lists_of_the_wheel_differ_by_no_build(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    document = json.loads(text)
    assert {"serialNumber", "timestamp"} & {*document, *document["metadata"]} == set()
    assert re.search(r"file:|/(home|root|tmp)/", text) is None
    refs = [one["bom-ref"] for one in document["components"]]
    assert len(refs) == len(set(refs)) > 20
    assert document["metadata"]["component"]["version"] == python_packages.read_version()
    assert document["dependencies"][0]["dependsOn"]


@pytest.mark.parametrize("path", [notices.SBOM, python_packages.SBOM])
def test_the_lists_of_the_wheel_obey_the_schema(path: Path) -> None:
    schema = pytest.importorskip("cyclonedx.schema")
    validation = pytest.importorskip("cyclonedx.validation.json")
    check = validation.JsonStrictValidator(schema.SchemaVersion.V1_5)
    text = path.read_text(encoding="utf-8")
    assert check.validate_str(text) is None

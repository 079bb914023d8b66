# SPDX-License-Identifier: MIT
"""Lists of parts: needs, schema, and nothing that differs between two builds."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tools import notices, python_packages
from tools.sbom import Part, format_sbom

ROOT = Part("pypi", "whole", "3", "MIT", frozenset({"pkg:pypi/a@1"}))
PARTS = (
    Part("pypi", "a", "1", "MIT", frozenset({"pkg:pypi/b@2", "pkg:pypi/absent@1"})),
    Part("pypi", "b", "2", "BSD", is_optional=True),
)


def test_the_list_names_who_needs_what() -> None:
    document = json.loads(format_sbom(ROOT, PARTS))
    needs = {one["ref"]: one["dependsOn"] for one in document["dependencies"]}
    assert needs == {
        "pkg:pypi/whole@3": ["pkg:pypi/a@1"],
        "pkg:pypi/a@1": ["pkg:pypi/b@2"],
        "pkg:pypi/b@2": [],
    }
    assert [one["scope"] for one in document["components"]] == ["required", "optional"]


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

# SPDX-License-Identifier: MIT
"""CycloneDX list of the Python packages that drivetwin installs, for the wheel (PEP 770)."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

_ROOT = "pkg:pypi/drivetwin"


@dataclass(frozen=True)
class Package:
    """An installed package; `needs` are the names of the packages that it requires."""

    name: str
    version: str
    licence: str
    needs: frozenset[str] = frozenset()

    @property
    def url(self) -> str:
        """Package URL."""
        return f"pkg:pypi/{self.name}@{self.version}"


def format_sbom(packages: Sequence[Package], direct: Iterable[str], required: Iterable[str]) -> str:
    """Return a CycloneDX 1.5 document that is the same for the same packages.

    `direct` are the names that drivetwin asks for itself, extras included. Packages beside those of
    `required`, which every user installs, are optional. Versions are those of the build machine.
    """
    by_name = {one.name: one for one in packages}
    always = frozenset(required)
    document = {
        "$schema": "http://cyclonedx.org/schema/bom-1.5.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {
            "component": {
                "type": "library",
                "bom-ref": _ROOT,
                "name": "drivetwin",
                "purl": _ROOT,
            }
        },
        "components": [_describe(one, is_required=one.name in always) for one in packages],
        "dependencies": [
            {"ref": _ROOT, "dependsOn": _list_urls(by_name, direct)},
            *({"ref": one.url, "dependsOn": _list_urls(by_name, one.needs)} for one in packages),
        ],
    }
    return json.dumps(document, indent=1) + "\n"


def _describe(one: Package, *, is_required: bool) -> dict[str, Any]:
    return {
        "type": "library",
        "bom-ref": one.url,
        "name": one.name,
        "version": one.version,
        "scope": "required" if is_required else "optional",
        "licenses": [{"license": {"name": one.licence}}],
        "purl": one.url,
    }


def _list_urls(by_name: Mapping[str, Package], names: Iterable[str]) -> list[str]:
    return [by_name[name].url for name in sorted(names) if name in by_name]

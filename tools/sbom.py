# SPDX-License-Identifier: MIT
"""CycloneDX lists of parts for the wheel (PEP 770), which name no time, place or random number."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Part:
    """A crate or a package; `needs` are the URLs of the parts that it requires.

    `kind` is that of a package URL: cargo or pypi. Optional parts are those that an extra brings.
    """

    kind: str
    name: str
    version: str
    licence: str
    needs: frozenset[str] = frozenset()
    is_optional: bool = False

    @property
    def url(self) -> str:
        """Package URL."""
        return f"pkg:{self.kind}/{self.name}@{self.version}"


def format_sbom(root: Part, parts: Sequence[Part]) -> str:
    """Return a CycloneDX 1.5 document on `root` and the parts that it consists of or installs.

    Needs that are not among the parts are left out.
    """
    known = {one.url for one in parts}
    document = {
        "$schema": "http://cyclonedx.org/schema/bom-1.5.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {"component": _describe(root)},
        "components": [_describe(one) for one in parts],
        "dependencies": [
            {"ref": one.url, "dependsOn": sorted(one.needs & known)} for one in (root, *parts)
        ],
    }
    return json.dumps(document, indent=1) + "\n"


def _describe(one: Part) -> dict[str, Any]:
    return {
        "type": "library",
        "bom-ref": one.url,
        "name": one.name,
        "version": one.version,
        "scope": "optional" if one.is_optional else "required",
        "licenses": [{"license": {"name": one.licence}}],
        "purl": one.url,
    }

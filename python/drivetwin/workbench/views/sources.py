# SPDX-License-Identifier: MIT
"""Fields that name a file: a path in the folder of the workbench, or an upload."""

from __future__ import annotations

from drivetwin.workbench.open_log import Source
from drivetwin.workbench.session import Session
from drivetwin.workbench.views.fields import UploadField

_UPLOADED = "uploaded: "


def get_source(session: Session, typed: str | None, upload: UploadField | None) -> Source:
    """Return the file that a field names. Raises RefusedError where there is none."""
    if upload is not None and typed == _UPLOADED + upload.name:
        return session.get_uploaded(upload.key)
    return session.get_folder_source(typed or "")


def format_source(source: Source | None) -> str:
    """Return the text of a field for a file; empty without one."""
    if source is None:
        return ""
    return _UPLOADED + source.name if source.uploaded else source.name

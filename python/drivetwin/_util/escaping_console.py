# SPDX-License-Identifier: MIT
"""Border to the terminal: a console that escapes what it is given, and styles it itself."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from drivetwin._util.text import escape_text


class EscapingConsole(Console):
    """Console whose texts contain no control characters; its own colours and lines remain."""

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Render, with the text of each segment escaped."""
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else escape_text(text), style, control)

    def render_str(self, text: str, **options: Any) -> Any:
        """Convert a plain text; escaped here because a text drops some control characters."""
        return super().render_str(escape_text(text), **options)

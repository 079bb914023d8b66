# SPDX-License-Identifier: MIT
"""Just enough Rust to find functions: comments and literals blanked, brackets matched."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

_BLANKED = re.compile(
    r"""
    //[^\n]*                                   # line comment
    | r(?P<hash>\#*)".*?"(?P=hash)             # raw string
    | "(?:\\.|[^"\\])*"                        # string
    | '(?:\\(?:u\{[0-9a-fA-F]+\}|x..|.)|[^\\'])'  # character; a lifetime has no closing quote
    """,
    re.VERBOSE | re.DOTALL,
)
_BLOCK_EDGE = re.compile(r"/\*|\*/")
_FUNCTION = re.compile(r"\bfn\s+(\w+)\s*")
_CLOSING = {"(": ")", "[": "]", "{": "}", "<": ">"}


@dataclass(frozen=True)
class RustFunction:
    """A function with a body: lines from `fn` to the closing brace; `self` is no argument."""

    name: str
    line: int
    length: int
    arguments: int


def _spaces(text: str) -> str:
    return re.sub(r"[^\n]", " ", text)


def _blank_blocks(code: str) -> str:
    """Blank block comments, which nest in Rust."""
    out, depth, last = [], 0, 0
    for edge in _BLOCK_EDGE.finditer(code):
        opening = edge.group() == "/*"
        if opening and depth == 0:
            out.append(code[last : edge.start()])
            last = edge.start()
        depth = max(0, depth + (1 if opening else -1))
        if not opening and depth == 0:
            out.append(_spaces(code[last : edge.end()]))
            last = edge.end()
    return "".join([*out, code[last:]])


def mask(code: str) -> str:
    """The code with comments and literals replaced by spaces, of the same length and lines."""
    return _blank_blocks(_BLANKED.sub(lambda match: _spaces(match.group()), code))


def _after_bracket(code: str, start: int) -> int:
    """The index behind the bracket that closes the one at `start`."""
    opening, depth = code[start], 0
    for index in range(start, len(code)):
        if code[index] == opening:
            depth += 1
        elif code[index] == _CLOSING[opening] and code[index - 1] not in "-=":
            depth -= 1
            if depth == 0:
                return index + 1
    return len(code)


def _top_level_parts(inner: str) -> list[str]:
    """The text split at commas outside any bracket."""
    parts, depth, last = [], 0, 0
    for index, character in enumerate(inner):
        if character in "([{<":
            depth += 1
        elif character in ")]}" or (character == ">" and inner[index - 1] not in "-="):
            depth -= 1
        elif character == "," and depth == 0:
            parts.append(inner[last:index])
            last = index + 1
    return [part.strip() for part in [*parts, inner[last:]] if part.strip()]


def _body_start(code: str, start: int) -> int | None:
    """The index of the body's brace after a signature, None for a declaration."""
    index = start
    while index < len(code):
        if code[index] == "{":
            return index
        if code[index] == ";":
            return None
        index = _after_bracket(code, index) if code[index] in "([" else index + 1
    return None


def functions(code: str) -> Iterator[RustFunction]:
    """All functions with a body, in order; nested ones too."""
    masked = mask(code)
    for match in _FUNCTION.finditer(masked):
        opening = match.end()
        if masked[opening : opening + 1] == "<":
            opening = _after_bracket(masked, opening)
            opening += len(masked[opening:]) - len(masked[opening:].lstrip())
        if masked[opening : opening + 1] != "(":
            continue
        closing = _after_bracket(masked, opening)
        body = _body_start(masked, closing)
        if body is None:
            continue
        arguments = _top_level_parts(masked[opening + 1 : closing - 1])
        line = masked.count("\n", 0, match.start()) + 1
        last = masked.count("\n", 0, _after_bracket(masked, body)) + 1
        is_self = re.compile(r"^(&\s*('\w+\s+)?)?(mut\s+)?self\b")
        yield RustFunction(
            match.group(1),
            line,
            last - line + 1,
            sum(not is_self.match(argument) for argument in arguments),
        )


def without_tests(code: str) -> str:
    """The source up to its `#[cfg(test)]` module, which does not count towards the file's size."""
    match = re.search(r"^#\[cfg\(test\)\]\s*\n\s*mod\s+\w+\s*\{", code, re.MULTILINE)
    return code[: match.start()] if match else code

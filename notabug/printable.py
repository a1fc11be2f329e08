"""Text of unknown making on a terminal: without the signs by which a log could write the clipboard or hide a line."""

from __future__ import annotations

import re
from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

# C0 but tab and newline, DEL, C1 (a terminal may take U+009B for ESC [), and what turns the direction of writing
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]")


def printable(text: str) -> str:
    """``text`` with each control character as U+FFFD.

    >>> printable("a\\x1b]0;title\\x07")
    'a�]0;title�'
    """
    return _CONTROL.sub("�", text)


def escaped(document: str) -> str:
    """JSON text with the control characters that JSON allows, DEL and above, as escapes: the same document."""
    return _CONTROL.sub(lambda found: f"\\u{ord(found[0]):04x}" if found[0] >= "\x7f" else found[0], document)


class SafeConsole(Console):
    """A console on which only its own styles are control sequences."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(printable(segment.text), segment.style)

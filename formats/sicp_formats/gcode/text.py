"""The text of a G-code program, taken apart into lines and put together again without losing a byte."""

from __future__ import annotations

import codecs
import re
from dataclasses import dataclass

__all__ = ["ProgramText"]

_LINE_END = re.compile(r"(\r\n|\r|\n)")
_UTF16 = {codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}


@dataclass(slots=True)
class ProgramText:
    r"""Lines without their ends, the ends, and what stands before and after the text as bytes.

    >>> text = ProgramText.of(b"G21\r\nM30")
    >>> text.lines, text.ends, text.content()
    (['G21', 'M30'], ['\r\n', ''], b'G21\r\nM30')
    """

    lines: list[str]
    ends: list[str]
    encoding: str
    mark: bytes = b""
    padding: bytes = b""

    @classmethod
    def of(cls, content: bytes) -> ProgramText:
        """Take bytes apart as `program_text` decodes them."""
        mark, encoding, padding = b"", "utf-8", b""
        if content[:2] in _UTF16:
            mark, encoding = content[:2], _UTF16[content[:2]]
        else:
            kept = content.rstrip(b"\0")
            content, padding = kept, content[len(kept) :]
            mark = codecs.BOM_UTF8 if content.startswith(codecs.BOM_UTF8) else b""
        try:
            text = content[len(mark) :].decode(encoding)
        except UnicodeDecodeError:
            text, mark, encoding = content.decode("latin-1"), b"", "latin-1"
        parts = _LINE_END.split(text)
        return cls(parts[::2], [*parts[1::2], ""], encoding, mark, padding)

    def line_end(self, line: int) -> str:
        """Return what ends a line that is added behind the line of that index."""
        return self.ends[line] or (self.ends[0] or "\n")

    def content(self) -> bytes:
        """Return the bytes of the lines as they are now; a line may have become several."""
        text = "".join(line + end for line, end in zip(self.lines, self.ends, strict=True))
        return self.mark + text.encode(self.encoding) + self.padding

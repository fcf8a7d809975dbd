"""Names as VAL3 takes them."""

from __future__ import annotations

import re

from sicp_postprocessors.text import ascii_name

__all__ = ["application_name"]

_LONGEST_NAME = 15
# The language's own words, and the names that Windows keeps for devices: the folder is copied with it.
_RESERVED = re.compile(
    r"begin|end(if|for|while|switch)?|if|then|else(if)?|for|to|step|do|while|until|switch|case|default|break|call|return"
    r"|and|or|xor|not|true|false|world|flange|start|stop|global|void|num|bool|string|dio|aio|sio|frame|tool|trsf"
    r"|(point|joint)(rx|rs)?|mdesc|config|con|prn|aux|nul|(com|lpt)[1-9]",
    re.IGNORECASE,
)


def application_name(name: str) -> str:
    """Return a program name as VAL3 takes it for an application: 15 letters and digits, a letter first.

    >>> application_name("trim_porthole-left side 2"), application_name("start")
    ('trimportholelef', 'startApp')
    """
    plain = ascii_name(name, _LONGEST_NAME)
    return f"{plain}App" if _RESERVED.fullmatch(plain) else plain

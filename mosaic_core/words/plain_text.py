"""Text that people chose, without what acts on a terminal or a page: control characters, line ends, marks of direction.

A name, a reason or a message of the other side passes here once, when it is read from the wire: whoever shows it later
need not think of it. Where every character must be told, in the log and of a file with mistakes, they are spelled out.
"""

from __future__ import annotations

import re

_BLANKS = r"\t-\r\x85\u2028\u2029"
"""They end a line or move along it."""
_UNSEEN = (
    r"\xad\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u200b\u2060-\u2065\u206a-\u206f\u3164\ufe00-\ufe0d\ufeff\uffa0"
    r"\ufff0-\ufff8\U0001bca0-\U0001bca3\U0001d173-\U0001d17a\U000e0000-\U000e0fff"
)
"""They take no room (Default_Ignorable_Code_Point, UAX #44): two names would look alike, or carry more than is seen.
Left are the joiners U+200C and U+200D and the selectors U+FE0E and U+FE0F: Persian, Hindi and emoji need them."""
_ACTING = r"\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"
"""Orders to a terminal (ISO 6429), and what turns the text behind it round (UAX #9): "exe.txt" for "txt.exe"."""

_EACH_BLANK, _EACH_UNSEEN, _EACH_ACTING, _EACH = (
    re.compile(f"[{kinds}]") for kinds in (_BLANKS, _UNSEEN, _ACTING, _BLANKS + _UNSEEN + _ACTING)
)


def plain(text: str) -> str:
    """``text`` on one line, no longer than before: blanks for ends of lines, "\ufffd" for what would act."""
    return _EACH_ACTING.sub("\ufffd", _EACH_UNSEEN.sub("", _EACH_BLANK.sub(" ", text)))


def on_one_line(text: str) -> str:
    r"""``text`` with everything that acts or is not seen spelled as JSON would (``\u001b``)."""
    return _EACH.sub(_spelled, text)


def _spelled(found: re.Match[str]) -> str:
    return re.sub("....", r"\\u\g<0>", found[0].encode("utf-16-be").hex())

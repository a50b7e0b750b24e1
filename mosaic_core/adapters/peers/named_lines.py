"""Reads from an answer which label a robot gave to which media line.

MOSAIC's robots write it into the line's ``msid``, as name of the stream and of the track: ``a=msid:front front``.
Others write something else there, and then only the line itself tells.
"""

from __future__ import annotations


def named_lines(sdp: str) -> dict[str, str]:
    """Mid → label, of the lines that name one."""
    named: dict[str, str] = {}
    for section in sdp.split("\nm=")[1:]:
        values = dict(line.strip()[2:].split(":", 1) for line in section.splitlines() if line.startswith(_WANTED))
        stream, _, track = values.get("msid", "").partition(" ")
        if stream and stream == track.strip() and "mid" in values:
            named[values["mid"]] = stream
    return named


_WANTED = ("a=mid:", "a=msid:")

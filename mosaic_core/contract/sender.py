"""Who sent what a handler gets."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Sender:
    """The sender of a message: one peer of one operator. ``role`` is observer, operator or supervisor, as the server
    signed it. ``is_person``: a person decides there, not a program; ``is_original``: an original dashboard, which knows
    no leases. Both are known after its hello."""

    peer_id: str
    session_id: str
    operator_id: str = ""
    name: str = ""
    role: str = "operator"
    is_person: bool = False
    is_original: bool = False

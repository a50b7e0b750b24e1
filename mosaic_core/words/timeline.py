"""The moments of a connection's set-up, in their order: the same words at the robot, in Python and in the dashboard."""

from __future__ import annotations

from typing import Literal, get_args

Moment = Literal[
    "asked", "granted", "offered", "answered", "candidate", "ice", "dtls", "control", "hello", "catalogue", "value",
    "frame",
]  # fmt: skip
"""A moment of a connection's set-up."""

MOMENTS: tuple[Moment, ...] = get_args(Moment)

MOMENT_TITLES: dict[Moment, str] = {
    "asked": "Asked the server",
    "granted": "Server granted",
    "offered": "Offer sent",
    "answered": "Answer received",
    "candidate": "First address of the robot",
    "ice": "Path found (ICE)",
    "dtls": "Encrypted (DTLS)",
    "control": "Control channel open",
    "hello": "Robot said hello",
    "catalogue": "Catalogue",
    "value": "First value",
    "frame": "First picture",
}
"""The moments as the operator sees them. The robot's are the same seen from its side: the offer arrives, the answer
leaves."""

"""Standard messages: common quantities of robots in SI units and the frames of REP-103 and REP-105.

Whoever sends or receives one has its units, and of a command what moves, for nothing. Messages of one's own stay as
easy: derive from :class:`~mosaic_core.contract.params.Message`, or from one of these to add fields.
"""

from mosaic_core.messages.geometry import AngularVelocity, LinearVelocity, Twist

__all__ = [
    "AngularVelocity",
    "LinearVelocity",
    "Twist",
]

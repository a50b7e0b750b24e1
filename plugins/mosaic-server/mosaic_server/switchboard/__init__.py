"""Decides who may say what to whom, as a pure machine. Sockets and REST routes only carry out what it decides.

``Switchboard.handle(event) -> list[effect]``; ``now_s`` (monotonic) and random ids come in with the events.
"""

from mosaic_server.switchboard.board import Switchboard

__all__ = ["Switchboard"]

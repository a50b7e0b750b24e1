"""The button that must be held while a stick drives. Pure."""

from __future__ import annotations


class DeadMan:
    """Says when a stick may drive: while its button is held, which must have been seen let go before. So nothing moves
    when a stick is plugged in that lies on its button, nor after the right to drive was lost with the button held."""

    def __init__(self) -> None:
        self._is_armed = False

    def may_drive(self, is_held: bool) -> bool:
        """Tell it how the button stands, at every look."""
        if not is_held:
            self._is_armed = True
        return is_held and self._is_armed

    def disarm(self) -> None:
        """The stick is gone, or somebody else drives: the button must be let go first."""
        self._is_armed = False

"""Asks a receiver where it is, and refuses what can't be meant: a rate begins there."""

from __future__ import annotations

import math
from typing import Any

from mosaic_core.contract.declared.code_lines import code_of
from mosaic_core.contract.declared.wrong_declaration import wrong_message
from mosaic_core.contract.handler import DataChannelReceivable
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.words.errors import MosaicError


class ReportedPosition:
    """Where a field of one receiver is, as its author's ``reported_position`` says. Wherever that may be asked."""

    def __init__(self, handler: DataChannelReceivable[Any], safety: ReceiverSafety) -> None:
        self._handler = handler
        self._safety = safety

    def __call__(self, field: str) -> float | None:
        """Raises :class:`MosaicError` (``plugin.wrong_message``) that names class and line; ``None``: unknown."""
        return self.checked(field, self._handler.reported_position(field))

    def checked(self, field: str, said: Any) -> float | None:
        """``said`` of ``field``, where it can be meant."""
        if said is None:
            return None
        try:
            is_finite = math.isfinite(said)
        except TypeError:
            raise self._wrong(f"says {said!r:.80} of '{field}'", "Return a number, or None if unknown.") from None
        if not is_finite:
            return None
        place = float(said)
        low, high = self._safety.range_of(field)
        width = high - low
        if not 0 < width < math.inf or low - width <= place <= high + width:
            return place
        where = f"says {place:g} of '{field}', far outside of its range {low:g} … {high:g}"
        raise self._wrong(where, "Return it in the unit of the message, or bring it back by hand.")

    def _wrong(self, what: str, cure: str) -> MosaicError:
        kind = type(self._handler)
        whose = f"{kind.__name__}.reported_position"
        return wrong_message(whose, code_of(kind.reported_position), f"{what}. {cure}", cure)

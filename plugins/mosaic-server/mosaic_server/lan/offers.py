"""The offer that stands on a robot's screen: renewed when it is taken or too old, and what is told of it."""

from __future__ import annotations

from sqlalchemy.orm import Session

from mosaic_core.words.lan import LanNews
from mosaic_server.security.pairing import PairingSecrets
from mosaic_server.storage.devices import OfferState, count_devices, offer_state, open_offer

VOID = "Too many wrong PINs were typed: wait for the next one, or scan the code."


def pairing_page(url: str, code: str) -> str:
    """The code stands in the fragment, which browsers never send."""
    return f"{url}/#pair={code}"


class StandingOffer:
    """:meth:`news` runs inside a transaction on a worker thread, one at a time."""

    def __init__(self, *, offers_pins: bool) -> None:
        self._offers_pins = offers_pins
        self._offer: tuple[str, PairingSecrets] | None = None

    def news(self, session: Session, where: LanNews) -> LanNews:
        """How things stand, with a new offer where the old one is over; ``where``: what is known of the addresses."""
        devices = count_devices(session)
        if not self._offers_pins or not where.urls:
            return where.model_copy(update={"devices": devices})
        state = self._state(session)
        assert self._offer is not None
        shown = self._offer[1]
        offered = {
            "devices": devices,
            "page": pairing_page(where.urls[0], shown.code),
            "pin": shown.pin if state.has_pin else "",
            "notice": "" if state.has_pin else VOID,
        }
        return where.model_copy(update=offered)

    def _state(self, session: Session) -> OfferState:
        if self._offer is not None:
            state = offer_state(session, self._offer[0])
            if state.is_open:
                return state
        self._offer = open_offer(session)
        return OfferState(is_open=True, has_pin=True)

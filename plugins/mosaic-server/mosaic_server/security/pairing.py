"""Pairing: an offer is a PIN to type and a code to scan; either pairs one device, once, within five minutes.

The code can't be guessed, the PIN could: a few wrong PINs make every open PIN void (the codes stay), and beyond
:data:`WRONG_PINS` altogether nobody's PIN counts for a while. Pure; times are the caller's.
"""

from __future__ import annotations

import hashlib
import hmac
import secrets
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mosaic_server.security.login_limits import Limit

LIFETIME_S = 300.0
PIN_DIGITS = 8
"""At :data:`WRONG_PINS` a year of guessing without a pause finds one with a chance of 0.2 %."""
WRONG_PINS_PER_OFFER = 5
WRONG_PINS = Limit(20, 3600.0)
"""From all addresses together. More than people mistype, and it can shut out nobody who scans the code."""


@dataclass(frozen=True, slots=True)
class PairingSecrets:
    """The secrets of a pairing that are shown to people; only the hashes are kept."""

    pin: str
    code: str


@dataclass(frozen=True, slots=True)
class Offer:
    """An open offer. ``pin_hash=None``: its PIN is void."""

    id: str
    pin_hash: str | None
    code_hash: str
    wrong_pins: int


@dataclass(frozen=True, slots=True)
class PairingVerdict:
    """What was judged of an attempt to pair. ``accepted``: the offer that was met. ``wrong_pins``: what each open offer
    has counted now.
    """

    accepted: str | None
    wrong_pins: dict[str, int]

    @property
    def tries_left(self) -> int:
        """How many more wrong PINs the newest PIN bears; 0: none is open."""
        return max((WRONG_PINS_PER_OFFER - wrong for wrong in self.wrong_pins.values()), default=0)

    def is_void(self, offer_id: str) -> bool:
        return self.wrong_pins.get(offer_id, 0) >= WRONG_PINS_PER_OFFER


def new_secrets() -> PairingSecrets:
    """The code is short, to keep the QR code coarse: 96 random bits are plenty for five minutes."""
    return PairingSecrets(f"{secrets.randbelow(10**PIN_DIGITS):0{PIN_DIGITS}d}", secrets.token_urlsafe(12))


def hash_of(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def typed_pin(text: str) -> str:
    """As people type it: with blanks or dashes between the digits."""
    return "".join(letter for letter in text if letter.isdigit() and letter.isascii())


def with_code(offers: Sequence[Offer], code: str) -> PairingVerdict:
    """Somebody scanned. Nothing is counted: it can't be guessed."""
    return PairingVerdict(_first(offers, lambda offer: hmac.compare_digest(offer.code_hash, hash_of(code))), {})


def with_pin(offers: Sequence[Offer], pin: str) -> PairingVerdict:
    """Somebody typed. A wrong PIN counts against every offer, for nobody knows which one was meant."""
    wanted = hash_of(pin)
    met = _first(offers, lambda one: one.pin_hash is not None and hmac.compare_digest(one.pin_hash, wanted))
    return PairingVerdict(met, {} if met is not None else {offer.id: offer.wrong_pins + 1 for offer in offers})


def _first(offers: Sequence[Offer], is_met: Callable[[Offer], bool]) -> str | None:
    """Every offer is looked at, so that the time tells nothing."""
    met = [offer.id for offer in offers if is_met(offer)]
    return met[0] if met else None


class PinLimits:
    """Counts all wrong PINs together. ``now_s`` is any monotonic clock; one thread."""

    def __init__(self) -> None:
        self._wrong: deque[float] = deque(maxlen=WRONG_PINS.failures)

    def wait_s(self, now_s: float) -> float:
        """0 if a PIN may be tried now, else seconds until one may."""
        if len(self._wrong) < WRONG_PINS.failures:
            return 0.0
        return max(0.0, self._wrong[0] + WRONG_PINS.window_s - now_s)

    def failed(self, now_s: float) -> None:
        self._wrong.append(now_s)

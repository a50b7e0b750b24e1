"""Which addresses of a name are tried at the same time: one of each family first, for either may lead nowhere."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain, zip_longest

MAX_ADDRESSES = 4
"""Two of each family: a pair of servers behind one name, over IPv4 and IPv6."""


def tried_addresses(found: Sequence[str], most: int = MAX_ADDRESSES) -> list[str]:
    """Up to ``most`` of ``found``, the families in turn, each in the order of the name server."""
    known = list(dict.fromkeys(found))
    families = ([one for one in known if ":" in one], [one for one in known if ":" not in one])
    if known and ":" not in known[0]:
        families = families[::-1]
    return [one for one in chain.from_iterable(zip_longest(*families)) if one is not None][:most]

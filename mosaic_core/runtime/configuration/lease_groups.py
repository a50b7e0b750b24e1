"""Which connectors one lease covers: a misspelt resource is a lease of its own, and looks harmless."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import combinations

from mosaic_core.runtime.configuration.catalogue_entry import receivers
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.runtime.configuration.receiver_safety import resource_of
from mosaic_core.words.errors import Problem

_PARTS = re.compile(r"[-_]|\d+")


def lease_groups(connectors: Iterable[Connector]) -> dict[str, tuple[str, ...]]:
    """Resource → the labels of the connectors that its holder commands, in the order of the file."""
    groups: dict[str, tuple[str, ...]] = {}
    for connector in connectors:
        resources = (resource_of(connector.safety, one) for one in receivers(connector.handlers))
        for resource in dict.fromkeys(resource for resource in resources if resource is not None):
            groups[resource] = (*groups.get(resource, ()), connector.config.label)
    return groups


def lookalikes(groups: Mapping[str, Sequence[str]], connectors: Iterable[CheckedConnector]) -> Iterator[Problem]:
    """A hint for every two resources that are probably meant to be one."""
    by_label = {one.config.label: one for one in connectors}
    for one, other in combinations(groups, 2):
        if is_probably(one, other):
            first, second = groups[one][0], groups[other][0]
            message = (
                f"'{other}' (of connector '{second}') and '{one}' (of '{first}') are two leases, which two people may"
                " hold at once"
            )
            cure = f"did you mean '{one}'? Then write it alike in both"
            yield by_label[second].problem(message, "safety", "resource", cure=cure)


def is_probably(one: str, other: str) -> bool:
    """Whether two names differ by one slip of the finger, and not by a number or a letter that tells two alike apart
    (``arm_1`` and ``arm_2``, ``arm_l`` and ``arm_r``)."""
    if re.sub("[-_]", "", one) == re.sub("[-_]", "", other):
        return True
    parts, others = _PARTS.split(one), _PARTS.split(other)
    if len(parts) == len(others) and all(a == b or len(a) == len(b) == 1 for a, b in zip(parts, others, strict=True)):
        return False
    if len(one) == len(other):
        wrong = [at for at, (a, b) in enumerate(zip(one, other, strict=True)) if a != b]
        if len(wrong) == 1:
            return True
        is_swap = len(wrong) == 2 and wrong[1] == wrong[0] + 1
        return is_swap and one[wrong[0] :][:2] == other[wrong[0] :][:2][::-1]
    longer, shorter = (one, other) if len(one) > len(other) else (other, one)
    return any(longer[:at] + longer[at + 1 :] == shorter for at in range(len(longer)))

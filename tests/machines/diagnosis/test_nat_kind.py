"""The kind of NAT, from what STUN servers see."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.diagnosis.nat_kind import Mapping, nat_verdict

ONE, TWO = ("192.0.2.1", 3478), ("192.0.2.2", 3478)
OWN = ["10.0.0.7"]


def seen(*pairs: tuple[tuple[str, int], tuple[str, int]]) -> list[Mapping]:
    return [Mapping(server, mapped) for server, mapped in pairs]


@pytest.mark.parametrize(
    ("mappings", "kind", "keeps_port"),
    [
        ([], "blocked", None),
        (seen((ONE, ("10.0.0.7", 5000))), "none", True),
        (seen((ONE, ("198.51.100.9", 5000))), "unknown", True),
        (seen((ONE, ("198.51.100.9", 61000))), "unknown", False),
        (seen((ONE, ("198.51.100.9", 61000)), (TWO, ("198.51.100.9", 61000))), "endpoint-independent", False),
        (seen((ONE, ("198.51.100.9", 61000)), (TWO, ("198.51.100.9", 61001))), "symmetric", False),
        (seen((ONE, ("198.51.100.9", 5000)), (TWO, ("198.51.100.10", 5000))), "symmetric", True),
        (seen((ONE, ("10.0.0.7", 6000)), (TWO, ("10.0.0.7", 6000))), "endpoint-independent", False),
    ],
)
def test_every_kind_is_told_from_what_the_servers_see(
    mappings: list[Mapping], kind: str, keeps_port: bool | None
) -> None:
    verdict = nat_verdict(5000, OWN, mappings)
    assert (verdict.kind, verdict.keeps_port) == (kind, keeps_port)
    assert verdict.sentence.endswith(".")


def test_the_same_server_asked_twice_does_not_prove_the_kind() -> None:
    assert nat_verdict(5000, OWN, seen((ONE, ("198.51.100.9", 1)), (ONE, ("198.51.100.9", 1)))).kind == "unknown"


def test_addresses_are_told_as_people_write_them() -> None:
    verdict = nat_verdict(1, [], seen((ONE, ("2001:db8::1", 5)), (TWO, ("2001:db8::1", 6))))
    assert "[2001:db8::1]:5, [2001:db8::1]:6" in verdict.sentence


address = st.tuples(st.sampled_from(["10.0.0.7", "198.51.100.9", "198.51.100.10"]), st.integers(1, 5))


@given(st.lists(st.builds(Mapping, address, address), max_size=6), st.integers(1, 5))
def test_symmetric_is_said_exactly_where_two_answers_differ(mappings: list[Mapping], port: int) -> None:
    verdict = nat_verdict(port, OWN, mappings)
    differ = len({one.mapped for one in mappings}) > 1
    assert (verdict.kind == "symmetric") == differ
    assert (verdict.kind == "blocked") == (not mappings)
    assert set(verdict.public_hosts) == {one.mapped[0] for one in mappings}

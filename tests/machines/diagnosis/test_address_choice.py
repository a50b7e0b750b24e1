"""Of the addresses of a name a few are tried, of each family at least one."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.diagnosis.host_addresses import MAX_ADDRESSES, tried_addresses

ADDRESSES = st.sampled_from([*(f"192.0.2.{n}" for n in range(9)), *(f"2001:db8::{n}" for n in range(9))])


def test_the_families_take_turns_beginning_with_that_of_the_name_server() -> None:
    assert tried_addresses(["::1", "::2", "::3", "10.0.0.1", "10.0.0.2"]) == ["::1", "10.0.0.1", "::2", "10.0.0.2"]
    assert tried_addresses(["10.0.0.1", "10.0.0.1", "::1"]) == ["10.0.0.1", "::1"]
    assert tried_addresses([]) == []


@given(st.lists(ADDRESSES, max_size=20))
def test_they_are_few_distinct_and_of_every_family_that_there_is(found: list[str]) -> None:
    tried = tried_addresses(found)
    assert len(tried) == len(set(tried)) == min(len(set(found)), MAX_ADDRESSES)
    assert set(tried) <= set(found)
    assert {":" in one for one in tried} == {":" in one for one in found}
    assert tried[:1] == found[:1]

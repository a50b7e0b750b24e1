"""What a change of the network means for connections."""

from __future__ import annotations

from mosaic_core.machines.peers.network_change import NetworkView, change_between

WIFI = NetworkView(frozenset({"127.0.0.1", "192.0.2.7"}), ("192.0.2.7", None))


def test_nothing_changes_while_nothing_changes() -> None:
    assert change_between(WIFI, WIFI) is None


def test_an_address_that_is_gone_moves_everything() -> None:
    other = NetworkView(frozenset({"127.0.0.1", "192.0.2.8"}), ("192.0.2.8", None))
    assert change_between(WIFI, other) == "moved"
    assert change_between(WIFI, NetworkView(frozenset({"127.0.0.1"}), (None, None))) == "moved"


def test_another_way_out_moves_everything_though_the_old_address_stays() -> None:
    both = frozenset({*WIFI.addresses, "198.51.100.3"})
    assert change_between(WIFI, NetworkView(both, ("198.51.100.3", None))) == "moved"


def test_a_way_where_there_was_none_is_worth_a_try() -> None:
    nothing = NetworkView(frozenset({"127.0.0.1"}), (None, None))
    assert change_between(nothing, WIFI) == "back"
    assert change_between(WIFI, NetworkView(WIFI.addresses, ("192.0.2.7", "2001:db8::7"))) == "back"


def test_one_more_address_disturbs_nobody() -> None:
    assert change_between(WIFI, NetworkView(frozenset({*WIFI.addresses, "172.17.0.1"}), WIFI.ways_out)) == "back"


def test_a_sleep_moves_everything() -> None:
    assert change_between(WIFI, NetworkView(WIFI.addresses, WIFI.ways_out, slept_s=30.0)) == "moved"
    assert change_between(WIFI, NetworkView(WIFI.addresses, WIFI.ways_out, slept_s=0.1)) is None

"""Who a request comes from, by what proxies say in X-Forwarded-For or Forwarded; whatever strangers add."""

from __future__ import annotations

from ipaddress import ip_address

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from mosaic_server.entrance.forwarded import ProxyHeader, RequestSource, request_source
from mosaic_server.entrance.proxies import TrustedProxies

PROXY, INNER, PERSON, STRANGER = "10.0.0.1", "10.0.0.2", "192.0.2.60", "203.0.113.66"
TRUSTED = TrustedProxies(["10.0.0.0/8", "fd00::/8"])
SIMPLE, FORWARDED = ProxyHeader.X_FORWARDED_FOR, ProxyHeader.FORWARDED


def address(header: ProxyHeader, said: str, peer: str = PROXY) -> str:
    return request_source(header, said, peer, TRUSTED).address


@pytest.mark.parametrize(
    ("said", "found"),
    [
        ("for=192.0.2.60", PERSON),
        ('For="192.0.2.60:47011";proto=http;by=203.0.113.43', PERSON),
        ("proto=https; for=192.0.2.60 ; host=robots.example.org", PERSON),
        ('for="[2001:db8:cafe::17]:4711"', "2001:db8:cafe::17"),
        ('for="[2001:DB8:0::17]"', "2001:db8::17"),
        ('for="[2001:db8::17]:_port"', "2001:db8::17"),
        ('for="[::ffff:192.0.2.60]"', PERSON),
        ('for="192\\.0.2.60"', PERSON),
        ("for=203.0.113.66, for=192.0.2.60, for=10.0.0.2", PERSON),
        ('for=203.0.113.66,for="[2001:db8::17]:1" , for="10.0.0.2:80"', "2001:db8::17"),
        ("for=10.0.0.3, for=10.0.0.2", "10.0.0.3"),
        ('for=192.0.2.60;host="a, for=203.0.113.66"', PERSON),
        ('for=", for=192.0.2.60', PERSON),
        ('for=203.0.113.66;by="_x, for="[2001:db8::17]:47"', "2001:db8::17"),
    ],
)
def test_forwarded_is_read_from_the_right_up_to_the_first_who_is_no_named_proxy(said: str, found: str) -> None:
    assert address(FORWARDED, said) == found


@pytest.mark.parametrize(
    "last",
    [
        "for=unknown",
        'for="unknown"',
        "for=_hidden",
        'for="_SEVKISEK:80"',
        "by=203.0.113.43;proto=http",
        "for=",
        'for="',
        "for=2001:db8::17",
        'for="2001:db8::17"',
        "for=[2001:db8::17]",
        'for="[2001:db8::17"',
        'for="[fe80::1%eth0]"',
        'for="192.0.2.60:123456"',
        "for=192.0.2.60:80",
        "for=192.0.2.999",
        "for=192.0.2.60;for=192.0.2.61",
        "for=192.0.2.60;FOR=192.0.2.61",
        "for = 192.0.2.60",
        "192.0.2.60",
        "",
        ",",
        ";",
    ],
)
def test_what_is_hidden_or_malformed_counts_as_the_proxy_that_said_it(last: str) -> None:
    assert address(FORWARDED, last) == PROXY
    assert address(FORWARDED, f"for={STRANGER}, {last}") == PROXY
    assert address(FORWARDED, f"{last}, for={INNER}") == INNER


@pytest.mark.parametrize(
    ("said", "found"),
    [
        ("192.0.2.60", PERSON),
        ("203.0.113.66, 192.0.2.60 , 10.0.0.2", PERSON),
        ("192.0.2.60:4711", PERSON),
        ("2001:db8::17", "2001:db8::17"),
        ("[2001:db8::17]:4711", "2001:db8::17"),
        ("::ffff:192.0.2.60", PERSON),
        ("10.0.0.3,10.0.0.2", "10.0.0.3"),
        ("203.0.113.66, unknown", PROXY),
        ("203.0.113.66, ", PROXY),
        ("203.0.113.66, nonsense, 10.0.0.2", INNER),
        ("fe80::1%eth0", PROXY),
        ("", PROXY),
    ],
)
def test_x_forwarded_for_has_the_same_rules(said: str, found: str) -> None:
    assert address(SIMPLE, said) == found


@pytest.mark.parametrize("header", ProxyHeader)
def test_whoever_was_not_named_speaks_for_nobody(header: ProxyHeader) -> None:
    said = {SIMPLE: PERSON, FORWARDED: f"for={PERSON}"}[header]
    assert address(header, said, STRANGER) == STRANGER
    assert address(header, said, "") == ""


def test_forwarded_tells_the_scheme_of_the_hop_that_counts() -> None:
    said = f"for={STRANGER};proto=https, for={PERSON};proto=HTTPS, for={INNER};proto=http"
    assert request_source(FORWARDED, said, PROXY, TRUSTED) == RequestSource(PERSON, "https")


def as_node(found: str, port: str) -> str:
    bare = f"[{found}]" if ":" in found else found
    return f'for="{bare}{port}"' if ":" in bare + port else f"for={bare}"


_people = st.one_of(st.ip_addresses(v=4), st.ip_addresses(v=6)).filter(
    lambda one: one not in TRUSTED and getattr(one, "ipv4_mapped", None) is None
)
_strangers = st.one_of(
    st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=60),
    st.lists(
        st.sampled_from(
            ['for="', '"', ",", ";", "=", "\\", "for=203.0.113.66", "for=10.0.0.3", "unknown", " ", "[", "]"]
        ),
        max_size=12,
    ).map("".join),
)


@given(_strangers, _people, st.lists(st.sampled_from(["10.0.0.2", "10.9.9.9", "fd00::5"]), max_size=4), st.booleans())
@example('for="', ip_address("2001:db8::1"), [], True)
@example('for=203.0.113.66;by="', ip_address("2001:db8::1"), ["10.0.0.2"], True)
@example('for=203.0.113.66;host="\\', ip_address("192.0.2.60"), [], True)
def test_whatever_a_stranger_writes_first_the_proxies_tell_his_address(
    stranger: str, person: object, hops: list[str], has_port: bool
) -> None:
    port = ":4711" if has_port else ""
    simple = [str(person), *hops]
    forwarded = [as_node(str(person), port), *(as_node(hop, port) for hop in hops)]
    assert address(SIMPLE, ", ".join([stranger, *simple])) == str(person)
    assert address(FORWARDED, ", ".join([stranger, *forwarded])) == str(person)
    assert address(FORWARDED, ",".join([stranger, *forwarded])) == str(person)


@given(_strangers)
def test_anything_at_all_is_an_address_or_that_of_a_named_proxy(said: str) -> None:
    for header in ProxyHeader:
        ip_address(address(header, said))


@given(st.sampled_from(['a="', ",", 'a="",', 'a="\\",', "for=10.0.0.2,", 'for="10.0.0.2",']))
def test_a_long_header_costs_little(part: str) -> None:
    """As many hops as a request's head holds; a pattern that tries again from every place would not end."""
    address(FORWARDED, part * (16_000 // len(part)))
    address(SIMPLE, part * (16_000 // len(part)))

"""Every spelling of an ICE URL that people write, and those that must be refused."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from mosaic_core.words.ice import IceServer, parse_ice_url


@pytest.mark.parametrize(
    ("spelled", "normal"),
    [
        ("turn.example.org:3478", "turn:turn.example.org:3478?transport=udp"),
        ("turn.example.org", "turn:turn.example.org:3478?transport=udp"),
        ("turn:turn.example.org", "turn:turn.example.org:3478?transport=udp"),
        ("turn:turn.example.org?transport=tcp", "turn:turn.example.org:3478?transport=tcp"),
        ("turns:turn.example.org", "turns:turn.example.org:5349?transport=tcp"),
        ("stun:stun.example.org", "stun:stun.example.org:3478"),
        ("stun:[2001:db8::1]:3478", "stun:[2001:db8::1]:3478"),
        ("  stun:192.0.2.1:9  ", "stun:192.0.2.1:9"),
    ],
)
def test_spellings_are_normalised(spelled: str, normal: str) -> None:
    assert str(parse_ice_url(spelled)) == normal


@pytest.mark.parametrize(
    ("spelled", "complaint"),
    [
        ("https://turn.example.org", "is no ICE URL"),
        ("turn:", "is no ICE URL"),
        ("", "is no ICE URL"),
        ("turn:host:99999999", "is no ICE URL"),
        ("turn:user@host", "is no ICE URL"),
        ("stuns:host", "write stun:"),
        ("turns:host?transport=udp", "drop ?transport=udp"),
    ],
)
def test_what_would_be_dropped_silently_is_refused_with_a_cure(spelled: str, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint.replace("?", r"\?")):
        parse_ice_url(spelled)


@given(st.text(max_size=60))
def test_any_text_is_normalised_stably_or_refused(text: str) -> None:
    try:
        normal = str(parse_ice_url(text))
    except ValueError:
        return
    assert str(parse_ice_url(normal)) == normal


def test_one_url_may_be_written_without_a_list() -> None:
    assert IceServer.model_validate({"urls": "stun:a.example"}).urls == ("stun:a.example:3478",)


def test_a_bad_url_in_a_list_is_an_error() -> None:
    with pytest.raises(ValidationError):
        IceServer.model_validate({"urls": ["stun:a.example", "nonsense://"]})


def test_the_credential_is_not_shown() -> None:
    assert "hush" not in repr(IceServer(urls=("turn:a.example",), username="u", credential="hush"))


@pytest.mark.parametrize(
    ("urls", "username", "credential", "lacks"),
    [
        (("turn:a.example",), None, None, True),
        (("stun:a.example", "turns:a.example"), "u", None, True),
        (("turn:a.example",), "u", "", True),
        (("turn:a.example",), "u", "p", False),
        (("stun:a.example",), None, None, False),
    ],
)
def test_turn_takes_user_name_and_credential(
    urls: tuple[str, ...], username: str | None, credential: str | None, lacks: bool
) -> None:
    assert IceServer(urls=urls, username=username, credential=credential).lacks_credentials is lacks

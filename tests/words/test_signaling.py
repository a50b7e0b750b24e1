"""Signaling messages: emitted exactly, read tolerantly, and never a crash."""

from __future__ import annotations

import json
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.words.errors import WireError
from mosaic_core.words.signaling import (
    LONGEST_SPELLING,
    MESSAGES,
    AuthorizeRequest,
    AuthorizeResult,
    ClosePeerConnection,
    ErrorEcho,
    ExchangeIceCandidate,
    IceCandidate,
    MalformedSignaling,
    PrepareConnection,
    RobotStatus,
    SpelledMessage,
    StatusUpdate,
    UnknownMessage,
    agreed_extensions,
    parse_signaling,
    parse_spelled,
)


def test_authorize_request_toward_an_original_carries_null() -> None:
    assert json.loads(AuthorizeRequest().to_text()) == {"type": "authorize.req", "data": None}


def test_authorize_result_is_a_bare_integer() -> None:
    assert json.loads(AuthorizeResult(code=100).to_text()) == {"type": "authorize.res", "data": 100}
    assert parse_signaling('{"type":"authorize.res","data":100}') == AuthorizeResult(code=100)


def test_an_error_echo_names_the_refused_request() -> None:
    assert parse_signaling('{"type":"authorize","data":20001}') == ErrorEcho(request_type="authorize", code=20001)
    assert parse_signaling('{"type":"x.res","data":10002}') == ErrorEcho(request_type="x.res", code=10002)


def test_a_candidate_has_exactly_three_keys() -> None:
    message = ExchangeIceCandidate(
        rtc_connection_id="c", ice_candidate=IceCandidate(candidate="candidate:1", sdp_mid="0")
    )
    assert json.loads(message.to_text())["data"]["iceCandidate"] == {
        "candidate": "candidate:1",
        "sdpMid": "0",
        "sdpMLineIndex": 0,
    }


def test_a_candidate_with_a_null_line_and_extra_keys_is_read() -> None:
    text = json.dumps(
        {
            "type": "signaling.send_ice_candidate",
            "data": {
                "rtcConnectionId": "c",
                "iceCandidate": {"candidate": "x", "sdpMid": "1", "sdpMLineIndex": None, "usernameFragment": "u"},
            },
        }
    )
    message = parse_signaling(text)
    assert isinstance(message, ExchangeIceCandidate)
    assert message.ice_candidate == IceCandidate(candidate="x", sdp_mid="1", sdp_m_line_index=0)


@pytest.mark.parametrize(
    "spelling",
    ["signaling.close_peer_connection", "signaling.close_connection", "signaling.send_close_peer_connection"],
)
def test_every_historic_spelling_of_close_is_read(spelling: str) -> None:
    message = parse_signaling(json.dumps({"type": spelling, "data": {"rtcConnectionId": "c"}}))
    assert message == ClosePeerConnection(rtc_connection_id="c")


def test_prepare_connection_toward_an_original_robot_has_one_key() -> None:
    assert json.loads(PrepareConnection(rtc_connection_id="c").to_text())["data"] == {"rtcConnectionId": "c"}


def test_a_status_is_an_integer_on_the_wire() -> None:
    assert json.loads(StatusUpdate(status=RobotStatus.RTC_CONNECTED).to_text())["data"] == {"status": 2}


def test_an_unknown_type_is_no_error() -> None:
    assert parse_signaling('{"type":"future.thing","data":{}}') == UnknownMessage(unknown_type="future.thing")


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "3", "null", '{"data":1}', '{"type":1}', '{"type":"status.update","data":{"status":77}}']
)
def test_what_makes_no_sense_is_a_wire_error(text: str) -> None:
    with pytest.raises(WireError) as caught:
        parse_signaling(text)
    assert caught.value.code == "signal.bad_message"


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda children: st.lists(children, max_size=4) | st.dictionaries(st.text(max_size=12), children, max_size=4),
    max_leaves=12,
)


@given(kind=st.sampled_from([*MESSAGES, "authorize.res", "nonsense"]), data=json_values)
def test_any_data_is_a_message_or_a_wire_error(kind: str, data: object) -> None:
    try:
        message = parse_signaling(json.dumps({"type": kind, "data": data}))
    except WireError:
        return
    again = parse_signaling(message.to_text()) if not isinstance(message, UnknownMessage) else message
    assert again == message


@given(st.text(max_size=200))
def test_any_text_is_a_message_or_a_wire_error(text: str) -> None:
    with suppress(WireError):
        assert parse_signaling(text).to_text()


@pytest.mark.parametrize("kind", ["signaling.close_connection", "future.thing", "x" * 100])
def test_the_type_is_kept_as_the_sender_spelled_it(kind: str) -> None:
    text = json.dumps({"type": kind, "data": {"rtcConnectionId": "c"}})
    assert parse_spelled(text) == SpelledMessage(parse_signaling(text), kind)


@pytest.mark.parametrize(
    ("text", "spelled"),
    [
        ('{"type":"status.update","data":{"status":77}}', "status.update"),
        ('{"type":"status.update","data":{"status":"\\ud800"}}', "status.update"),
        ('{"type":"\\ud800"}', None),
        ('{"type":1}', None),
        ("[", None),
    ],
)
def test_of_what_makes_no_sense_the_type_is_told_where_there_is_one(text: str, spelled: str | None) -> None:
    with pytest.raises(MalformedSignaling) as caught:
        parse_spelled(text)
    assert caught.value.spelled == spelled


def test_of_a_long_type_the_beginning_is_kept() -> None:
    assert parse_spelled(json.dumps({"type": "x" * 5000})).spelled == "x" * LONGEST_SPELLING


def test_deep_nesting_is_a_wire_error() -> None:
    with pytest.raises(WireError):
        parse_signaling("[" * 100_000)


def test_the_lower_version_of_an_extension_counts() -> None:
    assert agreed_extensions({"catalogue": 9, "future": 1}, {"catalogue": 2, "tickets": 1}) == {"catalogue": 2}
    assert agreed_extensions(None) == {}

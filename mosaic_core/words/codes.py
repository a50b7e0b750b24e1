"""The one table of reason codes, which is written down in ``reason_codes.txt`` beside this module.

A code names *why* something was refused, closed or failed. The same word appears in exceptions, WebSocket and
peer close messages, the command line and the dashboard, so that a user can search for it.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from itertools import pairwise
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Reason:
    """A reason code, one sentence for people, and what to do about it."""

    code: str
    sentence: str
    cure: str = ""


def _table(text: str) -> dict[str, Reason]:
    """A code begins its line; below it, indented, come the sentence and perhaps the cure."""
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    starts = [at for at, line in enumerate(lines) if not line.startswith(" ")]
    entries = [lines[start:end] for start, end in pairwise([*starts, len(lines)])]
    return {code: Reason(code, *map(str.strip, words)) for code, *words in entries}


REASONS = _table(Path(__file__).with_name("reason_codes.txt").read_text(encoding="utf-8"))
"""Every reason code, with its sentence and what to do about it."""


def reason(code: str) -> Reason:
    """The table's entry; :class:`KeyError` for a code that nobody defined."""
    return REASONS[code]


class CloseCode(IntEnum):
    """WebSocket close codes of our servers (4000-4999 is the range for applications, RFC 6455 §7.4.2)."""

    BAD_MESSAGE = 4400
    AUTH = 4401
    FORBIDDEN = 4403
    TIMEOUT = 4408
    REPLACED = 4409
    TOO_LARGE = 4413
    TOO_SLOW = 4429


CLOSE_REASONS: dict[int, str] = {
    CloseCode.BAD_MESSAGE: "signal.bad_message",
    CloseCode.AUTH: "auth.failed",
    CloseCode.FORBIDDEN: "auth.forbidden",
    CloseCode.TIMEOUT: "signal.timeout",
    CloseCode.REPLACED: "signal.replaced",
    CloseCode.TOO_LARGE: "signal.too_large",
    CloseCode.TOO_SLOW: "signal.too_slow",
}
"""The reason behind a close code of a WebSocket."""


class ResultCode(IntEnum):
    """The numbers that the original MOSAIC server puts on the wire and into REST envelopes."""

    SUCCESS = 100
    ACCESS_TOKEN_DECRYPTING_FAILED = 2002
    ACCESS_TOKEN_EXPIRED = 2004
    ACCESS_TOKEN_NOT_EXIST = 2015
    UNKNOWN_EXCEPTION_OCCURRED = 10000
    INVALID_FORMAT = 10001
    UNKNOWN_WEBSOCKET_REQUEST_TYPE = 10002
    ACCESS_DENIED = 10020
    AUTHENTICATION_FAILED = 10021
    WEBSOCKET_SESSION_NOT_EXIST = 10050
    ROBOT_WS_SESSION_NOT_EXIST = 10051
    USER_WS_SESSION_NOT_EXIST = 10052
    WEBRTC_SESSION_NOT_EXIST = 10053
    INVALID_ROBOT_AUTH_TYPE = 10055
    USER_NOT_FOUND = 10060
    USER_NOT_ACTIVE = 10061
    INVALID_PASSWORD = 10062
    USER_ALREADY_EXISTS = 10064
    CANNOT_DELETE_YOURSELF = 10069
    OCCUPANCY_MAP_NOT_FOUND = 10080
    ROBOT_NOT_FOUND = 20001
    ROBOT_NOT_IN_SAME_ORGANIZATION = 20006
    ROBOT_NOT_READY_TO_CONNECT = 20007


RESULT_REASONS: dict[int, str] = {
    ResultCode.ACCESS_TOKEN_DECRYPTING_FAILED: "auth.failed",
    ResultCode.ACCESS_TOKEN_EXPIRED: "auth.expired",
    ResultCode.ACCESS_TOKEN_NOT_EXIST: "auth.required",
    ResultCode.INVALID_FORMAT: "signal.bad_message",
    ResultCode.UNKNOWN_WEBSOCKET_REQUEST_TYPE: "signal.bad_message",
    ResultCode.ACCESS_DENIED: "auth.forbidden",
    ResultCode.AUTHENTICATION_FAILED: "auth.failed",
    ResultCode.WEBSOCKET_SESSION_NOT_EXIST: "signal.robot_offline",
    ResultCode.ROBOT_WS_SESSION_NOT_EXIST: "signal.robot_offline",
    ResultCode.USER_WS_SESSION_NOT_EXIST: "signal.no_user_socket",
    ResultCode.WEBRTC_SESSION_NOT_EXIST: "signal.unknown_connection",
    ResultCode.USER_NOT_FOUND: "auth.failed",
    ResultCode.USER_NOT_ACTIVE: "auth.forbidden",
    ResultCode.INVALID_PASSWORD: "auth.failed",
    ResultCode.CANNOT_DELETE_YOURSELF: "auth.own_account",
    ResultCode.OCCUPANCY_MAP_NOT_FOUND: "signal.unknown_map",
    ResultCode.ROBOT_NOT_FOUND: "auth.unknown_robot",
    ResultCode.ROBOT_NOT_IN_SAME_ORGANIZATION: "auth.forbidden",
    ResultCode.ROBOT_NOT_READY_TO_CONNECT: "signal.robot_busy",
}
"""The reason behind a number of the original server."""

"""Reads and writes what travels on the channel of a request connector: plain JSON, the same toward everybody.

==================================================  =========================================================
operator → robot                                    robot → operator
==================================================  =========================================================
``{"id": "7", "question": {…}}``                    ``{"id": "7", "progress": …}``
``{"id": "7", "cancel": true}``                     ``{"id": "7", "answer": …}``
a question alone: what answers it has no ``id``     ``{"id": "7", "refused": {"code": "…", "message": "…"}}``
==================================================  =========================================================
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, TypeAlias

from mosaic_core.words.errors import Refused
from mosaic_core.words.plain_text import plain

MAX_ID_LENGTH = 64
"""Characters."""
MAX_QUESTION_BYTES = 64 * 1024
MAX_ANSWER_BYTES = 1024 * 1024
"""More belongs on a connector with the delivery ``bulk``."""
MAX_MESSAGE_LENGTH = 500
"""Characters of a refusal's text."""


@dataclass(frozen=True, slots=True)
class RequestQuestion:
    """A question; ``id`` is the operator's, ``None`` where it came alone."""

    id: str | None
    question: Any


@dataclass(frozen=True, slots=True)
class RequestCancel:
    """The operator no longer wants the answer."""

    id: str


@dataclass(frozen=True, slots=True)
class RequestProgress:
    """How far a request has got, in the handler's own words."""

    id: str | None
    progress: Any


@dataclass(frozen=True, slots=True)
class RequestAnswer:
    """The end of a request that was answered."""

    id: str | None
    answer: Any


@dataclass(frozen=True, slots=True)
class RequestRefusal:
    """The end of a request that was not."""

    id: str | None
    code: str
    message: str = ""


RequestReply: TypeAlias = RequestProgress | RequestAnswer | RequestRefusal


def question_of(payload: bytes) -> RequestQuestion | RequestCancel:
    """What an operator says; raises :class:`Refused`. Whether the question is one that the connector takes, is not
    looked at."""
    if len(payload) > MAX_QUESTION_BYTES:
        raise Refused("request.too_large")
    try:
        value = json.loads(payload)
    except (ValueError, RecursionError):
        return RequestQuestion(None, None)  # whoever reads the question will say what is wrong with it
    if not isinstance(value, dict) or "id" not in value or not ("question" in value or value.get("cancel") is True):
        return RequestQuestion(None, value)
    number = value["id"]
    if not isinstance(number, str) or not 0 < len(number) <= MAX_ID_LENGTH or not number.isprintable():
        raise Refused("request.bad_id")
    return RequestCancel(number) if "question" not in value else RequestQuestion(number, value["question"])


def question_text(word: RequestQuestion | RequestCancel) -> dict[str, Any]:
    """What an operator sends."""
    return (
        {"id": word.id, "cancel": True}
        if isinstance(word, RequestCancel)
        else {"id": word.id, "question": word.question}
    )


def reply_of(payload: bytes) -> RequestReply | None:
    """What a robot says; ``None``: it is no reply to a request."""
    try:
        value = json.loads(payload)
    except (ValueError, RecursionError):
        return None
    if not isinstance(value, dict) or not isinstance(number := value.get("id"), str | None):
        return None
    if "answer" in value:
        return RequestAnswer(number, value["answer"])
    if "progress" in value:
        return RequestProgress(number, value["progress"])
    refused = value.get("refused")
    if not isinstance(refused, dict):
        return None
    return RequestRefusal(
        number, str(refused.get("code", "")), plain(str(refused.get("message", "")))[:MAX_MESSAGE_LENGTH]
    )


def reply_text(word: RequestReply) -> dict[str, Any]:
    """What a robot sends."""
    head = {} if word.id is None else {"id": word.id}
    match word:
        case RequestAnswer():
            return {**head, "answer": word.answer}
        case RequestProgress():
            return {**head, "progress": word.progress}
        case RequestRefusal():
            return {**head, "refused": {"code": word.code, "message": word.message[:MAX_MESSAGE_LENGTH]}}

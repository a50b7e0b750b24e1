"""Feeds receivers what no honest program sends, as a stranger's browser could, over a robot in memory."""

from __future__ import annotations

import json
import random
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from mosaic_core.contract.declared.nested_models import is_model
from mosaic_core.contract.handler import message_type_of
from mosaic_core.drill.command_stream import opened
from mosaic_core.drill.commands import DrillCommand
from mosaic_core.drill.findings import ExerciseFailed, NotExercised
from mosaic_core.drill.recorder import is_refusal
from mosaic_core.drill.rig import DrilledReceiver, Rig, comes_true, rig_of
from mosaic_core.ladder.examinee import Examinee
from mosaic_core.ladder.fault import DoesNotApply, NotJudged
from mosaic_core.machines.delivery.framing import PayloadKind

REACTION_S = 0.01
"""For each; of refusals alike an operator hears the first, so there may be none to wait for."""
_SEED = 1
_RANDOM_PAYLOADS = 24


async def fed_with_garbage(one: Examinee) -> list[tuple[type[Any], str, str]]:
    """``(class, garbage, cause)`` for each receiver that failed over it. Raises :class:`NotJudged`, and
    :class:`DoesNotApply` where nothing is received."""
    if not one.receivers():
        raise DoesNotApply("it takes nothing")
    found: list[tuple[type[Any], str, str]] = []
    async with rig_of(one.configured(one.trial), live=True) as rig:
        for subject in rig.subjects:
            if subject.safety.is_motion and not is_model(message_type_of(type(subject.handler))):
                raise NotJudged("it moves something by messages of any shape: give them a model first")
            try:
                found += await _failures_of(rig, subject)
            except (ExerciseFailed, NotExercised) as reason:
                raise NotJudged(f"nobody can command it, mend safety-drill first: {reason}") from None
    return found


async def _failures_of(rig: Rig, subject: DrilledReceiver) -> list[tuple[type[Any], str, str]]:
    as_json = replace(subject, command=subject.command or DrillCommand({}, PayloadKind.JSON))
    async with opened(rig, as_json) as stream:
        for payload in garbage():
            before = len(subject.recorder.acts) + len(stream.who.refusals)
            stream.say(payload)
            await comes_true(lambda: len(subject.recorder.acts) + len(stream.who.refusals) > before, REACTION_S)  # noqa: B023
            failed = next((act for act in subject.recorder.acts if _is_failure(act.kind, act.cause)), None)
            if failed is not None:
                return [(type(subject.handler), _shown(payload), failed.cause)]
    return []


def _is_failure(kind: str, cause: str) -> bool:
    return kind == "failed" and not is_refusal(cause)


def garbage() -> Iterator[bytes]:
    """Payloads that make no sense, the same ones each time."""
    yield from (b"", b"{", b"null", b"[]", b"{}", b"42", b'"text"', b"\xff\xfe\x00", b'{"a": NaN}', b"[" * 2000)
    yield json.dumps({"unknown": {"deep": [1, 2, {"er": None}]}}).encode()
    yield b'{"x": ' + b"9" * 400 + b"}"
    chance = random.Random(_SEED)
    for _ in range(_RANDOM_PAYLOADS):
        yield chance.randbytes(chance.randrange(1, 200))


def _shown(payload: bytes) -> str:
    return repr(payload[:40]) + ("…" if len(payload) > 40 else "")

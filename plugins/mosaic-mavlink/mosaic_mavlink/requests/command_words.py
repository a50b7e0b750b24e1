"""A command and its acknowledgement: repeated until it is answered, told in words with what the vehicle says. Pure."""

from __future__ import annotations

from typing import Any, ClassVar

from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_mavlink.link.codec import named
from mosaic_mavlink.link.outgoing import OutgoingMessage, command_message
from mosaic_mavlink.link.status_texts import printable
from mosaic_mavlink.requests.conversation import Concluded, Conversation, Effect, NotConcluded, ShowProgress

REASON_S = 0.6
"""ArduPilot tells why it does not arm in texts, shortly before or after it refuses."""
WORK_PATIENCE_S = 20.0
"""A command that is being carried out, such as a calibration, is waited for so long between two reports."""
MAX_TEXTS = 8
UNKNOWN_PERCENT = 255
_WORDS = {
    words.MAV_RESULT_TEMPORARILY_REJECTED: ("mavlink.not_now", "not now: wait a moment, then ask again"),
    words.MAV_RESULT_DENIED: ("mavlink.denied", "denied: its state or mode does not allow it; see mavlink-state"),
    words.MAV_RESULT_UNSUPPORTED: ("mavlink.unsupported", "this vehicle does not know the command"),
    words.MAV_RESULT_FAILED: ("mavlink.failed", "it could not do it: mend what it says, then ask again"),
}


class CommandConversation(Conversation):
    """Sends one ``COMMAND_LONG``. ``what``: the command in words. The result is what the vehicle said meanwhile."""

    listens: ClassVar[frozenset[str]] = frozenset({"COMMAND_ACK", "STATUSTEXT"})
    attempts: ClassVar[int] = 4

    def __init__(self, what: str, command: int, params: tuple[float, ...]) -> None:
        super().__init__()
        self.what = what
        self._command = command
        self._params = params
        self._texts: list[str] = []
        self._refused: int | None = None

    def begin(self, now_s: float) -> list[Effect]:
        return self.say(now_s, command_message(self._command, self._params))

    def repeated(self, count: int) -> tuple[OutgoingMessage, ...]:
        return (command_message(self._command, self._params, confirmation=count - 1),)

    def hear(self, message: Any, now_s: float) -> list[Effect]:
        if message.get_type() == "STATUSTEXT":
            if message.severity <= words.MAV_SEVERITY_WARNING and len(self._texts) < MAX_TEXTS:
                self._texts.append(printable(message.text))
            return []
        if message.command != self._command or self._refused is not None:
            return []
        if message.result == words.MAV_RESULT_ACCEPTED:
            return [Concluded(list(self._texts))]
        if message.result == words.MAV_RESULT_IN_PROGRESS:
            self._count = self.attempts
            self.deadline_s = now_s + WORK_PATIENCE_S
            percent = 0 if message.progress == UNKNOWN_PERCENT else message.progress
            return [ShowProgress(percent, 100, "being carried out")]
        self._refused = message.result
        self.deadline_s = now_s + REASON_S
        return []

    def time_passed(self, now_s: float) -> list[Effect]:
        if self._refused is None or now_s < self.deadline_s:
            return super().time_passed(now_s)
        unknown = ("mavlink.failed", f"the vehicle answers {named('MAV_RESULT', self._refused)}")
        code, said = _WORDS.get(self._refused, unknown)
        reasons = "; it says: " + "; ".join(dict.fromkeys(self._texts)) if self._texts else ""
        return [NotConcluded(code, f"{self.what}: {said}{reasons}")]

"""Questions on the control channel whose answer carries no number: the next fitting message, or a refusal, is it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from mosaic_core.operator.control.lease import LeaseDenied
from mosaic_core.words import control
from mosaic_core.words.control import CONTROL_LABEL, STOP_LABEL, ControlMessage
from mosaic_core.words.errors import ConnectionFailed

Fits = Callable[[ControlMessage], bool]
_CONTROL_LABELS = (CONTROL_LABEL, STOP_LABEL)


class RobotAnswers:
    """Finds the answer to a question among all that the robot says. Event loop only."""

    def __init__(self) -> None:
        self._expected: dict[asyncio.Future[ControlMessage], Fits] = {}

    def expect(self, fits: Fits) -> asyncio.Future[ControlMessage]:
        """Call it before asking: from now on the first message that ``fits`` is the answer."""
        answer: asyncio.Future[ControlMessage] = asyncio.get_running_loop().create_future()
        self._expected[answer] = fits
        return answer

    async def wait(self, answer: asyncio.Future[ControlMessage], timeout_s: float, silence: str) -> ControlMessage:
        """The answer. Raises :class:`LeaseDenied` with the code of a refusal, :class:`ConnectionFailed` if the
        connection ends or nothing comes in time (``silence`` says so in words)."""
        try:
            async with asyncio.timeout(timeout_s):
                return await answer
        except TimeoutError:
            raise ConnectionFailed(silence, code="channel.timeout") from None
        finally:
            self._expected.pop(answer, None)

    def heard(self, message: ControlMessage) -> None:
        """Everything that the robot says goes through here."""
        is_refusal = isinstance(message, control.Refusal) and message.label in _CONTROL_LABELS
        for answer, fits in list(self._expected.items()):
            if answer.done():
                continue
            if isinstance(message, control.Refusal) and is_refusal:
                answer.set_exception(LeaseDenied("", message.code, message.message or ""))
            elif fits(message):
                answer.set_result(message)

    def ended(self, error: ConnectionFailed) -> None:
        for answer in self._expected:
            if not answer.done():
                answer.set_exception(error)

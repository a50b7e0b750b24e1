"""The built-in connector ``connection-check``: echoes every text verbatim, so that an operator can time the round trip.

Its channels are those of the original MOSAIC: ``L-receiver`` takes, ``L-sender`` answers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelSendable, DataChannelStringReceivable, Handler
from mosaic_core.contract.host import Sender
from mosaic_core.contract.params import NoParams


class EchoSender(DataChannelSendable[str]):
    """Answers on ``L-sender``."""

    is_part: ClassVar[bool] = True


class EchoReceiver(DataChannelStringReceivable):
    """Takes on ``L-receiver``; the answer goes to the operator that asked, and to no other."""

    takes_observers: ClassVar[bool] = True
    is_part: ClassVar[bool] = True

    def __init__(self, label: str, answers: EchoSender) -> None:
        super().__init__(label)
        self._answers = answers

    def handle_data(self, data: str, sender: Sender) -> None:
        self._answers.send_string(data, to=sender)


class ConnectionCheckConfigurer(DataChannelConfigurer[NoParams]):
    """Echoes texts, so that operators see the round-trip time."""

    connector_type = "connection-check"

    def configure(self) -> Sequence[Handler]:
        answers = EchoSender(f"{self.label}-sender")
        return [EchoReceiver(f"{self.label}-receiver", answers), answers]

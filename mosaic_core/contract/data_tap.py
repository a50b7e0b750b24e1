"""A tap of data: what the connectors of the same robot send and are told, for those who record or forward it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Protocol, Self

from mosaic_core.contract.sender import Sender
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.words.data_type import MosaicDataType


@dataclass(frozen=True, slots=True)
class TappedChannel:
    """A data channel of the robot, as the catalogue has it. ``schema_id`` and ``message_schema`` are those of what it
    sends; of a bidirectional one, of what it takes."""

    label: str
    connector_type: str
    data_type: MosaicDataType
    schema_id: str = ""
    message_schema: Mapping[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class TappedMessage:
    """A message of a tapped connector, byte for byte as it travels.

    ``sender``: the operator who sent it; ``None`` where the robot did. ``code`` and ``gate`` say why a command was
    refused; both are empty where it was carried out. ``stamped_at_s``: when it was made, of a command when it arrived;
    ``tapped_at_s``: when it was sent, or when it was known what became of the command. Both are seconds of the robot's
    monotonic clock."""

    label: str
    kind: PayloadKind
    payload: bytes
    stamped_at_s: float
    tapped_at_s: float
    sender: Sender | None = None
    code: str = ""
    gate: str = ""


class DataTap(Protocol):
    """The messages of one connector, tapped on the robot. Open while it is entered; a connector that runs only while
    somebody listens runs for it alone. Begins with the value that a late listener would get. For one thread at a time.
    """

    @property
    def channels(self) -> Sequence[TappedChannel]:
        """The channels that it was opened for, and the robot has."""

    @property
    def dropped(self) -> int:
        """Messages that were lost, the oldest first, because :meth:`next` was not called for too long."""

    @property
    def failure(self) -> str:
        """The code why nothing can come: ``channel.unknown_label`` for a label that the robot does not have, or
        ``peer.shutdown``; empty while something may."""

    def next(self, timeout_s: float) -> TappedMessage | None:
        """Wait for the next message; ``None`` when ``timeout_s`` is over. Raises nothing."""

    def __enter__(self) -> Self: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

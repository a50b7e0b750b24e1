"""The networks that a test may put between robot and operator: in memory, or real WebRTC, good or bad."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, Self, cast

from mosaic_core.laboratory.detours import LocalListener
from mosaic_core.laboratory.impaired_offerer import impaired_operator, robot_ice_servers
from mosaic_core.laboratory.impaired_path import ImpairedPath
from mosaic_core.laboratory.natted_path import NattedPath
from mosaic_core.machines.laboratory.impaired_link import LinkProfile
from mosaic_core.machines.laboratory.nat import NatKind
from mosaic_core.runtime.transport.media_transport import PictureStreamFactory, SoundStreamFactory
from mosaic_core.runtime.transport.operator_transport import Offerer, OffererListener
from mosaic_core.runtime.transport.transport import Answerer, AnswererFactory, AnswererListener
from mosaic_core.words.ice import IceServer


class Network(Protocol):
    """Makes the peer connections that :func:`~mosaic_core.testing.joined` needs. Event loop only, but for the three
    that change it."""

    open_stream: PictureStreamFactory
    """Makes the robot's end of a camera."""
    open_sound: SoundStreamFactory
    """Makes the robot's end of a microphone."""

    def offerer(self, listener: OffererListener, ice_servers: Sequence[IceServer]) -> Offerer:
        """The operator's end of a new connection."""

    def answerer(self, listener: AnswererListener, ice_servers: Sequence[IceServer]) -> Answerer:
        """The robot's end of a new connection."""

    @property
    def robot_ice_servers(self) -> tuple[IceServer, ...]:
        """The ICE servers that the robot is told of."""

    def become(self, profile: LinkProfile | str) -> None:
        """Another network from now on, both ways."""

    def cut(self) -> None:
        """From now on nothing arrives, and nobody is told: a cable was pulled."""

    def heal(self) -> None:
        """The cable is back."""


class WebRtcNetwork:
    """Real peer connections over UDP, through a path in user space that delays, loses, reorders and throttles real
    packets; with ``nat`` from behind such a NAT on both sides (a pair: the robot's, the operator's), with a STUN and,
    unless ``with_relay`` is off, a TURN server between them. ``with`` runs it."""

    def __init__(
        self,
        profile: LinkProfile | str = "pristine",
        *,
        nat: NatKind | tuple[NatKind, NatKind] | None = None,
        with_relay: bool = True,
        seed: int = 1,
    ) -> None:
        from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
        from mosaic_core.adapters.peers.aiortc_offerer import AiortcOfferer
        from mosaic_core.adapters.sound.shared_sound import SharedSound
        from mosaic_core.adapters.video.shared_video import SharedVideo

        self.open_stream: PictureStreamFactory = SharedVideo
        self.open_sound: SoundStreamFactory = SharedSound
        self.path = _path(profile, nat, with_relay, seed)
        self.answerer: AnswererFactory = lambda listener, ice_servers: AiortcAnswerer(
            cast("AnswererListener", LocalListener(listener)), ice_servers
        )
        self.offerer = impaired_operator(AiortcOfferer, self.path)

    def __enter__(self) -> Self:
        self.path.__enter__()
        return self

    def __exit__(self, *exception: object) -> None:
        self.path.__exit__(*exception)

    @property
    def robot_ice_servers(self) -> tuple[IceServer, ...]:
        """The relay between the two, if there is one."""
        return robot_ice_servers(self.path)

    def become(self, profile: LinkProfile | str) -> None:
        """Any thread."""
        self.path.become(profile)

    def cut(self) -> None:
        """Any thread."""
        self.path.is_cut = True

    def heal(self) -> None:
        """Any thread."""
        self.path.is_cut = False


def _path(
    profile: LinkProfile | str, nat: NatKind | tuple[NatKind, NatKind] | None, with_relay: bool, seed: int
) -> ImpairedPath:
    if nat is None:
        return ImpairedPath(profile, seed=seed)
    robot, operator = (nat, nat) if isinstance(nat, str) else nat
    return NattedPath(profile, robot=robot, operator=operator, with_relay=with_relay, seed=seed)

"""Pairs this machine with robots on its network, finds them again wherever they are, and lets go of them."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Iterable, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass

from mosaic_core.adapters.lan.robot_certificate import certificate_to_pin
from mosaic_core.adapters.lan.robot_search import announced_robots
from mosaic_core.machines.lan.announced_robots import MOST_ADDRESSES, meant_robot
from mosaic_core.machines.lan.pairing_secret import pairing_secret
from mosaic_core.machines.lan.robot_url import robot_url
from mosaic_core.operator.lan.paired_robots import PairedRobot, PairedRobots
from mosaic_core.operator.lan.robot_door import RobotDoor
from mosaic_core.words.errors import AuthError, MosaicError, SignalingError

SEARCH_S = 2.0
PATIENCE_S = 20.0
"""For all addresses of a robot together, whoever announces them."""


@dataclass(frozen=True, slots=True)
class PairablePlace:
    """The address of a robot that may be paired with. ``robot_id``: as announced, or ``None`` where only the address is
    known."""

    name: str
    url: str
    certificate: str = ""
    robot_id: str | None = None


async def place_to_pair(robot: str) -> PairablePlace:
    """The robot of this address, announced name or id. Raises :class:`SignalingError` (``lan.not_found``,
    ``lan.several``, ``lan.search``, ``signal.unreachable``)."""
    async with _in_time(robot):
        url = robot_url(robot)
        if url is not None:
            return await _place([url], None)
        announced = meant_robot(robot, await announced_robots(SEARCH_S))
        return await _place(announced.urls, announced.robot_id)


@asynccontextmanager
async def _in_time(robot: str) -> AsyncIterator[None]:
    try:
        async with asyncio.timeout(PATIENCE_S):
            yield
    except TimeoutError as error:
        message = f"the robot {robot!r} did not answer within {PATIENCE_S:.0f} s"
        raise SignalingError(message, code="signal.unreachable") from error


async def _place(urls: Sequence[str], robot_id: str | None) -> PairablePlace:
    """At the first address that answers as a robot's own server."""
    for url in urls:
        try:
            certificate = await certificate_to_pin(url)
            async with RobotDoor(url, certificate) as door:
                return PairablePlace(await door.robot_name(), url, certificate, robot_id)
        except SignalingError:
            if url == urls[-1]:
                raise
    raise AssertionError("a robot is announced with an address")


async def pair_at(place: PairablePlace, secret: str, device: str = "") -> tuple[PairedRobot, str]:
    """Pair with the robot there by its PIN or code; it is kept, and its role for this machine told.

    ``device``: what the robot calls this machine; by default the host's name. Raises :class:`AuthError`
    (``auth.pairing``, ``auth.pairing_locked``), and :class:`SignalingError` (``lan.other_robot``) for a robot that goes
    by the id of another.
    """
    kept = PairedRobots()
    kept.all()  # what can't be read is told before the PIN is used
    async with RobotDoor(place.url, place.certificate) as door:
        paired = await door.pair(pairing_secret(secret), (device or socket.gethostname())[:60])
        before = kept.of_id(paired.robot_id)
        is_another = place.robot_id not in (None, paired.robot_id)
        if is_another or (before is not None and not await door.proves(before.access_token)):
            await _give_back(door, paired.access_token)
            message = f"{place.url} goes by the id of another robot than this machine knows; it was not paired"
            raise SignalingError(message, code="lan.other_robot")
        robot = PairedRobot(
            robot_id=paired.robot_id,
            name=paired.robot_name,
            url=place.url,
            access_token=paired.access_token,
            certificate=place.certificate,
        )
        try:
            kept.keep(robot)
        except MosaicError:
            await _give_back(door, paired.access_token)
            raise
        if before is not None:
            await _give_back(door, before.access_token)
    return robot, paired.role


async def _give_back(door: RobotDoor, access_token: str) -> None:
    with suppress(MosaicError):
        await door.unpair(access_token)


async def paired_robot(robot: str) -> PairedRobot:
    """A robot of :class:`PairedRobots` where it is now: it has proved to be the one, and the sign-in counts.

    Raises :class:`SignalingError` (``lan.not_paired``, ``lan.several``, ``lan.not_found``, ``lan.other_robot``) and
    :class:`AuthError` (``lan.not_paired``) where this machine was revoked.
    """
    known = PairedRobots().named(robot)
    async with _in_time(robot):
        found = await _found(known)
    async with RobotDoor(found.url, found.certificate) as door:
        try:
            name = await door.current_name(found.access_token)
        except AuthError as error:
            message = f"the robot {known.name!r} no longer takes the sign-in of this machine"
            raise AuthError(message, code="lan.not_paired") from error
    found = found.model_copy(update={"name": name or found.name})
    if found != known:
        PairedRobots().keep(found)
    return found


async def _found(known: PairedRobot) -> PairedRobot:
    """At the address where it was, else where it announces itself."""
    others: list[str] = []
    found = await _proved_at([known.url], known, others)
    if found is not None:
        return found
    failure = SignalingError(
        f"the robot {known.name!r} neither answers at {known.url} nor announces itself here", code="lan.not_found"
    )
    try:
        announced = [one for one in await announced_robots(SEARCH_S) if one.robot_id == known.robot_id]
        urls = [url for one in announced for url in one.urls]
        found = await _proved_at(urls[:MOST_ADDRESSES], known, others)
    except SignalingError as error:
        message = f"the robot {known.name!r} does not answer at {known.url}, and {error.message}"
        failure = SignalingError(message, code=error.code, cure=error.cure)
    if found is not None:
        return found
    if others:
        message = f"at {others[0]} is another robot than the {known.name!r} that this machine is paired with"
        raise SignalingError(message, code="lan.other_robot")
    raise failure


async def _proved_at(urls: Iterable[str], known: PairedRobot, others: list[str]) -> PairedRobot | None:
    """The robot at the first address that proves to be it; ``others`` gets the addresses that answer and do not."""
    for url in urls:
        with suppress(SignalingError):  # nothing answers there
            async with RobotDoor(url, known.certificate) as door:
                if await door.proves(known.access_token):
                    return known.model_copy(update={"url": url})
                others.append(url)
    return None


async def unpair(robot: str) -> bool:
    """Forget a robot; whether the robot has forgotten this machine, too. Raises :class:`SignalingError` for one that is
    not paired."""
    known = PairedRobots().named(robot)
    try:
        found = await paired_robot(known.robot_id)
        async with RobotDoor(found.url, found.certificate) as door:
            await door.unpair(found.access_token)
    except AuthError:
        return True  # the robot has let go already
    except SignalingError:
        return False
    finally:
        PairedRobots().forget(known.robot_id)
    return True

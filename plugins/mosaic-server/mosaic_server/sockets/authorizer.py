"""Checks what a socket's `authorize` says against the database, and which admissions still hold later."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy.exc import SQLAlchemyError

from mosaic_core.words.codes import CloseCode, ResultCode
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import Authorize, OperatorIdentity, agreed_extensions
from mosaic_server.ids import is_uuid
from mosaic_server.security.access_tokens import AccessTokenRefused, AccessTokens
from mosaic_server.security.turn_credentials import MAX_LIFETIME_S
from mosaic_server.storage.accounts import Person, login_versions, person_by_id, shown_name
from mosaic_server.storage.database import Database
from mosaic_server.storage.ice_servers import StoredIceServer, listed_ice_servers
from mosaic_server.storage.robots import RobotLogin, admissions, log_in_robot
from mosaic_server.switchboard.events import AuthorizationRefused, OperatorAuthorized, RobotAuthorized, Side

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class AdmittedSocket:
    """The credentials that a socket was let in with; it has to leave when that no longer holds."""

    side: Side
    id: str
    proof: str
    expires_at_s: int | None = None


def identity_of(person: Person, name: str = "") -> OperatorIdentity:
    """Who speaks on a socket. Its role is another on every robot and is decided with each ticket. ``name``: as it is
    shown to others (``storage.accounts.shown_name``)."""
    return OperatorIdentity(id=person.id, name=name or person.full_name or person.email, program=person.is_program)


class Authorizer:
    """Checks who may use a socket. Event-loop thread; database work happens on worker threads. Never logs what it is
    given.
    """

    def __init__(
        self, database: Database, access_tokens: AccessTokens, turn_lifetime_s: float = MAX_LIFETIME_S
    ) -> None:
        self._database = database
        self._turn_lifetime_s = turn_lifetime_s
        self._access_tokens = access_tokens
        self._admitted: dict[int, AdmittedSocket] = {}
        self._complained_of: set[str] = set()

    async def check(
        self, socket: int, side: Side, message: Authorize
    ) -> RobotAuthorized | OperatorAuthorized | AuthorizationRefused:
        check = self._robot if side is Side.ROBOT else self._operator
        try:
            return await check(socket, message)
        except SQLAlchemyError:
            _log.exception("nobody can be authorized: the database does not answer")
            return AuthorizationRefused(socket, ResultCode.UNKNOWN_EXCEPTION_OCCURRED, time.monotonic())

    def forget(self, socket: int) -> None:
        self._admitted.pop(socket, None)

    async def _robot(self, socket: int, message: Authorize) -> RobotAuthorized | AuthorizationRefused:
        robot_id = message.robot_id
        if robot_id is None or not is_uuid(robot_id):
            return AuthorizationRefused(socket, ResultCode.UNKNOWN_EXCEPTION_OCCURRED, time.monotonic())
        login = await self._database.run(log_in_robot, robot_id.lower(), message.data)
        if login is None:
            return AuthorizationRefused(socket, ResultCode.ROBOT_NOT_FOUND, time.monotonic(), bare=True)
        if not isinstance(login, RobotLogin):
            return AuthorizationRefused(socket, ResultCode.AUTHENTICATION_FAILED, time.monotonic())
        self._admitted[socket] = AdmittedSocket(Side.ROBOT, login.robot.id, login.admitted_by)
        return RobotAuthorized(
            socket,
            login.robot.id,
            login.robot.organization_id,
            time.monotonic(),
            agreed_extensions(message.extensions),
            await self.ice_servers(login.robot.id),
        )

    async def _operator(self, socket: int, message: Authorize) -> OperatorAuthorized | AuthorizationRefused:
        try:
            person, expires_at_s = await self.person_of(message.access_token)
        except AccessTokenRefused as error:
            return AuthorizationRefused(socket, error.code, time.monotonic())
        self._admitted[socket] = AdmittedSocket(Side.OPERATOR, person.id, str(person.login_version), expires_at_s)
        return OperatorAuthorized(
            socket,
            identity_of(person, await self._database.run(shown_name, person.id)),
            person.organization_id,
            time.monotonic(),
            agreed_extensions(message.extensions),
            await self.ice_servers(person.id),
        )

    async def person_of(self, access_token: str | None) -> tuple[Person, int]:
        """Whose token this is and when it expires; raises :class:`AccessTokenRefused`."""
        claims = self._access_tokens.read(access_token)
        person = await self._database.run(person_by_id, claims.account_id)
        if person is None or not person.is_active or person.login_version != claims.login_version:
            raise AccessTokenRefused(ResultCode.AUTHENTICATION_FAILED)
        return person, claims.expires_at_s

    async def ice_servers(self, party_id: str) -> tuple[IceServer, ...]:
        """All of them, with fresh credentials for this robot or account."""
        (servers,) = await self.ice_servers_for([party_id])
        return servers

    async def ice_servers_for(self, party_ids: Sequence[str]) -> list[tuple[IceServer, ...]]:
        """The same for several at once, in their order."""
        stored = await self._database.run(listed_ice_servers)
        self._complain(stored)
        now_s = time.time()  # the TURN server compares with its own wall clock
        issued = [[one.issued(party_id, now_s, self._turn_lifetime_s) for one in stored] for party_id in party_ids]
        return [tuple(one for one in servers if one is not None) for servers in issued]

    def _complain(self, stored: Sequence[StoredIceServer]) -> None:
        """Once per entry: databases of older servers may hold some that are not handed out."""
        for one in stored:
            if one.lacks_credentials and one.id not in self._complained_of:
                self._complained_of.add(one.id)
                _log.warning(
                    "the TURN server %s is handed to nobody, for it has neither a shared secret nor user name and "
                    "credential: `mosaic server ice remove %s`, then add it with --secret-file",
                    " ".join(one.server.urls),
                    one.id,
                )

    async def revoked(self) -> list[tuple[int, CloseCode]]:
        """Sockets whose token was renewed, whose account was disabled, whose log-in has expired."""
        versions = await self._database.run(login_versions)
        robots = await self._database.run(admissions)
        now_s = time.time()
        ended: list[tuple[int, CloseCode]] = []
        for socket, admission in self._admitted.items():
            if admission.side is Side.ROBOT:
                holds = robots.get(admission.id) == admission.proof
            else:
                holds = str(versions.get(admission.id)) == admission.proof
            if not holds or (admission.expires_at_s is not None and now_s >= admission.expires_at_s):
                ended.append((socket, CloseCode.AUTH))
        return ended

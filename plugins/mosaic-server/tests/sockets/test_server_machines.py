"""The small pure parts: keep-alive, message rate, codes, log-in limits, tokens, origins."""

from __future__ import annotations

import time
from pathlib import Path

import jwt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.words.codes import ResultCode
from mosaic_server.ids import is_uuid
from mosaic_server.security.access_tokens import AccessTokenRefused, AccessTokens
from mosaic_server.security.one_time_codes import OneTimeCodes, OneTimeLogin
from mosaic_server.security.passwords import check_password, hash_password, new_password
from mosaic_server.security.robot_tokens import hash_of_token, new_robot_token, token_matches
from mosaic_server.sockets.keep_alive import KeepAlive, KeepAlivePeriods
from mosaic_server.storage.database import Database, DatabaseInUse
from mosaic_server.storage.keys import access_token_secret, ticket_key
from mosaic_server.storage.tables import Base
from mosaic_server.web.guards import content_security_policy
from mosaic_server.web.origins import host_name, origin_is_allowed


@given(st.floats(0, 100), st.floats(0.01, 1))
def test_a_dead_socket_is_found_within_fifteen_seconds_whenever_it_dies(died_s: float, jitter_s: float) -> None:
    keep_alive = KeepAlive(KeepAlivePeriods())
    keep_alive.watch(1, 0.0)
    now_s = 0.0
    while True:
        now_s += jitter_s
        answered_s = min(now_s, died_s)
        if keep_alive.check(now_s, lambda _: answered_s).dead:  # noqa: B023 - called at once
            break
    assert died_s < now_s <= died_s + 15


def test_pings_go_out_once_per_period() -> None:
    keep_alive = KeepAlive(KeepAlivePeriods())
    keep_alive.watch(1, 0.0)
    pings = [now_s for now_s in range(1, 21) if keep_alive.check(now_s, lambda _: 100.0).ping]
    assert pings == [5, 10, 15, 20]
    keep_alive.forget(1)
    assert keep_alive.check(30.0, lambda _: 0.0).ping == []


def test_after_a_suspend_everybody_gets_time_to_answer() -> None:
    keep_alive = KeepAlive(KeepAlivePeriods())
    keep_alive.watch(1, 0.0)
    keep_alive.check(1.0, lambda _: 1.0)
    woken = keep_alive.check(1000.0, lambda _: 1.0)
    assert woken.dead == []
    assert woken.ping == [1]
    for now_s in range(1001, 1012):
        assert keep_alive.check(float(now_s), lambda _: 1.0).dead == []
    assert keep_alive.check(1012.0, lambda _: 1.0).dead == [1]


def test_a_code_expires_and_works_once() -> None:
    codes = OneTimeCodes()
    ada = OneTimeLogin("ada", 1)
    code = codes.issue(ada, 0.0)
    assert codes.redeem("other", 1.0) is None
    assert codes.redeem(code, 1.0) == ada
    assert codes.redeem(code, 1.0) is None
    assert codes.redeem(codes.issue(ada, 0.0), 60.0) is None
    first = codes.issue(ada, 0.0)
    for _ in range(1000):
        codes.issue(OneTimeLogin("more", 1), 0.0)
    assert codes.redeem(first, 0.0) is None, "open codes are bounded"


def test_access_tokens_are_refused_with_the_original_codes() -> None:
    tokens = AccessTokens(b"k" * 32)
    good = tokens.make("ada", "org", "ROLE_USER", 3)
    assert tokens.read(good).login_version == 3
    expired = jwt.encode(
        {"iss": "mosaic-server", "iat": 1, "exp": int(time.time()) - 1, "userId": "a", "ver": 1}, b"k" * 32
    )
    unsigned = jwt.encode({"iss": "mosaic-server", "iat": 1, "exp": 9e9, "userId": "a", "ver": 1}, "", algorithm="none")
    for token, code in (
        (None, ResultCode.AUTHENTICATION_FAILED),
        ("nonsense", ResultCode.ACCESS_TOKEN_NOT_EXIST),
        (AccessTokens(b"x" * 32).make("ada", "org", "r", 3), ResultCode.ACCESS_TOKEN_DECRYPTING_FAILED),
        (expired, ResultCode.ACCESS_TOKEN_EXPIRED),
        (unsigned, ResultCode.ACCESS_TOKEN_NOT_EXIST),
    ):
        with pytest.raises(AccessTokenRefused) as refused:
            tokens.read(token)
        assert refused.value.code is code


def test_passwords_and_robot_tokens() -> None:
    stored = hash_password("long enough")
    assert check_password(stored, "long enough") == stored
    assert check_password(stored, "wrong") is None
    assert check_password(None, "long enough") is None
    assert len({new_password() for _ in range(50)}) == 50
    with pytest.raises(ValueError, match="8 to 1024"):
        hash_password("short")
    token = new_robot_token()
    assert len(token) >= 43
    assert token_matches(hash_of_token(token), token)
    assert not token_matches(hash_of_token(token), token + "x")
    assert not token_matches(None, token)
    assert not token_matches(hash_of_token(""), "")


def test_only_pages_of_this_very_host_may_open_sockets() -> None:
    host = {"host": "robots.example:9001"}
    assert origin_is_allowed(host, ())
    assert origin_is_allowed(host | {"origin": "https://robots.example:9001"}, ())
    assert not origin_is_allowed(host | {"origin": "https://robots.example"}, ())
    assert not origin_is_allowed(host | {"origin": "null"}, ())
    assert not origin_is_allowed({"origin": "https://"}, ())
    assert origin_is_allowed(host | {"origin": "http://localhost:5173"}, {"http://localhost:5173"})


def test_host_names_are_read_and_never_reach_the_policy_unchecked() -> None:
    assert host_name("[::1]:9001") == "::1"
    assert host_name("LOCALHOST:9001") == "localhost"
    assert host_name("[broken") == ""
    assert "evil" not in content_security_policy("x; script-src evil")


@given(st.text(max_size=40))
def test_only_canonical_uuids_are_ids(text: str) -> None:
    assert not is_uuid(text) or len(text) == 36


def test_a_sqlite_file_belongs_to_one_server(tmp_path: Path) -> None:
    first, second = Database(tmp_path), Database(tmp_path)
    first.lock()
    with pytest.raises(DatabaseInUse, match=r"another MOSAIC server is running on .*--data-dir"):
        second.lock()
    first.close()
    second.lock()
    second.close()


def test_migrations_and_tables_say_the_same_and_keys_are_kept(tmp_path: Path) -> None:
    from alembic.autogenerate import compare_metadata
    from alembic.migration import MigrationContext

    database = Database(tmp_path)
    database.migrate()
    database.migrate()
    with database.engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []
    assert database.work(access_token_secret) == database.work(access_token_secret)
    keys = [database.work(ticket_key).public_key().public_bytes_raw() for _ in range(2)]
    assert keys[0] == keys[1]
    database.close()

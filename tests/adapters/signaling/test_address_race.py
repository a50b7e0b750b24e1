"""All addresses of a name at once: the first that works wins, nothing of the others stays."""

from __future__ import annotations

import asyncio
import logging
import ssl
import subprocess
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
import uvloop
from aioice import stun

from mosaic_core.adapters.aiortc_private.ice import gathering
from mosaic_core.adapters.signaling import address_race
from mosaic_core.adapters.signaling.address_race import first_address
from mosaic_core.adapters.signaling.named_tls import NamedTls
from mosaic_core.machines.timing.pacing import ComplaintPace
from mosaic_core.words.ice import parse_ice_url

LONG_S = 20.0


class Attempts:
    """What becomes of a try is said by its address."""

    def __init__(self) -> None:
        self.cancelled: list[str] = []
        self.given_back: list[str] = []

    async def attempt(self, address: str) -> str:
        match address.split("-")[0]:
            case "dead":
                try:
                    await asyncio.Event().wait()
                except asyncio.CancelledError:
                    self.cancelled.append(address)
                    raise
            case "unreachable":
                raise OSError("Network is unreachable")
            case "refusing":
                raise stun.TransactionFailed(stun.Message(stun.Method.ALLOCATE, stun.Class.ERROR))
            case "slow":
                for _ in range(20):
                    await asyncio.sleep(0)
        return address

    async def give_back(self, result: str) -> None:
        self.given_back.append(result)


async def looked_up(addresses: Sequence[str]) -> Sequence[str]:
    return addresses


async def all_left() -> None:
    async with asyncio.timeout(LONG_S):
        await address_race._leaving.done()


async def race(*addresses: str, timeout_s: float = LONG_S) -> tuple[str, Attempts]:
    attempts = Attempts()
    try:
        return await first_address(looked_up(addresses), attempts.attempt, timeout_s, attempts.give_back), attempts
    finally:
        await all_left()


async def test_a_dead_address_delays_nobody_and_is_dropped() -> None:
    began_s = time.monotonic()
    won, attempts = await race("dead-1", "good", "dead-2")
    assert won == "good"
    assert attempts.cancelled == ["dead-1", "dead-2"]
    assert time.monotonic() - began_s < LONG_S / 2


async def test_what_a_second_address_got_is_given_back() -> None:
    won, attempts = await race("slow", "good", "unreachable")
    assert (won, attempts.given_back) == ("good", ["slow"])


@pytest.mark.parametrize(
    ("addresses", "error"),
    [
        (("dead", "refusing", "unreachable"), stun.TransactionFailed),
        (("dead", "unreachable"), TimeoutError),
        (("unreachable", "unreachable"), OSError),
    ],
)
async def test_the_error_that_tells_most_is_raised(addresses: Sequence[str], error: type[Exception]) -> None:
    with pytest.raises(error) as failed:
        await race(*addresses, timeout_s=0.05)
    assert type(failed.value) is error


async def test_a_look_up_counts_as_well() -> None:
    never: asyncio.Future[Sequence[str]] = asyncio.get_running_loop().create_future()
    with pytest.raises(TimeoutError):
        await first_address(never, Attempts().attempt, 0.05)


async def test_who_gives_up_the_race_gives_up_all_tries() -> None:
    attempts = Attempts()

    racing = asyncio.create_task(first_address(looked_up(["dead-1", "dead-2"]), attempts.attempt, LONG_S))
    await asyncio.sleep(0.01)
    racing.cancel()
    await asyncio.gather(racing, return_exceptions=True)
    await all_left()
    assert attempts.cancelled == ["dead-1", "dead-2"]


# -- TLS ---------------------------------------------------------------------------------------------------------


def certificate(folder: Path, name: str) -> tuple[Path, Path]:
    made, key = folder / "certificate.pem", folder / "key.pem"
    words = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
    words += ["-days", "2", "-subj", f"/CN={name}", "-addext", f"subjectAltName=DNS:{name}"]
    subprocess.run([*words, "-keyout", str(key), "-out", str(made)], check=True, capture_output=True)
    return made, key


async def shaken_hands(made: Path, key: Path, name: str) -> str:
    serving = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    serving.load_cert_chain(made, key)
    loop = asyncio.get_running_loop()
    server = await loop.create_server(asyncio.Protocol, "127.0.0.1", 0, ssl=serving)
    port = server.sockets[0].getsockname()[1]
    try:
        transport, _ = await loop.create_connection(asyncio.Protocol, "127.0.0.1", port, ssl=NamedTls.of(name))
        version = str(transport.get_extra_info("ssl_object").version())
        transport.close()
        return version
    finally:
        server.close()


@pytest.mark.parametrize("new_loop", [asyncio.new_event_loop, uvloop.new_event_loop])
def test_by_its_address_a_server_is_verified_for_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, new_loop: Callable[[], asyncio.AbstractEventLoop]
) -> None:
    made, key = certificate(tmp_path, "turn.example")
    monkeypatch.setenv("SSL_CERT_FILE", str(made))
    with asyncio.Runner(loop_factory=new_loop) as runner:
        assert runner.run(shaken_hands(made, key, "turn.example")).startswith("TLS")
        with pytest.raises(ssl.SSLCertVerificationError, match=r"other\.example"):
            runner.run(shaken_hands(made, key, "other.example"))
    monkeypatch.delenv("SSL_CERT_FILE")
    with (
        asyncio.Runner(loop_factory=new_loop) as runner,
        pytest.raises(ssl.SSLCertVerificationError, match=r"self.signed"),
    ):
        runner.run(shaken_hands(made, key, "turn.example"))


# -- the log -----------------------------------------------------------------------------------------------------


async def test_a_dead_server_is_logged_once_however_many_connections_ask_it(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(gathering, "_dead_servers", ComplaintPace(gathering.TOLD_AGAIN_S))
    caplog.set_level(logging.DEBUG, logger=gathering.__name__)

    async def refused() -> None:
        raise ConnectionRefusedError("refused")

    for _ in range(3):
        asked = object.__new__(gathering.EarlyGathering)
        await asked._attempt(parse_ice_url("turn:nobody.example"), refused())
    levels = [record.levelno for record in caplog.records if "nobody.example" in record.getMessage()]
    assert levels == [logging.INFO, logging.DEBUG, logging.DEBUG]

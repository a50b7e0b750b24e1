"""Addresses, NAT, STUN and TURN: what a direct path needs, and the relay for where there is none.

Every URL is asked by itself, all at once; a TURN server that is silent by one protocol is tried by the other, because
the cure is often just that.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass

from mosaic_core.adapters.diagnosis.stun_probe import StunSurvey, stun_survey
from mosaic_core.adapters.diagnosis.turn_probe import TurnAnswer, turn_probe
from mosaic_core.adapters.machine.network_watch import all_addresses, host_addresses
from mosaic_core.machines.diagnosis.host_addresses import addresses_verdict
from mosaic_core.machines.diagnosis.nat_kind import NatVerdict, nat_verdict
from mosaic_core.words.finding import OK, Finding, failed, passed, skipped, warned
from mosaic_core.words.ice import IceServer, IceUrl, parse_ice_url


@dataclass(frozen=True, slots=True)
class Relay:
    """One TURN URL with its credentials."""

    url: IceUrl
    server: IceServer


async def address_checks() -> AsyncIterator[Finding]:
    """What this machine can offer by itself."""
    offered = host_addresses()
    code, sentence = addresses_verdict(offered or all_addresses())
    if code == OK:
        yield passed("network.addresses", sentence, addresses=offered)
    elif code == "ice.no_ipv4":
        yield warned("network.addresses", code, sentence, facts={"addresses": offered})
    else:
        yield failed("network.addresses", code, sentence, facts={"addresses": offered})


def relays_of(servers: Sequence[IceServer]) -> list[Relay]:
    """Every TURN URL."""
    parsed = [Relay(parse_ice_url(url), server) for server in servers for url in server.urls]
    return [one for one in parsed if one.url.scheme.startswith("turn")]


async def ice_checks(servers: Sequence[IceServer], unknown_because: str = "") -> AsyncIterator[Finding]:
    """All of them; ``servers`` are the configuration's and the server's. ``unknown_because``: why the latter are not
    among them; then nothing is said of what they lack."""
    if unknown_because:
        yield skipped("ice.servers", unknown_because)
    urls = [parse_ice_url(url) for server in servers for url in server.urls]
    if not urls:
        if not unknown_because:
            yield warned("ice.servers", "ice.no_servers")
        return
    relays = relays_of(servers)
    # one question per address: TURN servers answer those of STUN as well
    asked = {(url.host, url.port): url for url in urls if url.scheme == "turn" and url.transport == "udp"}
    asked |= {(url.host, url.port): url for url in urls if url.scheme == "stun"}
    survey, answers, others = await asyncio.gather(
        stun_survey(list(asked.values())),
        asyncio.gather(*(_asked(one) for one in relays)),
        asyncio.gather(*(_asked(one) for one in _other_ways(relays))),
    )
    for finding in stun_findings(survey):
        yield finding
    if asked:
        yield nat_finding(nat_verdict(survey.local_port, all_addresses(), survey.mappings))
    if relays or not unknown_because:
        for finding in relay_findings(answers, others):
            yield finding


async def _asked(one: Relay) -> TurnAnswer:
    return await turn_probe(one.url, one.server.username, one.server.credential)


def _other_ways(relays: Sequence[Relay]) -> list[Relay]:
    """The same servers by the protocol that nobody configured."""
    known = {str(one.url) for one in relays}
    swapped = {"udp": "tcp", "tcp": "udp"}
    found: dict[str, Relay] = {}
    for one in relays:
        other = one.url.model_copy(update={"transport": swapped[one.url.transport]})
        if one.url.scheme == "turn" and str(other) not in known:
            found[str(other)] = Relay(other, one.server)
    return list(found.values())


def stun_findings(survey: StunSurvey) -> list[Finding]:
    """One per STUN URL; that a TURN server is silent is told by its own probe."""
    found = []
    for one in survey.answers:
        if not one.url.startswith("stun"):
            continue
        facts = {"url": one.url, "ms": round(one.took_ms, 1)}
        if one.mapping is not None:
            found.append(passed("ice.stun", f"{one.url} answers in {one.took_ms:.0f} ms.", **facts))
        else:
            found.append(warned("ice.stun", "ice.stun_silent", f"{one.url}: {one.problem}.", facts=facts))
    return found


def nat_finding(verdict: NatVerdict) -> Finding:
    """What the NAT means for connections."""
    facts = {"kind": verdict.kind, "publicAddresses": list(verdict.public_hosts), "keepsPort": verdict.keeps_port}
    match verdict.kind:
        case "symmetric":
            return warned("ice.nat", "ice.nat_symmetric", verdict.sentence, facts=facts)
        case "unknown":
            return warned("ice.nat", "ice.nat_unknown", verdict.sentence, facts=facts)
        case "blocked":
            return warned("ice.nat", "ice.stun_silent", verdict.sentence, facts=facts)
        case _:
            return passed("ice.nat", verdict.sentence, **facts)


def relay_findings(answers: Sequence[TurnAnswer], others: Sequence[TurnAnswer] = ()) -> list[Finding]:
    """One per TURN URL, and one about all. A dead URL beside a working one is only a warning: nobody waits for it."""
    if not answers:
        return [warned("ice.relay", "ice.no_turn", "STUN alone is known, no TURN server.")]
    works = any(one.code == OK for one in answers)
    problem = warned if works else failed
    found = []
    for one in answers:
        facts = {"url": one.url, "ms": round(one.took_ms, 1)}
        if one.code == OK:
            found.append(passed("ice.turn", f"{one.url} gives an address in {one.took_ms:.0f} ms.", **facts))
        else:
            cure = _other_way(one, others)
            found.append(problem("ice.turn", one.code, f"{one.url}: {one.problem}.", cure, facts))
    if works:
        found.append(passed("ice.relay", "Connections that find no direct path go through a TURN server."))
    else:
        found.append(failed("ice.relay", "ice.no_turn"))
    return found


def _other_way(silent: TurnAnswer, others: Sequence[TurnAnswer]) -> str:
    """The cure, where the same server answers by the other protocol."""
    place = silent.url.partition("?")[0]
    found = next((one for one in others if one.code == OK and one.url.partition("?")[0] == place), None)
    return "" if found is None else f"It answers by the other protocol: add {found.url}."

"""The small verdicts of a diagnosis: refusals of TURN servers, addresses, clocks, certificates, what to do first."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.diagnosis.first_steps import MAX_STEPS, first_steps
from mosaic_core.machines.diagnosis.host_addresses import address_kind, addresses_verdict
from mosaic_core.machines.diagnosis.turn_answer import turn_refusal
from mosaic_core.machines.peers.chosen_path import ChosenPath
from mosaic_core.machines.timing.clock_skew import clock_skew
from mosaic_core.words.codes import REASONS
from mosaic_core.words.finding import Finding, failed, passed, skipped, warned


@pytest.mark.parametrize(
    ("error", "code"),
    [(401, "ice.turn_refused"), (403, "ice.turn_forbidden"), (437, "ice.turn_failed"), (486, "ice.turn_quota"),
     (508, "ice.turn_quota"), (442, "ice.turn_failed"), (438, "ice.turn_refused")],
)  # fmt: skip
def test_error_codes_of_turn_servers_are_explained(error: int, code: str) -> None:
    found, words = turn_refusal(error)
    assert found == code
    assert str(error) in words


@given(st.integers(0, 999), st.text(max_size=20))
def test_an_error_that_nobody_knows_is_told_as_it_is(error: int, phrase: str) -> None:
    code, words = turn_refusal(error, phrase)
    assert code in REASONS
    assert str(error) in words


@pytest.mark.parametrize(
    ("host", "kind"),
    [("127.0.0.1", "loopback"), ("::1", "loopback"), ("169.254.3.4", "link-local"), ("fe80::1%eth0", "link-local"),
     ("192.168.1.2", "private"), ("100.100.1.1", "shared"), ("fd00::2", "unique-local"), ("9.9.9.9", "public"),
     ("2606:4700::1", "public")],
)  # fmt: skip
def test_addresses_have_their_kind(host: str, kind: str) -> None:
    assert address_kind(host) == kind


@pytest.mark.parametrize(
    ("hosts", "code"),
    [([], "ice.no_address"), (["127.0.0.1", "::1"], "ice.no_address"),
     (["169.254.1.1", "fe80::1"], "ice.link_local_only"),
     (["2606:4700::1"], "ice.no_ipv4"), (["169.254.1.1", "fd00::2"], "ice.no_ipv4"), (["10.0.0.2"], "check.ok"),
     (["127.0.0.1", "10.0.0.2", "fd00::2"], "check.ok")],
)  # fmt: skip
def test_what_a_machine_can_offer(hosts: list[str], code: str) -> None:
    assert addresses_verdict(hosts)[0] == code


@given(st.floats(-86400, 86400), st.floats(0, 8), st.floats(0, 1))
def test_the_skew_is_found_within_its_error(ahead_s: float, trip_s: float, share: float) -> None:
    server_s = 1_000_000.25 + trip_s * share - ahead_s
    skew = clock_skew(1_000_000.25, 1_000_000.25 + trip_s, float(int(server_s)))
    assert abs(skew.ahead_s - ahead_s) <= skew.error_s + 1e-6


def test_a_skew_is_noticed_and_breaks_tickets_at_its_limits() -> None:
    def skew(ahead_s: float) -> tuple[bool, bool]:
        found = clock_skew(1000.0 + ahead_s, 1000.0 + ahead_s, 999.5)
        return found.is_noticeable, found.breaks_tickets

    assert skew(3.0) == (False, False)
    assert skew(-30.0) == (True, False)
    assert skew(30.0) == (True, False)
    assert skew(-61.0) == (True, True), "tickets are from the future"
    assert skew(300.0) == (True, False)
    assert skew(361.0) == (True, True), "tickets look expired"
    assert "30 s behind" in clock_skew(1000.0, 1000.0, 1029.5).sentence


def test_a_cause_comes_before_what_it_explains() -> None:
    found = [
        failed("server.tcp", "signal.unreachable"),
        failed("server.token", "auth.failed"),
        warned("ice.servers", "ice.no_servers"),
        warned("machine.realtime", "check.no_realtime"),
        passed("machine.python", "Python."),
        skipped("device.x", "No."),
    ]
    assert [one.check for one in first_steps(found)] == ["server.tcp", "machine.realtime"]
    assert first_steps(found[4:]) == ()


@pytest.mark.parametrize("effect", ["server.tcp", "ice.servers", "device.camera"])
def test_a_file_that_cannot_be_read_explains_what_it_should_have_told(effect: str) -> None:
    found = [failed(check, "config.invalid") for check in (effect, "machine.python", "config.yaml")]
    assert [one.check for one in first_steps(found)] == ["machine.python", "config.yaml"]


CHECKS = ["config.yaml", "server.dns", "server.tls", "server.token", "ice.turn", "ice.relay", "relay.connection", "x.y"]


@given(st.lists(st.tuples(st.sampled_from(CHECKS), st.sampled_from(["ok", "warn", "fail", "skipped"])), max_size=20))
def test_whenever_something_is_wrong_there_is_a_first_step(told: list[tuple[str, str]]) -> None:
    found = [Finding.model_validate({"check": check, "status": status, "code": "check.ok", "sentence": "x."})
             for check, status in told]  # fmt: skip
    steps = first_steps(found)
    assert len(steps) <= MAX_STEPS
    assert bool(steps) == any(one.status in ("warn", "fail") for one in found)
    if any(one.status == "fail" for one in found):
        assert steps[0].status == "fail"


def test_a_path_is_told_without_addresses_and_for_programs_with_them() -> None:
    path = ChosenPath("host", "relay", "udp", "[fd00::2]:5000", "[fd00::3]:5001")
    assert path.summary() == "host → relay over UDP, IPv6"
    assert path.facts()["remoteAddress"] == "[fd00::3]:5001"
    assert ChosenPath("host", "host", "udp", "10.0.0.1:1", "10.0.0.2:2").family == "IPv4"


def test_a_finding_takes_sentence_and_cure_from_its_code() -> None:
    finding = failed("server.token", "auth.failed")
    assert (finding.sentence, finding.cure) == (REASONS["auth.failed"].sentence, REASONS["auth.failed"].cure)
    assert finding.group == "server"
    assert warned("a.b", "auth.failed", "Other.", "", {"x": 1}).wire()["facts"] == {"x": 1}
    with pytest.raises(KeyError):
        failed("a.b", "nobody.defined")

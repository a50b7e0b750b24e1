"""Handshakes in memory with peers of every kind of certificate and suite, in both roles."""

from __future__ import annotations

from itertools import chain, repeat

import pytest
from aiortc import RTCConfiguration, RTCPeerConnection
from aiortc.rtcdtlstransport import SRTP_PROFILES, RTCCertificate, generate_certificate
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from OpenSSL import SSL

from mosaic_core.adapters.aiortc_private.dtls import CIPHER_SUITES, PeerCertificate, speak_dtls_with_everyone

ECDSA = ec.generate_private_key(ec.SECP256R1())
RSA = rsa.generate_private_key(65537, 2048)
SHORT_RSA = rsa.generate_private_key(65537, 1024)
DTLS_1_0, DTLS_1_2 = 0xFEFF, 0xFEFD
EVERY_SUITE = b"ALL:@SECLEVEL=0"
Key = ec.EllipticCurvePrivateKey | rsa.RSAPrivateKey


def ours() -> SSL.Context:
    return PeerCertificate.generateCertificate()._create_ssl_context(SRTP_PROFILES)


def theirs(key: Key, suites: bytes = EVERY_SUITE, version: int = DTLS_1_2) -> SSL.Context:
    """A library that accepts whatever it gets."""
    context = SSL.Context(SSL.DTLS_METHOD)
    context.set_cipher_list(suites)
    context.set_min_proto_version(version)
    context.set_max_proto_version(version)
    context.set_verify(SSL.VERIFY_PEER | SSL.VERIFY_FAIL_IF_NO_PEER_CERT, lambda *_: True)
    context.use_certificate(generate_certificate(key))  # type: ignore[arg-type] # written for ECDSA, signs with either
    context.use_privatekey(key)
    return context


def shaken(client: SSL.Context, server: SSL.Context) -> tuple[SSL.Connection, SSL.Connection]:
    """Both ends after the handshake. Raises :class:`SSL.Error` if one refuses."""
    ends = SSL.Connection(client), SSL.Connection(server)
    ends[0].set_connect_state()
    ends[1].set_accept_state()
    waiting = set(ends)
    for one, other in chain.from_iterable(repeat((ends, ends[::-1]), 8)):
        try:
            one.do_handshake()
            waiting.discard(one)
        except SSL.WantReadError:
            pass
        carry(one, other)
    assert not waiting
    return ends


def carry(one: SSL.Connection, other: SSL.Connection) -> None:
    try:
        while True:
            other.bio_write(one.bio_read(1 << 16))
    except SSL.WantReadError:
        pass


@pytest.mark.parametrize("key", [ECDSA, RSA], ids=["ECDSA", "RSA"])
def test_a_peer_of_either_certificate_is_accepted_in_both_roles(key: Key) -> None:
    for client, server in ((ours(), theirs(key)), (theirs(key), ours())):
        for end in shaken(client, server):
            assert end.get_protocol_version() == DTLS_1_2


def test_without_ours_a_server_with_an_rsa_certificate_is_refused() -> None:
    plain = RTCCertificate.generateCertificate()._create_ssl_context(SRTP_PROFILES)
    with pytest.raises(SSL.Error):
        shaken(plain, theirs(RSA))


@pytest.mark.parametrize("suite", CIPHER_SUITES)
def test_each_suite_is_one_that_is_spoken(suite: str) -> None:
    key = RSA if "-RSA-" in suite else ECDSA
    client, _ = shaken(ours(), theirs(key, suite.encode()))
    assert client.get_cipher_name() == suite


@pytest.mark.parametrize(
    "suite",
    [
        "AES128-GCM-SHA256",  # no forward secrecy
        "DHE-RSA-AES128-GCM-SHA256",  # groups of the server's choice
        "ECDHE-RSA-AES128-SHA", "ECDHE-RSA-AES128-SHA256",  # no authenticated encryption
    ],
)  # fmt: skip
def test_a_server_that_has_weak_suites_alone_is_refused(suite: str) -> None:
    with pytest.raises(SSL.Error, match="no shared cipher"):
        shaken(ours(), theirs(RSA, suite.encode()))


@pytest.mark.parametrize("we_are", ["client", "server"])
def test_a_short_rsa_key_is_refused(we_are: str) -> None:
    pair = (ours(), theirs(SHORT_RSA)) if we_are == "client" else (theirs(SHORT_RSA), ours())
    with pytest.raises(SSL.Error, match="certificate verify failed"):
        shaken(*pair)


@pytest.mark.parametrize("we_are", ["client", "server"])
def test_dtls_1_0_is_refused(we_are: str) -> None:
    old = theirs(ECDSA, version=DTLS_1_0)
    with pytest.raises(SSL.Error):
        shaken(*((ours(), old) if we_are == "client" else (old, ours())))


def test_our_own_certificate_is_ecdsa_on_p256() -> None:
    client, _ = shaken(theirs(RSA), ours())
    certificate = client.get_peer_certificate(as_cryptography=True)
    assert certificate is not None
    key = certificate.public_key()
    assert isinstance(key, ec.EllipticCurvePublicKey)
    assert key.curve.name == "secp256r1"


async def test_a_peer_connection_hands_its_certificates_to_the_transports_that_it_makes() -> None:
    pc = RTCPeerConnection(RTCConfiguration(iceServers=[]))
    before = pc._RTCPeerConnection__certificates  # type: ignore[attr-defined]
    assert [type(one) for one in before] == [RTCCertificate]
    speak_dtls_with_everyone(pc)
    pc.createDataChannel("x")
    assert pc.sctp is not None
    used = pc.sctp.transport._RTCDtlsTransport__local_certificate  # type: ignore[attr-defined]
    assert isinstance(used, PeerCertificate)
    await pc.close()

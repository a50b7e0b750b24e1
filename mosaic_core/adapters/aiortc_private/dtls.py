"""DTLS with peers whose certificate is RSA, as GStreamer makes it by default: aiortc offers suites for ECDSA alone.

What our side offers, as client and as server:

- **DTLS 1.2 and later** (RFC 8827 §6.5; RFC 8996 ends DTLS 1.0). OpenSSL 4.0 has no DTLS 1.3 yet; once it has, the
  suites of 1.3 are all authenticated encryption with forward secrecy.
- :data:`CIPHER_SUITES`: ECDHE with AES-GCM or ChaCha20-Poly1305, first the one that RFC 8827 §6.5 demands of everybody.
  The four without AES-256 are what Chromium 156 offers (in a ClientHello that was looked at); libraries on OpenSSL like
  AES-256. Chromium's others, AES-CBC with SHA-1 and RSA key exchange, are left out (RFC 9325 §4.1 and §4.2), so that
  aiortc's own two of the former are gone.
- Groups and signatures as OpenSSL has them: X25519, P-256 and P-384, which Chromium has too, X448 and P-521; SHA-2 with
  ECDSA and RSA.
- For SRTP what aiortc and Chromium have: AES-GCM (RFC 7714) and the AES128_CM_SHA1_80 that RFC 8827 §6.5 demands.
- No renegotiation (RFC 8827 §6.5).

Our own certificate stays ECDSA on P-256, which every peer can verify (RFC 8827 §6.5): a suite names the kind of the
*server's* certificate, and a client brings either. Whose certificate it is, aiortc finds out by its fingerprint; but it
takes keys of any length, ours none below the 112 bits of security (RSA: 2 048) of RFC 9325 §4.5.
"""

from __future__ import annotations

from aiortc import RTCCertificate, RTCPeerConnection
from aiortc.rtcdtlstransport import SRTPProtectionProfile
from OpenSSL import SSL
from OpenSSL.crypto import X509

DTLS_1_2 = 0xFEFD
KEY_TOO_SMALL = 66
"""OpenSSL's X509_V_ERR_EE_KEY_TOO_SMALL."""
CIPHER_SUITES = (
    "ECDHE-ECDSA-AES128-GCM-SHA256", "ECDHE-RSA-AES128-GCM-SHA256",
    "ECDHE-ECDSA-CHACHA20-POLY1305", "ECDHE-RSA-CHACHA20-POLY1305",
    "ECDHE-ECDSA-AES256-GCM-SHA384", "ECDHE-RSA-AES256-GCM-SHA384",
)  # fmt: skip


class PeerCertificate(RTCCertificate):
    """An ECDSA certificate of ours, and with it the terms on which our side speaks DTLS."""

    def _create_ssl_context(self, srtp_profiles: list[SRTPProtectionProfile]) -> SSL.Context:
        context = super()._create_ssl_context(srtp_profiles)
        context.set_min_proto_version(DTLS_1_2)
        context.set_options(SSL.OP_NO_RENEGOTIATION)
        context.set_cipher_list(":".join(CIPHER_SUITES).encode())
        context.set_verify(SSL.VERIFY_PEER | SSL.VERIFY_FAIL_IF_NO_PEER_CERT, _is_accepted)
        return context


def _is_accepted(_: SSL.Connection, __: X509, error: int, *_is_fine: int) -> bool:
    """Nobody vouches for a certificate here, it signs itself: OpenSSL's complaints about that don't count."""
    return error != KEY_TOO_SMALL


def speak_dtls_with_everyone(pc: RTCPeerConnection) -> None:
    """Give ``pc`` a :class:`PeerCertificate` before anything is added to it: a transport gets it when it is made."""
    pc._RTCPeerConnection__certificates = [PeerCertificate.generateCertificate()]  # type: ignore[attr-defined]

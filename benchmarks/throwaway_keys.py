"""A private authority and one certificate, for the minutes that a benchmark takes."""

from __future__ import annotations

import datetime
import ipaddress
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

LIFETIME = datetime.timedelta(hours=1)


def tls_settings(folder: Path) -> dict[str, object]:
    """Make the keys in a folder; return Zenoh's settings for TLS with certificates on both sides."""
    authority_key = ec.generate_private_key(ec.SECP256R1())
    node_key = ec.generate_private_key(ec.SECP256R1())
    authority = _certificate("authority", authority_key, "authority", authority_key, True)
    node = _certificate("node", node_key, "authority", authority_key, False)
    files = {"authority.pem": _pem(authority), "node.pem": _pem(node), "node.key": _key(node_key)}
    for name, data in files.items():
        (folder / name).write_bytes(data)
    tls = "transport/link/tls"
    return {
        f"{tls}/root_ca_certificate": str(folder / "authority.pem"),
        f"{tls}/listen_private_key": str(folder / "node.key"),
        f"{tls}/listen_certificate": str(folder / "node.pem"),
        f"{tls}/connect_private_key": str(folder / "node.key"),
        f"{tls}/connect_certificate": str(folder / "node.pem"),
        f"{tls}/enable_mtls": True,
        f"{tls}/verify_name_on_connect": True,
    }


def _certificate(
    name: str,
    key: ec.EllipticCurvePrivateKey,
    issuer: str,
    issuer_key: ec.EllipticCurvePrivateKey,
    is_authority: bool,
) -> x509.Certificate:
    now = datetime.datetime.now(datetime.UTC)
    names: list[x509.GeneralName] = [
        x509.DNSName("localhost"),
        x509.IPAddress(ipaddress.ip_address("127.0.0.1")),
    ]
    return (
        x509.CertificateBuilder()
        .subject_name(_name(name))
        .issuer_name(_name(issuer))
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - LIFETIME)
        .not_valid_after(now + LIFETIME)
        .add_extension(x509.SubjectAlternativeName(names), False)
        .add_extension(x509.BasicConstraints(is_authority, None), True)
        .sign(issuer_key, hashes.SHA256())
    )


def _name(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)])


def _pem(certificate: x509.Certificate) -> bytes:
    return certificate.public_bytes(serialization.Encoding.PEM)


def _key(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )

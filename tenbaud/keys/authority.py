"""A small private certificate authority: one certificate per node; its key stays on its machine.

A certificate says who a node is (its common name), what it is for (its role, as organisational unit)
and at which addresses it may be listened for (subject alternative names). Keys are ECDSA P-256.
"""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import load_pem_private_key
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

ORGANISATION = "tenbaud"
AUTHORITY_DAYS = 3650
NODE_DAYS = 365
CLOCK_SLACK = timedelta(minutes=10)
"""A node whose clock is behind by so much takes a fresh certificate all the same."""
LOCAL_HOSTS = ("localhost", "127.0.0.1", "::1")
"""In every certificate, so that both ends can be tried on one machine."""


class NodeRole(StrEnum):
    """The purpose of a certificate."""

    TRANSMITTER = "transmitter"
    RECEIVER = "receiver"
    ROUTER = "router"
    VIEWER = "viewer"


@dataclass(frozen=True, slots=True)
class Certified:
    """The contents of a node's certificate."""

    name: str
    role: NodeRole
    hosts: tuple[str, ...]
    """addresses that it may be listened for at, this machine's own left out"""
    begins: datetime
    expires: datetime

    def days_left(self) -> float:
        """Return the days until it expires; negative afterwards."""
        return (self.expires - datetime.now(UTC)).total_seconds() / 86_400.0


@dataclass(frozen=True, slots=True)
class Pem:
    """A certificate and its private key, both as PEM."""

    certificate: bytes
    private_key: bytes


def new_authority(name: str, days: float = AUTHORITY_DAYS) -> Pem:
    """Return a fresh authority of this name, valid for a number of days."""
    key = ec.generate_private_key(ec.SECP256R1())
    subject = _name(name, None)
    usage = _usage(signs_certificates=True)
    certificate = (
        _builder(subject, subject, key, days)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(usage, critical=True)
        .sign(key, hashes.SHA256())
    )
    return _pem(certificate, key)


def issue(
    authority: Pem, name: str, role: NodeRole, hosts: tuple[str, ...], days: float = NODE_DAYS
) -> Pem:
    """Return a fresh key and certificate for a node; it never outlives its authority."""
    root = x509.load_pem_x509_certificate(authority.certificate)
    root_key = load_pem_private_key(authority.private_key, None)
    key = ec.generate_private_key(ec.SECP256R1())
    names = [_general_name(host) for host in dict.fromkeys((*hosts, *LOCAL_HOSTS))]
    both_sides = [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]
    certificate = (
        _builder(_name(name, role), root.subject, key, days, root.not_valid_after_utc)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs_certificates=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage(both_sides), critical=False)
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
        .sign(root_key, hashes.SHA256())  # type: ignore[arg-type]
    )
    return _pem(certificate, key)


def read_certificate(pem: bytes) -> Certified:
    """Return the fields of a node's certificate; ValueError for a foreign one."""
    certificate = x509.load_pem_x509_certificate(pem)
    names = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    roles = certificate.subject.get_attributes_for_oid(NameOID.ORGANIZATIONAL_UNIT_NAME)
    if not names or not roles:
        raise ValueError("the certificate names no node and no role")
    alternative = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    hosts = [*map(str, alternative.get_values_for_type(x509.IPAddress))]
    hosts += alternative.get_values_for_type(x509.DNSName)
    return Certified(
        str(names[0].value),
        NodeRole(str(roles[0].value)),
        tuple(host for host in hosts if host not in LOCAL_HOSTS),
        certificate.not_valid_before_utc,
        certificate.not_valid_after_utc,
    )


def end_of(certificate_pem: bytes) -> datetime:
    """Return when any certificate expires, an authority's too; ValueError if it is not one."""
    return x509.load_pem_x509_certificate(certificate_pem).not_valid_after_utc


def is_key_of(key_pem: bytes, certificate_pem: bytes) -> bool:
    """Return whether a private key belongs to a certificate; ValueError if it is not a key."""
    key = load_pem_private_key(key_pem, None)
    return key.public_key() == x509.load_pem_x509_certificate(certificate_pem).public_key()


def is_signed_by(certificate_pem: bytes, authority_pem: bytes) -> bool:
    """Return whether a certificate comes from this authority."""
    certificate = x509.load_pem_x509_certificate(certificate_pem)
    authority = x509.load_pem_x509_certificate(authority_pem)
    try:
        certificate.verify_directly_issued_by(authority)
    except (ValueError, TypeError, InvalidSignature):
        return False
    return True


def _name(common_name: str, role: NodeRole | None) -> x509.Name:
    parts = [x509.NameAttribute(NameOID.ORGANIZATION_NAME, ORGANISATION)]
    if role is not None:
        parts.append(x509.NameAttribute(NameOID.ORGANIZATIONAL_UNIT_NAME, role.value))
    parts.append(x509.NameAttribute(NameOID.COMMON_NAME, common_name))
    return x509.Name(parts)


def _builder(
    subject: x509.Name,
    issuer: x509.Name,
    key: ec.EllipticCurvePrivateKey,
    days: float,
    latest: datetime | None = None,
) -> x509.CertificateBuilder:
    now = datetime.now(UTC)
    expires = now + timedelta(days=days)
    if latest is not None:
        expires = min(expires, latest)
    # A certificate that is made expired, for tests, still ends after it begins.
    begins = min(now - CLOCK_SLACK, expires - CLOCK_SLACK)
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(begins)
        .not_valid_after(expires)
    )


def _usage(signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def _general_name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _pem(certificate: x509.Certificate, key: ec.EllipticCurvePrivateKey) -> Pem:
    encoding = serialization.Encoding.PEM
    return Pem(
        certificate.public_bytes(encoding),
        key.private_bytes(encoding, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()),
    )

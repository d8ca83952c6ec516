"""An end's identity and access rules as settings of Zenoh: TLS with client certificates.

TLS proves who is at the other end of a connection: both sides show a certificate of the same private
authority, and the side that connects checks that the listener's certificate names the address. That
alone would let every node of the authority in. So each end also denies everything by default and
allows named nodes (common names) what their part needs, on the keys of their own session:

    part         may send                                  may be sent
    transmitter  up/symbol, up/control, its liveliness     down/command, the receiver's liveliness
    receiver     down/command, its liveliness              what the transmitter may send
    viewer       nothing                                   what both may send, telemetry/ROLE of both
    operator     control                                   what a viewer is

"Send" and "be sent" are seen from the invited node. A subscription is a message too and goes the other
way. A rule has to include its key whole, not merely meet it, and an end subscribes to `up/*` at once,
an end of many sessions to all of them; so an invited node may subscribe to every key beside its own, in
any session, and what is let through to it, or from it, is what keeps it to its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

Part = Literal["transmitter", "receiver", "viewer", "operator"]
Rule = dict[str, object]

KEY_ROOT = "tenbaud"
ANY = "**"
UP = ("up/symbol", "up/control")
DOWN = ("down/command",)
TELEMETRY = ("telemetry/transmitter", "telemetry/receiver")
CONTROL = ("control",)
_WATCHED = (*UP, *DOWN, *TELEMETRY)
_KEYS_OF: dict[Part, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "transmitter": (UP, DOWN),
    "receiver": (DOWN, UP),
    "viewer": ((), _WATCHED),
    "operator": (CONTROL, _WATCHED),
}
"""what each part may send, and may be sent"""


@dataclass(frozen=True, slots=True)
class Credentials:
    """The three files by which an end proves who it is."""

    name: str
    """common name in its certificate"""
    authority: Path
    certificate: Path
    private_key: Path


@dataclass(frozen=True, slots=True)
class Invited:
    """A node that is let in, for one part of one session.

    A router that stands between is invited in the part of the end behind it. `session` may be a key
    expression that covers several sessions, such as `lab/*`.
    """

    name: str
    part: Part
    session: str


@dataclass(frozen=True, slots=True)
class Security:
    """Credentials of this end, and everyone whom it lets in."""

    credentials: Credentials
    invited: tuple[Invited, ...]


def security_settings(security: Security) -> dict[str, object]:
    """Return the Zenoh settings, by path, that admit the invited over TLS and nobody else."""
    settings = tls_settings(security.credentials)
    settings["access_control"] = access_rules(security.invited)
    return settings


def tls_settings(credentials: Credentials) -> dict[str, object]:
    """Return the Zenoh settings, by path, that speak nothing but TLS and show this certificate."""
    certificate, key = str(credentials.certificate), str(credentials.private_key)
    tls: dict[str, object] = {
        "root_ca_certificate": str(credentials.authority),
        "listen_certificate": certificate,
        "listen_private_key": key,
        "connect_certificate": certificate,
        "connect_private_key": key,
        "enable_mtls": True,
        "verify_name_on_connect": True,
        "close_link_on_expiration": True,
    }
    settings = {f"transport/link/tls/{name}": value for name, value in tls.items()}
    return settings | {"transport/link/protocols": ["tls"]}


def access_rules(invited: Sequence[Invited]) -> dict[str, object]:
    """Return Zenoh's `access_control` section: deny all, allow invited nodes what their role needs."""
    rules: list[Rule] = []
    subjects: list[Rule] = []
    policies: list[Rule] = []
    for number, one in enumerate(invited):
        subject = f"{number} {one.name}"
        subjects.append({"id": subject, "cert_common_names": [one.name]})
        own = _rules_of(one, f"{subject} {one.part} {one.session}")
        rules += own
        policies.append({"rules": [rule["id"] for rule in own], "subjects": [subject]})
    section: dict[str, object] = {"enabled": True, "default_permission": "deny"}
    # Zenoh refuses empty lists; without them the default, which denies, is all there is.
    if rules:
        section |= {"rules": rules, "subjects": subjects, "policies": policies}
    return section


def _rules_of(invited: Invited, prefix: str) -> list[Rule]:
    rules: list[Rule] = []

    def allow(flow: str, messages: list[str], session: str, keys: Sequence[str]) -> None:
        if keys:
            expressions = [f"{KEY_ROOT}/{session}/{key}" for key in keys]
            rules.append(
                {
                    "id": f"{prefix} {len(rules)}",
                    "permission": "allow",
                    "flows": [flow],
                    "messages": messages,
                    "key_exprs": expressions,
                }
            )

    sends, is_sent = _KEYS_OF[invited.part]
    inward, outward = ("ingress", "egress"), ("egress", "ingress")
    for (flow, back), keys in ((inward, sends), (outward, is_sent)):
        allow(flow, ["put"], invited.session, keys)
        allow(back, ["declare_subscriber"], ANY, _subscribed(keys))
    for part in ("transmitter", "receiver"):
        flow, back = inward if part == invited.part else outward
        alive = [f"alive/{part}/*"]
        allow(flow, ["liveliness_token"], invited.session, alive)
        allow(back, ["declare_liveliness_subscriber", "liveliness_query"], ANY, alive)
    return rules


def _subscribed(keys: Sequence[str]) -> list[str]:
    """Return the key expressions that a subscriber to these keys declares: `up/*` for `up/symbol`."""
    folders = (key.rpartition("/") for key in keys)
    return list(dict.fromkeys(f"{folder}{slash}*" if slash else key for folder, slash, key in folders))

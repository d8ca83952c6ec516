"""Keys on disk: what is made, what it may be used for, and what is refused."""

from __future__ import annotations

import stat
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from tenbaud.keys.authority import NodeRole, is_signed_by, new_authority, read_certificate
from tenbaud.keys.store import (
    KeysError,
    add_node,
    create_authority,
    expiry_warning,
    read_node,
    read_nodes,
    renew_node,
    usable,
)


@pytest.fixture
def keys(tmp_path: Path) -> Path:
    create_authority(tmp_path / "keys")
    return tmp_path / "keys"


def mode_of(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def test_when_keys_are_made_then_private_ones_are_private(keys: Path) -> None:
    add_node(keys, "rig", NodeRole.TRANSMITTER, ())
    assert mode_of(keys / "authority" / "authority.key") == 0o600
    assert mode_of(keys / "rig" / "node.key") == 0o600
    assert mode_of(keys / "authority") == mode_of(keys / "rig") == 0o700
    assert not (keys / "rig" / "authority.key").exists()


def test_when_a_node_is_read_then_it_says_who_it_is(keys: Path) -> None:
    hosts = ("10.0.0.2", "desk.lab", "fd00::2")
    made = add_node(keys, "desk", NodeRole.RECEIVER, hosts)
    read = read_node(keys / "desk")
    assert read == made
    assert read.certified.name == "desk"
    assert read.certified.role is NodeRole.RECEIVER
    assert set(read.certified.hosts) == set(hosts)
    assert 364.9 < read.certified.days_left() < 365.1
    assert read.credentials.private_key == (keys / "desk" / "node.key").resolve()


def test_when_an_authority_exists_then_it_is_not_made_again(keys: Path) -> None:
    before = (keys / "authority" / "authority.key").read_bytes()
    with pytest.raises(KeysError, match="keys add"):
        create_authority(keys)
    assert (keys / "authority" / "authority.key").read_bytes() == before


def test_when_there_is_no_authority_then_it_says_how_to_make_one(tmp_path: Path) -> None:
    with pytest.raises(KeysError, match="keys init"):
        add_node(tmp_path, "rig", NodeRole.TRANSMITTER, ())


@pytest.mark.parametrize("name", ["", "authority", "../rig", "a/b", "-x", "a b", "x" * 64])
def test_when_a_name_is_no_name_then_it_is_refused(keys: Path, name: str) -> None:
    with pytest.raises(KeysError, match="node name"):
        add_node(keys, name, NodeRole.TRANSMITTER, ())


def test_when_a_name_is_taken_then_renewing_is_offered(keys: Path) -> None:
    add_node(keys, "rig", NodeRole.TRANSMITTER, ())
    with pytest.raises(KeysError, match="keys renew rig"):
        add_node(keys, "rig", NodeRole.TRANSMITTER, ())


def test_when_a_receiver_has_no_address_then_it_is_asked_for(keys: Path) -> None:
    with pytest.raises(KeysError, match="--host"):
        add_node(keys, "desk", NodeRole.RECEIVER, ())
    assert not (keys / "desk").exists()


def test_when_a_node_is_renewed_then_key_and_end_are_new_and_the_addresses_stay(keys: Path) -> None:
    old = add_node(keys, "desk", NodeRole.RECEIVER, ("10.0.0.2",), days=3.0)
    old_key = (keys / "desk" / "node.key").read_bytes()
    new = renew_node(keys, "desk")
    assert new.certified.hosts == ("10.0.0.2",)
    assert new.certified.expires > old.certified.expires + timedelta(days=300)
    assert (keys / "desk" / "node.key").read_bytes() != old_key
    assert mode_of(keys / "desk" / "node.key") == 0o600
    assert renew_node(keys, "desk", ("10.0.0.3",)).certified.hosts == ("10.0.0.3",)


def test_when_a_certificate_ends_soon_then_it_is_reported_and_when_it_has_then_it_is_refused(
    keys: Path,
) -> None:
    assert expiry_warning(add_node(keys, "rig", NodeRole.TRANSMITTER, ())) is None
    soon = add_node(keys, "soon", NodeRole.TRANSMITTER, (), days=20.0)
    assert "keys renew soon" in (expiry_warning(soon) or "")
    assert usable(keys / "soon", NodeRole.TRANSMITTER) == soon
    add_node(keys, "late", NodeRole.TRANSMITTER, (), days=-1.0)
    with pytest.raises(KeysError, match=r"expired on .* keys renew late"):
        usable(keys / "late", NodeRole.TRANSMITTER)


def test_when_the_authority_has_expired_then_it_signs_nothing_and_says_so(keys: Path) -> None:
    add_node(keys, "rig", NodeRole.TRANSMITTER, ())
    before = (keys / "rig" / "node.pem").read_bytes()
    expired = new_authority("tenbaud authority", days=-1.0)
    (keys / "authority" / "authority.pem").write_bytes(expired.certificate)
    (keys / "authority" / "authority.key").write_bytes(expired.private_key)
    with pytest.raises(KeysError, match=r"authority in .* expired on .* keys init"):
        renew_node(keys, "rig")
    with pytest.raises(KeysError, match=r"authority in .* expired on .* keys init"):
        add_node(keys, "new", NodeRole.TRANSMITTER, ())
    assert (keys / "rig" / "node.pem").read_bytes() == before
    assert not (keys / "new").exists()


def test_when_the_authority_s_certificate_is_none_then_its_file_is_named(keys: Path) -> None:
    (keys / "authority" / "authority.pem").write_bytes(b"not a certificate")
    with pytest.raises(KeysError, match=r"authority\.pem cannot be used"):
        add_node(keys, "rig", NodeRole.TRANSMITTER, ())


def test_when_a_certificate_is_for_another_role_then_it_is_refused(keys: Path) -> None:
    add_node(keys, "rig", NodeRole.TRANSMITTER, ())
    with pytest.raises(KeysError, match="certificate of a transmitter, and this is a receiver"):
        usable(keys / "rig", NodeRole.RECEIVER)


def test_when_others_may_read_the_private_key_then_it_is_refused(keys: Path) -> None:
    add_node(keys, "rig", NodeRole.TRANSMITTER, ())
    (keys / "rig" / "node.key").chmod(0o640)
    with pytest.raises(KeysError, match="chmod 600"):
        read_node(keys / "rig")


def test_when_others_may_read_the_authority_s_key_then_it_signs_nothing(keys: Path) -> None:
    (keys / "authority" / "authority.key").chmod(0o644)
    with pytest.raises(KeysError, match=r"chmod 600 .*authority\.key"):
        add_node(keys, "rig", NodeRole.TRANSMITTER, ())
    assert not (keys / "rig").exists()


def test_when_the_authority_beside_it_is_another_then_it_is_refused(keys: Path) -> None:
    add_node(keys, "rig", NodeRole.TRANSMITTER, ())
    other = new_authority("other").certificate
    (keys / "rig" / "authority.pem").write_bytes(other)
    assert not is_signed_by((keys / "rig" / "node.pem").read_bytes(), other)
    with pytest.raises(KeysError, match="not signed"):
        read_node(keys / "rig")


def test_when_a_folder_is_incomplete_then_the_missing_file_is_named(keys: Path) -> None:
    add_node(keys, "rig", NodeRole.TRANSMITTER, ())
    (keys / "rig" / "node.key").unlink()
    with pytest.raises(KeysError, match=r"node\.key"):
        read_node(keys / "rig")


def test_when_a_file_is_no_certificate_then_it_is_refused(keys: Path) -> None:
    add_node(keys, "rig", NodeRole.TRANSMITTER, ())
    (keys / "rig" / "node.pem").write_bytes(b"not a certificate")
    with pytest.raises(KeysError, match=r"node\.pem"):
        read_node(keys / "rig")
    with pytest.raises(ValueError, match="names no node"):
        read_certificate((keys / "authority" / "authority.pem").read_bytes())


def test_when_all_nodes_are_asked_for_then_the_authority_is_none_of_them(keys: Path) -> None:
    add_node(keys, "rig", NodeRole.TRANSMITTER, ())
    add_node(keys, "desk", NodeRole.RECEIVER, ("10.0.0.2",))
    assert [node.certified.name for node in read_nodes(keys)] == ["desk", "rig"]


def test_when_the_clock_is_a_little_behind_then_a_fresh_certificate_is_valid_already(
    keys: Path,
) -> None:
    certified = add_node(keys, "rig", NodeRole.TRANSMITTER, ()).certified
    assert certified.begins < datetime.now(UTC) - timedelta(minutes=5)

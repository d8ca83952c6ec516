"""No bytes whatever make a decoder raise anything but FrameError."""

from __future__ import annotations

import random

import pytest

from tests.channel.protocol.fuzz import SEEDS, checked, feed, fuzz_all, mutated


@pytest.mark.parametrize("seed", range(2))
def test_when_frames_are_mangled_then_only_frame_errors_come_out(seed: int) -> None:
    counts = fuzz_all(10_000, seed)
    assert counts["inputs"] >= 10_000
    assert counts["accepted"] > 100  # the insides were reached, not only the check


def test_when_the_check_is_made_good_then_the_inside_is_read() -> None:
    for data in SEEDS:
        assert checked(data) == data
        assert feed(data)


def test_when_a_decoder_lets_another_error_out_then_fuzzing_finds_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from channel.protocol import wire

    monkeypatch.setattr(wire, "_decode_commands", lambda _session, _epoch, body: {}[body])
    with pytest.raises(KeyError):
        fuzz_all(20_000, 5)


def test_when_mangled_then_it_is_seldom_what_it_was() -> None:
    chance = random.Random(1)
    changed = [mutated(chance, SEEDS[0]) != SEEDS[0] for _ in range(200)]
    assert sum(changed) > 150

"""The page's memory: two streams joined, late browsers, foreign messages, another flight."""

from __future__ import annotations

import json
from typing import Any

from tenbaud.view.board import NEWS_KEPT, POINTS_KEPT, SILENCE_S, Board


def transmitter(number: int = 1, flight: int = 7, **more: Any) -> bytes:
    point = {
        "time_s": number / 20, "measured": [0.1, 0.2], "true": [0.11, 0.2],
        "coded": [0.12, 0.3], "live": None, "range": [0.05, 0.1],
    }  # fmt: skip
    sample = {
        "sample": number, "word_sent": [1], "word": None, "about": None, "digest": "aa",
        "peer_digest": "ab",
    }  # fmt: skip
    message = {
        "version": 3, "role": "transmitter", "session": "lab", "flight": flight, "phase": "flying",
        "takes_commands": False, "points": [point], "samples": [sample],
        "events": [{"time_s": 1.0, "kind": "peer", "cause": "gone"},
                   {"time_s": 1.0, "kind": "erased", "sample": number, "slot": number}],
    }  # fmt: skip
    return json.dumps({**message, **more}).encode()


def receiver(number: int = 1, flight: int = 7, **more: Any) -> bytes:
    message = {
        "version": 3, "role": "receiver", "session": "lab", "flight": flight, "phase": "flying",
        "takes_commands": True, "events": [],
        "points": [{"time_s": number / 20, "reference": [0.5, None], "live": [0.1, 0.2]}],
        "samples": [{"sample": number, "word": [-1], "digest": "cc"}],
    }  # fmt: skip
    return json.dumps({**message, **more}).encode()


def news(board: Board, index: int = 0) -> tuple[int, list[dict[str, Any]]]:
    index, data = board.since(index)
    return index, [json.loads(one) for one in data]


def test_both_ends_are_joined_by_sample() -> None:
    board = Board()
    assert board.take([receiver(3), transmitter(3)], 0.0)
    _, (whole,) = news(board)
    assert whole["samples"] == [[3, [1], None, "aa", "ab", None]]
    assert whole["points"] == [[0.15, [0.11, 0.2], [0.12, 0.3], [0.05, 0.1]]]
    assert whole["decisions"] == [[0.15, [0.5, None]]]
    (event,) = whole["events"]
    assert (event["role"], event["kind"]) == ("transmitter", "peer"), "the tape shows what is erased"
    assert event["text"] == "the receiver is gone"
    assert set(whole["heads"]) == {"transmitter", "receiver"}
    assert "points" not in whole["heads"]["transmitter"]
    assert board.heads["receiver"]["takes_commands"]


def test_where_no_digest_comes_down_those_of_both_ends_telemetry_are_compared() -> None:
    for order in ([receiver(3), transmitter(3)], [transmitter(3), receiver(3)]):
        board = Board()
        without = [data.replace(b'"ab"', b'""') for data in order]
        assert board.take(without, 0.0)
        _, (whole,) = news(board)
        assert whole["samples"][0][3:5] == ["aa", "cc"]


def test_whichever_end_is_heard_first_the_digests_are_those_that_were_compared() -> None:
    for order in ([receiver(3), transmitter(3)], [transmitter(3), receiver(3)]):
        board = Board()
        for message in order:
            board.take([message], 0.0)
        assert news(board)[1][0]["samples"][0][3:5] == ["aa", "ab"]
    board = Board()
    board.take([receiver(3)], 0.0)
    assert news(board)[1][0]["samples"][0][3:5] == [None, "cc"]


def test_a_rig_that_knows_no_true_angle_shows_the_measured_one() -> None:
    board = Board()
    message = json.loads(transmitter())
    message["points"][0]["true"] = None
    board.take([json.dumps(message).encode()], 0.0)
    assert news(board)[1][0]["points"][0][1] == [0.1, 0.2]


def test_a_browser_gets_everything_first_and_then_only_what_is_new() -> None:
    board = Board()
    board.take([transmitter(1)], 0.0)
    index, _ = news(board)
    assert news(board, index) == (index, [])
    board.take([transmitter(2)], 0.1)
    board.take([transmitter(3)], 0.2)
    last, fresh = news(board, index)
    assert [one["samples"][0][0] for one in fresh] == [2, 3]
    assert not any(one.get("reset") for one in fresh)
    for number in range(4, 4 + NEWS_KEPT + 1):
        board.take([transmitter(number)], 0.3)
    (whole,) = news(board, last)[1]
    assert whole["reset"]
    assert len(whole["samples"]) == 3 + NEWS_KEPT + 1


def test_without_news_there_is_none() -> None:
    board = Board()
    assert not board.take([], 0.0)
    assert board.silent_s(1.0) is None
    assert board.take([transmitter()], 1.0)
    assert not board.take([], 2.0)
    assert board.silent_s(4.0) == 3.0


def test_what_is_no_telemetry_is_counted_and_left() -> None:
    board = Board()
    junk = [b"", b"[]", b"{}", b"\xff", transmitter(version=1), b'{"version":3,"role":"pilot"}']
    junk += [transmitter(role="pilot"), transmitter(role=5)]
    assert not board.take(junk, 0.0)
    assert board.foreign == len(junk)
    assert not board.heads


def test_a_second_flight_waits_until_the_first_is_over_or_silent() -> None:
    board = Board()
    board.take([transmitter(1, 7)], 0.0)
    board.take([transmitter(1, 8)], 1.0)
    assert board.flight == 7
    board.take([transmitter(2, 8)], SILENCE_S)
    assert board.flight == 8
    assert news(board)[1][0]["samples"] == [[2, [1], None, "aa", "ab", None]]
    board.take([transmitter(3, 8, phase="ended")], SILENCE_S)
    board.take([transmitter(1, 9)], SILENCE_S)
    assert board.flight == 9


def test_memory_is_bounded() -> None:
    board = Board()
    for number in range(POINTS_KEPT + 50):
        board.take([transmitter(number)], 0.0)
    (whole,) = news(board)[1]
    assert len(whole["points"]) == POINTS_KEPT
    assert len(whole["samples"]) < 200

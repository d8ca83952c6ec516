"""One receiver for many rigs: each for itself, and none a trouble for the others."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from channel.errors import TenbaudError
from channel.line.virtual import Step, encode_step
from channel.links.endpoints import free_endpoint
from channel.protocol.endings import End, Ending
from channel.protocol.frames import Bye, Symbol, Unknown
from channel.protocol.wire import decode, encode
from receiver.loops.many import BURST_MESSAGES
from tenbaud.build.flight import Agreement
from tenbaud.flight import many
from tenbaud.flight.ends import open_recorder
from tenbaud.flight.rate_limited_log import LINES_AT_ONCE, PERIOD_S
from tenbaud.recording.writer import McapRecorder
from tests.tenbaud.confirmed import PATIENT, check_flown
from tests.tenbaud.processes import finish, start
from tests.tenbaud.room import PATIENCE_S, Rig, Room, agreement


def test_when_two_rigs_fly_at_once_then_each_has_its_own_codec_and_folder(tmp_path: Path) -> None:
    with Room(tmp_path) as room:
        one, two = Rig(room, "rig/1").greet(), Rig(room, "rig/2").greet()
        for _ in range(5):
            one.fly(4)
            two.fly(2)
        one.bye()
        two.bye()
        room.until_ended(2)
        assert room.service.served == ()
        assert room.hub.joined == set()
    assert room.summary("rig/1")["samples"] == 20
    assert room.summary("rig/2")["samples"] == 10
    for rig in (one, two):
        assert rig.session.counts["desyncs"] == rig.session.counts["erasures"] == 0
        summary = room.summary(rig.name)
        assert summary["exit_code"] == 0
        # A row for each of ten ticks, the symbol, the sample; the begin, the epoch, the end.
        assert summary["recording_rows"] == 12 * summary["samples"] + 3
        assert summary["recording_rows_lost"] == 0
    names = sorted(path.name for path in (tmp_path / "rig-1").iterdir())
    assert names == ["config.toml", "receiver.mcap", "summary.json"]
    assert 'session = "rig/1"' in (tmp_path / "rig-1" / "config.toml").read_text()


def test_when_a_rig_flies_again_then_it_is_a_new_flight_in_a_new_folder(tmp_path: Path) -> None:
    with Room(tmp_path) as room:
        for incarnation in (1, 2):
            Rig(room, "rig/1", incarnation).greet().fly(3).bye()
            room.until_ended(incarnation)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["rig-1", "rig-1-2"]
    assert [one["samples"] for one in room.host.summaries] == [3, 3]


def test_when_one_rig_floods_then_its_surplus_is_dropped_and_another_flies_on(tmp_path: Path) -> None:
    surplus = 2000
    with Room(tmp_path) as room:
        good, bad = Rig(room, "rig/good").greet(), Rig(room, "rig/bad").greet()
        good.fly(3)
        for _ in range(surplus):
            bad.put(b"garbage")
        good.fly(10)
        good.bye()
        room.until_ended(1)
    assert room.summary("rig/good")["messages_dropped"] == 0
    assert good.session.counts["desyncs"] == good.session.counts["erasures"] == 0
    corrupted = room.summary("rig/bad")
    assert corrupted["messages_dropped"] + corrupted["malformed"] == surplus
    assert corrupted["messages_dropped"] > surplus - 10 * BURST_MESSAGES


def test_when_a_handshake_does_not_fit_then_it_is_refused_reported_once_and_leaves_no_folder(
    tmp_path: Path,
) -> None:
    with Room(tmp_path) as room:
        good = Rig(room, "rig/good").greet().fly(2)
        other = Rig(room, "rig/other", coder={"window_signs": 7}).greet()
        other.put(encode(other.session.hello()))
        other.hear()
        for _ in range(5):
            other.put(encode(Bye(0, Ending.OVER, "as I see it")))
        good.fly(2)
    # The first is what it said of itself when it was refused.
    assert len([text for text in room.told if "as its transmitter sees it" in text]) == 1
    assert "coder.window_signs" in str(other.session.refusal)
    assert len([text for text in room.told if "rig/other: refused" in text]) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["rig-good"]


def test_when_an_intruder_asks_under_ever_new_names_then_few_refusals_are_reported_and_all_counted(
    tmp_path: Path,
) -> None:
    asked = 10 * LINES_AT_ONCE
    with Room(tmp_path, rigs_max=1) as room:
        good = Rig(room, "rig/good").greet()
        stranger = Rig(room, "rig/stranger")
        for number in range(asked):
            room.hub.up.put((f"rig/{number}", encode(stranger.session.hello())))
        good.fly(2)
    assert room.host.counts["refused"] == asked
    told = [text for text in room.told if "refused" in text]
    assert len(told) <= LINES_AT_ONCE + PATIENCE_S / PERIOD_S
    assert "left out" in room.told[-1]


def test_when_one_rig_breaks_its_service_then_only_its_flight_ends(tmp_path: Path) -> None:
    with Room(tmp_path) as room:
        good, bad = Rig(room, "rig/good").greet(), Rig(room, "rig/bad").greet()
        bad.fly(2)
        bad.put(encode_step(Step(1, 0, b"on the other clock")))
        bad.hear()
        room.until_ended(1)
        good.fly(5)
    assert bad.session.end == End(Ending.FAILED, by_peer=True)
    assert room.summary("rig/bad")["exit_code"] == 3
    assert room.summary("rig/good")["samples"] == 5


def test_when_one_rig_loses_lockstep_then_it_rejoins_and_another_does_not_notice(
    tmp_path: Path,
) -> None:
    corrupted = agreement(receiver={"sabotage": "sample=4,field=range"})
    common = agreement()

    def agreement_of(name: str) -> Agreement:
        return corrupted if name == "rig/bad" else common

    with Room(tmp_path, agreement_of) as room:
        good, bad = Rig(room, "rig/good").greet(), Rig(room, "rig/bad").greet()
        for _ in range(10):
            good.fly(1)
            bad.fly(1)
    assert bad.session.counts["desyncs"] == bad.session.counts["rejoins"] == 1
    assert room.summary("rig/bad")["rejoins"] == 1
    assert good.session.counts["desyncs"] == room.summary("rig/good")["rejoins"] == 0


def test_when_a_rig_dies_then_its_flight_is_closed_and_the_name_is_free_again(tmp_path: Path) -> None:
    hasty = agreement(link={"peer_timeout_s": 0.3})
    with Room(tmp_path, lambda name: hasty if name == "rig/dead" else agreement()) as room:
        good = Rig(room, "rig/good").greet()
        Rig(room, "rig/dead").greet().fly(2)
        room.until_ended(1)
        assert room.summary("rig/dead")["exit_code"] == 4
        good.fly(2)
        Rig(room, "rig/dead", 2).greet().fly(1)
    assert good.session.counts["desyncs"] == 0


def test_when_no_configuration_can_be_had_then_the_rig_hears_why(tmp_path: Path) -> None:
    common = agreement()

    def agreement_of(name: str) -> Agreement:
        if name == "rig/odd":
            raise TenbaudError("rigs/odd.toml: no such thing")
        return common

    with Room(tmp_path, agreement_of) as room:
        odd = Rig(room, "rig/odd").greet()
        Rig(room, "rig/good").greet().fly(2)
    assert "no such thing" in str(odd.session.refusal)


def test_when_there_are_too_many_rigs_then_the_next_is_refused_until_one_ends(tmp_path: Path) -> None:
    with Room(tmp_path, rigs_max=1) as room:
        first = Rig(room, "rig/1").greet()
        assert "its limit" in str(Rig(room, "rig/2").greet().session.refusal)
        first.bye()
        room.until_ended(1)
        Rig(room, "rig/2", 2).greet().fly(1)


def test_when_a_symbol_of_an_unknown_session_comes_then_its_rig_is_asked_to_greet(
    tmp_path: Path,
) -> None:
    with Room(tmp_path) as room:
        room.hub.up.put(("rig/lost", encode(Symbol(99, 3, 40, 1))))
        answer = decode(room.hub.down["rig/lost"].get(True, PATIENCE_S))
        room.hub.up.put(("rig/noise", b"?"))
        Rig(room, "rig/1").greet()
    assert answer == Unknown(99, 3)
    assert room.host.counts["strays"] == 1
    assert [path.name for path in tmp_path.iterdir()] == ["rig-1"]


def test_when_a_rig_asks_as_the_receiver_stops_then_its_recording_is_finished(tmp_path: Path) -> None:
    room = Room(tmp_path)
    late = Rig(room, "rig/late")
    assert room.host.on_unserved("rig/late", encode(late.session.hello())) == []
    room.host.close()
    assert room.summary("rig/late")["samples"] == 0
    assert room.summary("rig/late")["recording_error"] is None
    assert room.hub.joined == set()


def test_when_a_flight_cannot_be_built_then_its_file_is_finished_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = []

    def open_and_note(*arguments: Any) -> McapRecorder:
        opened.append(open_recorder(*arguments))
        return opened[-1]

    def fail(*_: Any) -> None:
        raise TenbaudError("no controller of this name")

    monkeypatch.setattr(many, "open_recorder", open_and_note)
    monkeypatch.setattr(many, "build_receiver", fail)
    with Room(tmp_path) as room:
        odd = Rig(room, "rig/odd").greet()
        assert "no controller" in str(odd.session.refusal)
        (recorder,) = opened
        assert recorder._finished.wait(PATIENCE_S)


def test_when_recording_one_rig_fails_then_only_its_flight_ends(tmp_path: Path) -> None:
    with Room(tmp_path) as room:
        good, bad = Rig(room, "rig/good").greet(), Rig(room, "rig/bad").greet()
        (served,) = [one for one in room.service.served if one.name == "rig/bad"]

        def fail() -> None:
            raise RuntimeError("a coder of the user's")

        served.endpoint.session._commander.write_down = fail  # type: ignore[method-assign]
        bad.put(encode(bad.session.on_measurement(0, (0.0,))[0]))
        good.fly(5)
        assert [one.name for one in room.service.served] == ["rig/good"]
    assert room.summary("rig/good")["samples"] == 5


@pytest.mark.parametrize("clock", ["virtual", "real"])
def test_when_processes_meet_over_zenoh_then_each_flies_with_its_own_file(
    tmp_path: Path, clock: str
) -> None:
    own = tmp_path / "rigs" / "rig" / "b.toml"
    own.parent.mkdir(parents=True)
    own.write_text("[coder]\nwindow_signs = 3\n")
    endpoint = free_endpoint()
    shared = ["--clock", clock, "--json"]
    flight = ["transmit", "--connect", endpoint, "--duration", "3", *PATIENT, *shared]
    receiver = start(
        *("receive", "--sessions", "rig/*", "--configs", "rigs", "--listen", endpoint),
        *("--flights", "2", "--out", "many", *shared),
        cwd=tmp_path,
    )
    strangers = [
        start(*flight, "--session", "rig/c", "--set", "coder.window_signs=5", cwd=tmp_path),
        start(*flight, "--session", "elsewhere", "--set", "link.peer_timeout_s=2.0", cwd=tmp_path),
    ]
    c, elsewhere = [finish(rig) for rig in strangers]
    rigs = [
        start(*flight, "--session", "rig/a", "--out", "a", cwd=tmp_path),
        start(*flight, "--session", "rig/b", "--config", str(own), "--out", "b", cwd=tmp_path),
    ]
    a, b = [finish(rig) for rig in rigs]
    ended = finish(receiver)
    assert (a.code, b.code, c.code, elsewhere.code) == (0, 0, 3, 4), (a.err, b.err, c.err)
    assert "coder.window_signs" in c.err
    assert ended.code == 0, ended.err
    flights = {flight["session"]: flight for flight in ended.summary["flights"]}
    assert sorted(flights) == ["rig/a", "rig/b"]
    for name, upper in (("rig/a", a.summary), ("rig/b", b.summary)):
        check_flown(upper, 30, flights[name])
        assert flights[name]["samples"] >= 30
        assert flights[name]["config_digest"] == upper["config_digest"]
    assert a.summary["config_digest"] != b.summary["config_digest"]
    assert (tmp_path / "many" / "rig-b" / "receiver.mcap").stat().st_size > 0
    assert ended.summary["refused"] == 1

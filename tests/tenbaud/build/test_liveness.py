"""No setting of lead, delay and watchdog makes a rejoin that never ends."""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import Any

import pytest

from channel.protocol.wire import DATAGRAM
from tenbaud.build.ends import build_receiver, guard_settings
from tenbaud.build.flight import agree
from tenbaud.build.transmitter_run import TransmitterRun
from tenbaud.config.load import ConfigError, load_config
from tenbaud.flight import transmit
from tenbaud.flight.outcome import ExitCode, Outcome

SECONDS = 30.0
DESYNC = "sample=100,field=range"


@dataclass
class Flown:
    """A flight on the virtual clock."""

    run: TransmitterRun
    outcome: Outcome
    last_rejoin_s: float

    @property
    def rejoins(self) -> int:
        return self.run.node.session.counts["rejoins"]

    @property
    def confirmed_share(self) -> float:
        samples = self.run.ticks // self.run.agreement.terms.ticks_per_sample
        return self.run.node.session.counts["digest_checks"] / samples


def fly(preset: str = "paper-10baud", **changes: Any) -> Flown:
    agreement = agree(load_config(preset, None, {"duration_s": SECONDS, **changes}), "virtual")
    run = transmit.prepare(agreement, None, DATAGRAM)
    rejoins: list[int] = []

    def at_tick(tick: int) -> None:
        while len(rejoins) < run.node.session.counts["rejoins"]:
            rejoins.append(tick)

    run.node.before_every_tick(at_tick)
    outcome = transmit.fly_virtual(run, build_receiver(agreement, None, DATAGRAM), lambda: False)
    return Flown(run, outcome, max(rejoins, default=0) * agreement.terms.tick_ns / 1e9)


def lead(ticks: int) -> dict[str, Any]:
    return {"timing": {"lead_ticks": ticks}}


def sabotaged(**transmitter: Any) -> dict[str, Any]:
    return {"transmitter": {"sabotage": DESYNC, **transmitter}}


def line(text: str) -> dict[str, Any]:
    return {"link": {"impairments": text}}


@pytest.mark.parametrize(
    ("preset", "changes"),
    [
        ("paper-10baud", lead(60) | sabotaged()),
        ("paper-10baud", lead(60) | sabotaged(watchdog_s=0.5)),
        ("paper-10baud", lead(60) | sabotaged(watchdog_s=0.01)),
        ("paper-10baud", lead(1000) | sabotaged(watchdog_s=0.1)),
        ("tuned-10baud", lead(60) | line("cut=20s+3s")),
        ("paper-20baud", lead(30) | sabotaged()),
        ("paper-20baud", lead(30) | line("cut=20s+3s")),
        ("uiuc-50baud", lead(12) | sabotaged()),
        ("uiuc-50baud", lead(12) | line("cut=20s+3s")),
    ],
)
def test_when_lockstep_is_lost_once_under_a_long_lead_then_one_rejoin_brings_it_back(
    preset: str, changes: dict[str, Any]
) -> None:
    flown = fly(preset, **changes)
    assert flown.outcome.code is ExitCode.OK, flown.outcome.text
    assert flown.rejoins == 1
    ahead_s = 2 * flown.run.agreement.terms.lead_ticks * flown.run.agreement.terms.tick_ns / 1e9
    assert flown.confirmed_share > (SECONDS - 4.0 - ahead_s) / SECONDS


def test_when_command_frames_overtake_each_other_then_that_is_no_lost_lockstep() -> None:
    flown = fly(**line("delay=400ms±300ms"))
    assert (flown.rejoins, flown.outcome.code) == (0, ExitCode.OK)


def drawn(seed: int) -> dict[str, Any]:
    """Return a configuration with any lead, delay and watchdog, and one lockstep failure."""
    chance = random.Random(seed)
    delays = [chance.choice((0, chance.randrange(300), chance.randrange(3400))) for _ in range(2)]
    spreads = [chance.choice((0, chance.randrange(delay + 1))) for delay in delays]
    ways = zip(("up", "down"), delays, spreads, strict=True)
    items = [f"{way}:delay={delay}ms±{spread}ms" for way, delay, spread in ways]
    cut = chance.choice((True, False))
    if cut:
        items.append(f"cut=8s+{chance.choice((500, 1000, 8000))}ms")
    return {
        "duration_s": 55.0,
        "timing": {"lead_ticks": chance.choice(("auto", chance.randrange(30), chance.randrange(1000)))},
        "channel": {
            "delivery": chance.choice(("start", "end")),
            "repeats": chance.choice((0, 1, 2, 4)),
            "deadline_allowance_s": 0.02 + 2 * spreads[0] / 1e3,
        },
        "link": {"impairments": ",".join(items), "peer_timeout_s": 60.0},
        "transmitter": {
            "sabotage": "" if cut else "sample=30,field=range",
            "watchdog_s": chance.choice(("auto", 0.01, chance.uniform(0.01, 2.0))),
            "plant": {"mismatch": 0.1},
        },
    }


def assert_comes_back(seed: int) -> bool:
    """Fly a drawn configuration; return whether it was one that can be flown."""
    try:
        flown = fly(**drawn(seed))
    except ConfigError:
        return False
    node = flown.run.node
    assert flown.outcome.code in (ExitCode.OK, ExitCode.NOT_FLOWN), (seed, flown.outcome.text)
    assert not node.guard.stopped, seed
    assert flown.last_rejoin_s < 40.0, (seed, flown.rejoins, flown.last_rejoin_s)
    return True


def test_when_a_configuration_is_accepted_then_lockstep_comes_back() -> None:
    # One that is refused, the longest round trip, no delay at all, and a cut.
    assert sum(assert_comes_back(seed) for seed in (1, 3, 4, 7)) >= 3


@pytest.mark.soak
def test_when_any_configuration_is_accepted_then_lockstep_comes_back() -> None:
    assert sum(assert_comes_back(seed) for seed in (*range(8), *range(1000, 1400))) >= 100


def test_when_the_watchdog_is_automatic_then_it_knows_lead_and_round_trip() -> None:
    def ticks(**changes: Any) -> int:
        return guard_settings(
            agree(load_config("paper-10baud", None, changes), "virtual")
        ).timeout_ticks

    assert ticks() == 50
    assert ticks(**lead(60)) == 60 + 20
    assert ticks(**line("delay=400ms±300ms")) == 143 + 20
    assert ticks(**line("delay=50ms"), **lead(3)) == 50


@pytest.mark.parametrize("watchdog_s", [0.1, 0.11])
def test_when_a_watchdog_is_shorter_than_commands_are_late_then_it_is_refused_with_numbers(
    watchdog_s: float,
) -> None:
    changes = lead(3) | line("delay=50ms") | sabotaged(watchdog_s=watchdog_s)
    if watchdog_s == 0.11:
        assert fly(**changes).rejoins == 1
        return
    with pytest.raises(ConfigError) as caught:
        fly(**changes)
    assert str(caught.value) == (
        "transmitter.watchdog_s = 0.1 is too short: with lead_ticks = 3 and a round trip of up to 13 "
        "ticks of 10 ms, commands may be 10 ticks late on a line that loses nothing, and the watchdog "
        "would trip in every epoch; set it to at least 0.11, set lead_ticks to at least 13, or leave "
        'it at "auto" (0.5)'
    )


def test_when_commands_could_come_too_late_for_good_then_the_lead_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"after 18, .* lead_ticks to at least 23, or to .auto"):
        fly(**lead(9), **line("delay=100ms"))
    assert fly(**lead(11), **line("delay=100ms")).outcome.code is ExitCode.OK


def test_when_the_round_trip_is_longer_than_the_history_then_it_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"6630 ms, which is 66\.3 samples; both ends remember 64"):
        fly(**line("delay=3.3s"))
    flown = fly(**line("delay=3.15s"), **sabotaged())
    assert flown.rejoins == 1

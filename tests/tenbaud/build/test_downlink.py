"""The narrow downlink as users configure it: what is built, what both ends share, what is refused."""

from __future__ import annotations

import json
import math
import random
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from channel.codec.downlink.coded import CodedCommands
from channel.codec.downlink.mirrored import MirroredLaw
from channel.protocol.frames import Refuse
from channel.protocol.identity import differing_fields
from channel.protocol.wire import DATAGRAM
from tenbaud.build.codec import build_codec
from tenbaud.build.controllers import build_controller
from tenbaud.build.downlink import build_two_way
from tenbaud.build.ends import build_receiver, build_transmitter
from tenbaud.build.flight import Agreement, agree
from tenbaud.build.parts import Parts
from tenbaud.build.recorded import flight_config
from tenbaud.build.references import build_references
from tenbaud.config.load import ConfigError, dump_config, load_config
from tenbaud.flight.fly import fly
from tenbaud.replay.record import agree_again
from tenbaud.telemetry.end import steered
from tests.tenbaud.build import own_laws

MS = 1_000_000


def agreed(preset: str = "tuned-10baud", clock: Any = "virtual", **changes: Any) -> Agreement:
    """Return a flight with a narrow downlink; `changes` have __ where a dot belongs."""
    over: dict[str, Any] = {"channel": {"downlink": "narrow"}}
    for name, value in changes.items():
        section, field = name.split("__")
        over[section] = {**over.get(section, {}), field: value}
    return agree(load_config(preset, None, over, allow_code=True), clock)


def mirrored(agreement: Agreement) -> MirroredLaw:
    assert agreement.two_way is not None
    assert isinstance(agreement.two_way.scheme, MirroredLaw)
    return agreement.two_way.scheme


@pytest.mark.parametrize(
    ("preset", "down_symbols", "period", "queue"),
    [
        ("tuned-10baud", 2, 4, 15),
        ("paper-20baud", 1, 8, 32),
        ("heading-1baud", 20, 4, 15),
        ("helicopter-10baud", 2, 4, 16),
        ("pendulum-16baud", 1, 8, 32),
    ],
)
def test_the_built_in_laws_are_mirrored_and_fly_without_a_lead(
    preset: str, down_symbols: int, period: int, queue: int
) -> None:
    agreement = agreed(preset, "real")
    terms, scheme = agreement.terms, mirrored(agreement)
    assert (terms.is_mirrored, terms.lead_ticks, terms.down_symbols) == (True, 0, down_symbols)
    assert agreement.two_way is not None
    assert agreement.two_way.layout.command_period == period
    assert scheme.queue == queue == scheme.queue_needed


@pytest.mark.parametrize("preset", ["tuned-10baud", "servo-10baud", "aero-20baud", "helicopter-10baud"])
def test_the_mirrored_law_commands_what_the_receivers_controller_does(preset: str) -> None:
    agreement = agreed(preset)
    controller = build_controller(agreement.config, model=agreement.codec.model)
    references = build_references(agreement.config, agreement.signals, agreement.codec.model)
    model, law = agreement.codec.model, mirrored(agreement).law
    memory, chance = law.initial(), random.Random(3)
    for tick in range(60):
        state = tuple([value + chance.gauss(0.0, 0.3) for value in model.initial()])
        targets = tuple([0.0 if one is None else one.value(tick) for one in references])
        command, memory = law.command(memory, targets, model.measured(state), state)
        assert command == controller.command(tick, state)


def test_the_ends_of_a_square_wave_are_words_to_the_last_digit() -> None:
    scheme = mirrored(agreed())
    (one,) = scheme.ranges
    for target in (math.pi / 2, -math.pi / 2):
        words = (target - one.low) / scheme.quantum(0) - 0.5
        assert words == pytest.approx(round(words), abs=1e-9)
        assert one.low <= target <= one.high


def test_a_longer_round_trip_is_announced_earlier() -> None:
    assert mirrored(agreed(channel__delivery="end")).queue == 15 + 2
    assert mirrored(agreed(link__impairments="delay=200ms")).queue == 15 + 4
    assert mirrored(agreed(downlink__announce_s=0)).queue == 0


def test_other_controllers_have_their_commands_coded_with_the_lead_that_they_need() -> None:
    agreement = agreed(receiver__controller="tests.tenbaud.build.own_laws:Plain")
    assert agreement.two_way is not None
    scheme = agreement.two_way.scheme
    assert isinstance(scheme, CodedCommands)
    assert [one.direction for one in scheme.directions] == [(1.0, 0.0), (0.0, 1.0)]
    assert (agreement.terms.lead_ticks, agreement.two_way.lead_ticks) == (8, 8)
    assert agreement.two_way.layout.command_period == 1


def test_directions_and_ranges_are_in_the_units_of_the_inputs() -> None:
    agreement = agreed(downlink__scheme="coded", downlink__directions=[[0.5, -0.5]])
    assert agreement.two_way is not None
    scheme = agreement.two_way.scheme
    assert isinstance(scheme, CodedCommands)
    (one,) = scheme.directions
    assert one.read == (1.0, -1.0)
    # Both motors at 5 V against each other are 10.
    assert (one.minimum_range, one.maximum_range, one.largest) == (1.5, 8.0, 20.0)


def test_what_both_ends_share_names_the_field_that_differs() -> None:
    ours = agreed()
    theirs = agreed(receiver__pid={"proportional": 0.2}, receiver__reference={"amplitude": 1.0})
    lines = differing_fields(ours.identity.config, theirs.identity.config)
    assert [line.partition(":")[0] for line in lines] == [
        "downlink.law.loops",
        "downlink.set_points.pitch",
    ]
    assert ours.identity.numerics_probe != theirs.identity.numerics_probe


@pytest.mark.parametrize("other", ["full", "compact"])
def test_an_end_with_another_downlink_is_refused_with_both_values(other: str) -> None:
    ours, theirs = (
        agreed(),
        agree(load_config("tuned-10baud", None, {"channel": {"downlink": other}}), "virtual"),
    )
    session = build_transmitter(theirs, None).session
    receiver = build_receiver(ours, None, DATAGRAM)
    (refusal,) = receiver.session.on_frame(session.hello(), 0)
    assert isinstance(refusal, Refuse)
    session.on_frame(refusal)
    assert session.refusal is not None
    lines = [line for line in session.refusal.text.splitlines() if "downlink" in line]
    assert lines == [f"  channel.downlink: here {other}, there narrow"]


def test_other_downlinks_ignore_the_fields_of_the_narrow_one() -> None:
    plain = load_config("tuned-10baud")
    given = {"downlink": {"scheme": "coded", "bits": 3}, "channel": {"downlink_baud": 5.0}}
    some = load_config("tuned-10baud", None, given)
    assert agree(some, "virtual").two_way is None
    assert agree(some, "virtual").identity.config == agree(plain, "virtual").identity.config
    assert {"downlink", "downlink_baud"}.isdisjoint(json.loads(plain.shared_json(0))["channel"])


def test_a_kind_of_downlink_in_place_of_its_link_is_refused_as_the_file_is_loaded(
    tmp_path: Path,
) -> None:
    own = tmp_path / "own.toml"
    own.write_text('[link]\ndownlink = "narrow"\n')
    for load in (load_config, flight_config):
        with pytest.raises(ConfigError) as refused:
            load(None, own, None)
        assert str(own) in str(refused.value)
        assert "link.downlink = 'narrow'" in str(refused.value)
        assert "for this kind of downlink set channel.downlink = 'narrow'" in str(refused.value)
    assert load_config(None, own, {"link": {"downlink": "zenoh"}}).link.downlink == "zenoh"


def test_a_person_who_sets_fields_of_the_narrow_downlink_for_another_is_warned(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text('preset = "tuned-10baud"\n[downlink]\nbits = 8\n')
    with pytest.warns(
        UserWarning, match=r'^channel\.downlink_baud, downlink\.bits: .* = "full": set'
    ) as found:
        config = flight_config(None, own, {"channel": {"downlink_baud": 10.0}})
    assert found[0].filename == __file__
    own.write_text(dump_config(config))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        flight_config(None, own)
        flight_config(None, own, {"channel": {"downlink": "narrow"}, "downlink": {"bits": 7}})


def test_numbers_of_the_law_by_value_take_the_place_of_the_designed_ones() -> None:
    designed = agreed("servo-10baud")
    law = json.loads(designed.identity.config)["downlink"]["law"]
    law["gains"][0][0] += 1e-9
    other = agreed("servo-10baud", downlink__law=law)
    (line,) = differing_fields(designed.identity.config, other.identity.config)
    assert line.startswith("downlink.law.gains: here [[")
    law["gains"][0].append(1.0)
    with pytest.raises(ConfigError, match=r"\.gains has the shape \[1, \d\], not \[1, \d\]"):
        agreed("servo-10baud", downlink__law=law)
    with pytest.raises(ConfigError, match=r"downlink\.law\.base has the shape \[0\], not \[1\]"):
        agreed("servo-10baud", downlink__law={"gains": [[1.0, 2.0]]})


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        (
            {"channel__downlink_baud": 5},
            "ask for 10 symbols/s, .* carries downlink_baud = 5;",
        ),
        (
            {"downlink__symbols_per_sample": 3},
            "ask for 30 symbols/s, .* = 20; choose a layout of at most 2",
        ),
        ({"downlink__command_symbols": 2}, "all 2 down symbol"),
        (
            {"downlink__set_point_min": -1, "downlink__set_point_max": {"pitch": 1.0}},
            r"set-points of pitch reach from -1\.5708 to 1\.5708 rad, .* their words, -1 to 1:",
        ),
        ({"downlink__set_point_max": [1.0, 2.0]}, "has 2 values, and the plant 1 output"),
        ({"downlink__set_point_max": {"yaw": 1.0}}, "yaw"),
        (
            {"receiver__reference": {"kind": "constant", "amplitude": 0.3}},
            r"range 0\.3 to 0\.3 rad, which is empty.*set_point_min and downlink\.set_point_max",
        ),
        (
            {
                "downlink__announce_s": 60.0,
                "timing__tick_s": 0.05,
                "timing__symbol_period_s": 0.05,
                "channel__rate_baud": 20.0,
            },
            "announce_s = 60 is 1200 samples, more than the 1000",
        ),
        ({"receiver__reference": {"kind": "none"}}, "no output has a set-point"),
        (
            {"downlink__directions": [[0.5, -0.5]], "downlink__range_max": 0.7},
            r'downlink\.directions, downlink\.range_max: only for the scheme "coded"; .* leave it out',
        ),
        (
            {"downlink__scheme": "coded", "downlink__bits": 8},
            r'downlink\.bits: only for the scheme "mirrored"; .* set downlink\.scheme = "mirrored"',
        ),
        ({"timing__lead_ticks": 7, "downlink__scheme": "coded"}, "need lead_ticks >= 8"),
        ({"downlink__scheme": "coded", "downlink__directions": [[1.0]]}, r"1 row\(s\) of 1 numbers"),
        ({"downlink__scheme": "coded", "downlink__feedback": [[1.0]]}, r"downlink\.feedback has 1 row"),
        (
            {"downlink__scheme": "coded", "downlink__directions": [[1.0, 1.0], [2.0, 2.0]]},
            r"\[2\.0, 2\.0\]\]: a row is zero, or a sum of others",
        ),
        ({"downlink__scheme": "coded", "downlink__directions": [[0.0, 0.0]]}, "a row is zero"),
        (
            {"downlink__scheme": "coded", "downlink__range_min": 3.0},
            r"downlink\.range_min = 3, range_max = 0\.8 and value_max = 2 must rise",
        ),
        (
            {"downlink__law": {"base": [1.0]}},
            r"downlink\.law .* and the controller is pid: leave it out",
        ),
        ({"downlink__scheme": "coded", "downlink__turns": [0]}, "must name each of the 2 directions"),
        (
            {
                "downlink__scheme": "mirrored",
                "receiver__controller": "tests.tenbaud.build.own_laws:Plain",
            },
            r"own_laws:Plain has none: give it an attribute `mirrored`",
        ),
        (
            {
                "downlink__scheme": "mirrored",
                "receiver__controller": "tests.tenbaud.build.own_laws:Breaking",
            },
            r"cannot be mirrored: line \d+ of BreakingLaw\.command uses max\(\)",
        ),
    ],
)
def test_what_cannot_be_flown_is_refused_with_the_numbers(changes: dict[str, Any], what: str) -> None:
    with pytest.raises(ConfigError, match=what):
        agreed(**changes)


def test_a_recorded_flight_keeps_its_settings_without_effect() -> None:
    changes = {"channel": {"downlink": "narrow"}, "downlink": {"range_max": 0.7}}
    changes |= {"link": {"downlink": "narrow"}}
    config = load_config("tuned-10baud", None, changes, recorded=True)
    assert agree_again(config, "virtual", allow_code=False).identity == agreed().identity


def test_a_law_from_outside_is_mirrored_where_it_keeps_to_the_rules() -> None:
    name = "tests.tenbaud.build.own_laws:Keeping"
    agreement = agreed(downlink__scheme="mirrored", receiver__controller=name)
    shared = json.loads(agreement.identity.config)["downlink"]["law"]
    assert shared == {"controller": name, "options": {}}
    command, _ = mirrored(agreement).law.command((), (1.0,), (0.0,), (0.0,) * 4)
    assert command == (1.5, -1.5)


@pytest.mark.parametrize("sort", [own_laws.Keeping, own_laws.Plain])
def test_the_law_of_a_class_that_a_program_gives_is_mirrored_if_it_has_one(
    sort: Any, tmp_path: Path
) -> None:
    settings = {"duration_s": 1.0, "downlink.scheme": "mirrored"}
    given: dict[str, Any] = {"controller": sort, "downlink": "narrow", "settings": settings}
    if sort is own_laws.Plain:
        with pytest.raises(ConfigError, match="object:Plain has none: give it an attribute `mirrored`"):
            fly("tuned-10baud", **given, out=tmp_path / "run")
        return
    run = fly("tuned-10baud", **given, out=tmp_path / "run")
    assert run.summary is not None
    assert run.summary["narrow"]["scheme"] == "mirrored"


def test_a_set_point_by_hand_is_held_to_the_range_of_its_words() -> None:
    agreement = replace(agreed(), live=True)
    steering = steered(agreement)
    assert steering is not None
    assert steering[0] is not None
    one = mirrored(agreement).ranges[0]
    assert steering[0].stops == (one.low, one.high)


def test_a_controller_that_is_an_object_needs_the_range_of_its_set_points() -> None:
    config = load_config("tuned-10baud", None, {"channel": {"downlink": "narrow"}})
    controller = build_controller(config)
    with pytest.raises(ConfigError, match="which is empty"):
        agree(config, "virtual", Parts(controller=controller))
    ends = {"set_point_min": -2.0, "set_point_max": 2.0}
    config = load_config("tuned-10baud", None, {"channel": {"downlink": "narrow"}, "downlink": ends})
    (one,) = mirrored(agree(config, "virtual", Parts(controller=controller))).ranges
    assert (one.low, one.high, one.start) == (-2.0, 2.0, math.pi / 2)


def test_without_a_narrow_downlink_nothing_is_built() -> None:
    config = load_config("tuned-10baud")
    terms = agree(config, "virtual").terms
    assert build_two_way(config, build_codec(config), terms) == (None, None)

"""Lines that somebody outside causes: the first at once, then few, none without being counted."""

from __future__ import annotations

from tenbaud.flight.rate_limited_log import CHARACTERS_MAX, LINES_AT_ONCE, PERIOD_S, RateLimitedLog


def test_when_lines_come_in_a_flood_then_the_first_are_reported_and_the_rest_counted() -> None:
    told: list[str] = []
    now_s = [0.0]
    log = RateLimitedLog(told.append, lambda: now_s[0])
    for number in range(LINES_AT_ONCE + 500):
        log(f"refused {number}")
    assert told == [f"refused {number}" for number in range(LINES_AT_ONCE)]
    now_s[0] += PERIOD_S
    log("one more")
    log("too many again")
    assert told[LINES_AT_ONCE:] == ["one more (500 more such line(s) left out)"]
    log.finish()
    assert told[-1] == "(1 more such line(s) left out)"
    log.finish()
    assert len(told) == LINES_AT_ONCE + 2


def test_when_it_was_quiet_then_as_many_as_at_first_are_reported_again() -> None:
    told: list[str] = []
    now_s = [0.0]
    log = RateLimitedLog(told.append, lambda: now_s[0])
    for _ in range(2):
        for _ in range(LINES_AT_ONCE):
            log("refused")
        now_s[0] += 1e6
    assert told == ["refused"] * 2 * LINES_AT_ONCE


def test_when_a_text_would_command_the_terminal_then_it_is_reported_as_plain_text() -> None:
    told: list[str] = []
    RateLimitedLog(told.append)("why:\n  \x1b[2J\a" + "x" * CHARACTERS_MAX)
    (line,) = told
    assert line.startswith("why:\n  ?[2J?xx")
    assert line.endswith("x ...")
    assert len(line) == CHARACTERS_MAX + 4

"""The ticks at the plant: the receiver's commands, and the guard's voltages."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

from tenbaud.audit.base import Evidence, claim
from tenbaud.build.ends import guard_settings
from tenbaud.build.flight import Agreement
from tenbaud.build.signals import build_encoders
from tenbaud.replay.bits import is_same

TICK = ("transmitter", "tick")
STOPPED = ("ramping", "latched")
FOLLOWS: dict[str, tuple[str, ...]] = {
    "ready": ("ready", "running", *STOPPED),
    "running": ("running", "holding", *STOPPED),
    "holding": ("holding", "running", *STOPPED),
    "ramping": (*STOPPED, "ready", "running"),
    "latched": ("latched", "ready", "running"),
}
"""State of the guard -> those of the next tick."""


@claim("ticks at their times", (*TICK, "tick", "time_s", "lateness_ms", "late"))
def check_ticks(evidence: Evidence) -> None:
    """Each tick at its own time, none missing that the clock did not miss."""
    terms, is_virtual = evidence.terms, evidence.agreement.clock == "virtual"
    rows = evidence.topic(*TICK).rows
    missed = 0
    before: Any = None
    for place, row in evidence.each(*TICK):
        if row.time_s != row.tick * terms.tick_ns / 1e9:
            place.leak("time_s", "it is not the tick's", f"{row.time_s!r} s")
        if is_virtual and row.lateness_ms != 0.0:
            place.leak("lateness_ms", "no tick is late on the virtual clock")
        if before is not None and row.tick > before.tick + 1:
            missed += row.tick - before.tick - 1
            if is_virtual:
                lacking = evidence.at(*TICK, f"tick {before.tick + 1}")
                lacking.gap("tick", "it is missing", f"the next one is {row.tick}")
        before = row
    if not evidence.is_whole("transmitter") or not rows:
        return
    every = evidence.at(*TICK, "all ticks")
    summary = evidence.summary("transmitter")
    said = summary.get("ticks_missed", 0 if is_virtual else None)
    if said is not None and missed > said:
        detail = f"{missed} missing, {said} missed"
        every.gap("tick", "more are missing than the clock missed", detail)
    if "duration_s" in summary and "ticks_missed" not in summary:
        flown = round(summary["duration_s"] * 1e9) // terms.tick_ns
        if flown != len(rows):
            every.gap("tick", "not all that were flown are recorded", f"{len(rows)} of {flown}")
    late = sum(row.late for row in rows)
    if "commands_late" in summary and summary["commands_late"] != late:
        detail = f"{summary['commands_late']} said, {late} recorded"
        every.leak("late", "the summary's commands_late is another", detail)


@claim("commands as the receiver gave them", (*TICK, "commanded"))
def check_commanded(evidence: Evidence) -> None:
    """A tick's command is the receiver's, or the one that its epoch holds at the beginning."""
    expected = evidence.expected
    # With a narrow downlink it is the transmitter's own: the mean over what it takes for possible.
    if expected is None or evidence.agreement.two_way is not None:
        return
    decided = evidence.topic("receiver", "tick").by_key()
    covered = range(0)
    if evidence.is_whole("receiver") and evidence.epochs:
        first = evidence.epochs[0].start.sample * evidence.terms.ticks_per_sample
        covered = range(first, max(expected.commands, default=-1) + 1)
    for place, row in evidence.each(*TICK):
        if row.commanded is None:
            continue
        given = [expected.held[row.tick]] if row.tick in expected.held else []
        if row.tick in expected.commands:
            given.append(expected.commands[row.tick].command)
        if row.tick in decided:
            given.append(decided[row.tick].command)
        if not any(is_same(row.commanded, one) for one in given) and (given or row.tick in covered):
            detail = f"{row.commanded}, not {' or '.join(map(str, given)) or 'any'}"
            place.leak("commanded", "the receiver commanded something else", detail)


@claim(
    "voltages as the guard let them pass",
    (*TICK, "commanded", "applied", "guard", "late"),
    ("transmitter", "event", "time_s", "kind"),
)
def check_guard(evidence: Evidence) -> None:
    """The guard's states follow each other as they can, and each lets its own voltage pass.

    When the watchdog trips is the guard's own business; that it did is in its state.
    """
    config = evidence.agreement.config
    by_guard = config.transmitter.rig != "replay" and not config.transmitter.dry_run
    reported = {round(row.time_s * 1e9) for row in evidence.topic("transmitter", "event")}
    tick_ns = evidence.terms.tick_ns
    passed = _Passed(evidence.agreement)
    changes: list[int] = []
    for place, row in evidence.each(*TICK):
        now_ns = row.tick * tick_ns
        fault = passed.take(row)
        if fault:
            place.leak("guard", fault, row.guard)
            return
        if by_guard and not is_same(passed.volts, row.applied):
            detail = f"recorded {row.applied}, computed {passed.volts}"
            place.leak("applied", "it is not the guard's output", detail)
        if passed.changed and row.guard != "running":
            changes.append(now_ns)
        if passed.armed_again and not {now_ns, now_ns - tick_ns} & reported:
            place.gap("guard", "no event tells that it was armed again", row.guard)
        if row.late and (row.commanded is not None or passed.stays_stopped):
            place.leak("late", "no command was owed, or it had come")
    _check_reported(evidence, changes)


def _check_reported(evidence: Evidence, changes: list[int]) -> None:
    """Each change of the guard, but that to passing commands, is one event, and no other is."""
    guards = [row for row in evidence.topic("transmitter", "event") if row.kind == "guard"]
    reported = Counter(round(row.time_s * 1e9) for row in guards)
    changed = Counter(changes)
    complete = evidence.is_whole("transmitter")
    for now_ns in sorted(reported.keys() | changed.keys()):
        if reported[now_ns] != changed[now_ns] and (complete or now_ns < max(changes, default=0)):
            what = "the guard's state in the ticks tells of another number of changes"
            place = evidence.at("transmitter", "event", f"time {now_ns / 1e9:.3f} s")
            place.gap("kind", what, f"{reported[now_ns]} events, {changed[now_ns]} changes")


class _Passed:
    """The voltages that the guard allows, in the recorded states."""

    def __init__(self, agreement: Agreement) -> None:
        settings = guard_settings(agreement)
        self.volts = settings.safe_command
        self.changed = False
        """whether the last row brought another state"""
        self.armed_again = False
        self.stays_stopped = False
        self._safe, self._ramp_ticks = settings.safe_command, settings.ramp_ticks
        self._limits = agreement.terms.limits
        self._state = "ready"
        self._from, self._ramped = self.volts, 0

    def take(self, row: Any) -> str:
        """Take one tick; return why its state cannot be, if it cannot."""
        state, before, command = row.guard, self._state, row.commanded
        if state not in FOLLOWS.get(before, ()):
            return f"it cannot follow {before}"
        if (state == "running") != (command is not None) and state not in STOPPED:
            return "a command came" if command is not None else "no command came"
        self.changed, self._state = state != before, state
        self.armed_again = before in STOPPED and state not in STOPPED
        self.stays_stopped = before in STOPPED and state in STOPPED
        if state == "running" and command is not None:
            self.volts = self._limits.apply(command, self.volts)
        elif state in STOPPED:
            if before not in STOPPED:
                self._from, self._ramped = self.volts, 0
            return self._ramp(state)
        return ""

    def _ramp(self, state: str) -> str:
        self._ramped += 1
        left = 1.0 - self._ramped / self._ramp_ticks
        if (state == "latched") != (left <= 0.0):
            return "the ramp is over" if left <= 0.0 else "the ramp is not over"
        self.volts = self._safe
        if left > 0.0:
            pairs = zip(self._from, self._safe, strict=True)
            self.volts = tuple(safe + (start - safe) * left for start, safe in pairs)
        return ""


@claim("angles as the encoder reads them", (*TICK, "measured", "true"))
def check_angles(evidence: Evidence) -> None:
    """On a simulated rig, what the encoder reads is the true angle, rounded."""
    agreement = evidence.agreement
    if agreement.config.transmitter.rig != "simulated":
        return
    encoders = build_encoders(agreement.config, agreement.signals)
    for place, row in evidence.each(*TICK):
        if row.true is None:
            place.gap("true", "a simulated rig knows its angle")
            continue
        true = [math.nan if one is None else one for one in row.true]
        read = tuple(encoder.read(one)[1] for encoder, one in zip(encoders, true, strict=False))
        if not is_same(read, row.measured):
            detail = f"recorded {row.measured}, computed {read}"
            place.leak("measured", "the encoder reads another angle there", detail)

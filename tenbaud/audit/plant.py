"""The ticks beside the plant: commands as the receiver gave them, volts as the guard let them pass."""

from __future__ import annotations

from collections import Counter
from typing import Any

from tenbaud.audit.base import Claim, Evidence, Findings, Place, is_same
from tenbaud.build.ends import guard_settings
from tenbaud.build.flight import Agreement
from tenbaud.build.signals import build_encoders

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


def check_ticks(evidence: Evidence, findings: Findings) -> None:
    """Each tick at its own time, none missing that the clock did not miss."""
    terms = evidence.agreement.terms
    rows = evidence.topic(*TICK).rows
    missed = 0
    for before, row in zip([None, *rows], rows, strict=False):
        place = _place(row)
        if row.time_s != row.tick * terms.tick_ns / 1e9:
            findings.leak(place._replace(field="time_s"), "it is not the tick's", f"{row.time_s!r} s")
        if evidence.agreement.clock == "virtual" and row.lateness_ms != 0.0:
            findings.leak(place._replace(field="lateness_ms"), "no tick is late on the virtual clock")
        if before is not None and row.tick > before.tick + 1:
            missed += row.tick - before.tick - 1
            if evidence.agreement.clock == "virtual":
                lacking = _place(before, "tick")._replace(row=f"tick {before.tick + 1}")
                findings.gap(lacking, "it is missing", f"the next one is {row.tick}")
    end = evidence.end("transmitter")
    if end is None or not end.complete or not rows:
        return
    summary = evidence.summary("transmitter")
    said = summary.get("ticks_missed", 0 if evidence.agreement.clock == "virtual" else None)
    if said is not None and missed > said:
        findings.gap(
            Place(*TICK, "all ticks", "tick"),
            "more are missing than the clock missed",
            f"{missed} missing, {said} missed",
        )
    if "duration_s" in summary and "ticks_missed" not in summary:
        flown = round(summary["duration_s"] * 1e9) // terms.tick_ns
        if flown != len(rows):
            findings.gap(
                Place(*TICK, "all ticks", "tick"),
                "not all that were flown are recorded",
                f"{len(rows)} of {flown}",
            )
    late = sum(row.late for row in rows)
    if "commands_late" in summary and summary["commands_late"] != late:
        findings.leak(
            Place(*TICK, "all ticks", "late"),
            "the summary's commands_late is another",
            f"{summary['commands_late']} said, {late} recorded",
        )


def check_commanded(evidence: Evidence, findings: Findings) -> None:
    """A tick's command is the receiver's, or the one that its epoch holds at the beginning."""
    expected = evidence.expected
    if expected is None:
        return
    decided = evidence.topic("receiver", "tick").by_key()
    for row in evidence.topic(*TICK):
        if row.commanded is None:
            continue
        given = [expected.held[row.tick]] if row.tick in expected.held else []
        if row.tick in expected.commands:
            given.append(expected.commands[row.tick]["command"])
        if row.tick in decided:
            given.append(decided[row.tick].command)
        if not any(is_same(row.commanded, one) for one in given) and (
            given or _is_covered(evidence, row.tick)
        ):
            findings.leak(
                _place(row, "commanded"),
                "the receiver commanded something else",
                f"{row.commanded}, not {' or '.join(map(str, given)) or 'any'}",
            )


def check_guard(evidence: Evidence, findings: Findings) -> None:
    """The guard's states follow each other as they can, and each lets its own voltage pass.

    When the watchdog trips is the guard's own business; that it did is in its state.
    """
    config = evidence.agreement.config
    by_guard = config.transmitter.rig != "replay" and not config.transmitter.dry_run
    told = {round(row.time_s * 1e9) for row in evidence.topic("transmitter", "event")}
    tick_ns = evidence.agreement.terms.tick_ns
    passed = _Passed(evidence.agreement)
    changes: list[int] = []
    for row in evidence.topic(*TICK):
        place = _place(row, "guard")
        now_ns = row.tick * tick_ns
        fault = passed.take(row)
        if fault:
            findings.leak(place, fault, row.guard)
            return
        if by_guard and not is_same(passed.volts, row.applied):
            findings.leak(
                place._replace(field="applied"),
                "it is not what the guard lets pass",
                f"recorded {row.applied}, computed {passed.volts}",
            )
        if passed.changed and row.guard != "running":
            changes.append(now_ns)
        if passed.armed_again and not {now_ns, now_ns - tick_ns} & told:
            findings.gap(place, "no event tells that it was armed again", row.guard)
        if row.late and (row.commanded is not None or passed.stays_stopped):
            findings.leak(place._replace(field="late"), "no command was owed, or it had come")
    _check_told(evidence, changes, findings)


def _check_told(evidence: Evidence, changes: list[int], findings: Findings) -> None:
    """Each change of the guard, but that to passing commands, is one event, and no other is."""
    guards = [row for row in evidence.topic("transmitter", "event") if row.kind == "guard"]
    told = Counter(round(row.time_s * 1e9) for row in guards)
    changed = Counter(changes)
    complete = evidence.rows["transmitter"].complete if guards or changes else True
    for now_ns in sorted(told.keys() | changed.keys()):
        if told[now_ns] != changed[now_ns] and (complete or now_ns < max(changes, default=0)):
            findings.gap(
                Place("transmitter", "event", f"time {now_ns / 1e9:.3f} s", "kind"),
                "the guard's state in the ticks tells of another number of changes",
                f"{told[now_ns]} events, {changed[now_ns]} changes",
            )


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


def _number(angle: float | None) -> float:
    return float("nan") if angle is None else angle


def check_angles(evidence: Evidence, findings: Findings) -> None:
    """On a simulated rig, what the encoder reads is the true angle, rounded."""
    config = evidence.agreement.config.transmitter
    if config.rig != "simulated":
        return
    encoders = build_encoders(evidence.agreement.config, evidence.agreement.signals)
    for row in evidence.topic(*TICK):
        if row.true is None:
            findings.gap(_place(row, "true"), "a simulated rig knows its angle")
            continue
        pairs = zip(encoders, row.true, strict=False)
        read = tuple(encoder.read(_number(one))[1] for encoder, one in pairs)
        if not is_same(read, row.measured):
            findings.leak(
                _place(row, "measured"),
                "the encoder reads another angle there",
                f"recorded {row.measured}, computed {read}",
            )


def _is_covered(evidence: Evidence, tick: int) -> bool:
    """Whether the receiver's recording covers a tick."""
    if (
        evidence.end("receiver") is None
        or not evidence.epochs
        or not evidence.rows["receiver"].complete
    ):
        return False
    first = evidence.epochs[0].start.sample * evidence.agreement.terms.ticks_per_sample
    last = max(evidence.expected.commands, default=-1) if evidence.expected else -1
    return first <= tick <= last


def _place(row: Any, field: str = "") -> Place:
    return Place(*TICK, f"tick {row.tick}", field)


TICKS = Claim(
    "ticks at their times", check_ticks, ((*TICK, ("tick", "time_s", "lateness_ms", "late")),)
)
COMMANDED = Claim("commands as the receiver gave them", check_commanded, ((*TICK, ("commanded",)),))
GUARD = Claim(
    "voltages as the guard let them pass",
    check_guard,
    (
        (*TICK, ("commanded", "applied", "guard", "late")),
        ("transmitter", "event", ("time_s", "kind")),
    ),
)
ANGLES = Claim("angles as the encoder reads them", check_angles, ((*TICK, ("measured", "true")),))

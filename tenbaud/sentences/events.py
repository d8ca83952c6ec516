"""One sentence for each event, from its fields as recordings and telemetry hold them.

Only displays call this module and `endings`; no program parses the sentences.
Call them through the module (`events.event_text`), so that a test can replace every sentence.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from channel.protocol.endings import Ending
from tenbaud.sentences import endings
from tenbaud.sentences.quantities import amount
from transmitter.guard import GuardReason

Fields = Mapping[str, Any]
"""names of `EVENT_CHANNEL` to values; a field that is missing counts as null"""


def event_text(fields: Fields) -> str:
    """Return the sentence for an event; the recorded one for an event of a version that recorded it."""
    recorded = fields.get("text")
    if recorded is not None:
        return str(recorded)
    render = _EVENTS.get(str(fields.get("kind")))
    try:
        return render(_Known(fields)) if render is not None else _plain(fields)
    except (KeyError, TypeError, ValueError):
        # Fields of another version, or of a file that was changed.
        return _plain(fields)


def guard_text(reason: GuardReason | None) -> str:
    """Return why the guard ramped the voltage down."""
    if reason is None:
        return ""
    return _guard_cause(_Known({name: getattr(reason, name) for name in GuardReason.__slots__}))


class _Known(dict[str, Any]):
    """Fields by name; null where there is none."""

    def __missing__(self, name: str) -> None:
        return None


def _plain(fields: Fields) -> str:
    """Return the fields themselves."""
    left = {name: value for name, value in fields.items() if value is not None}
    shown = [f"{name} {left[name]}" for name in left if name not in ("time_s", "kind", "sample")]
    return ", ".join(shown)


def _with(text: str, detail: object) -> str:
    return f"{text}: {detail}" if detail else text


def _begins(one: Fields) -> str:
    return f"session {one['session']:08x}, epoch {one['epoch']}, begins at sample {one['sample']}"


def _ending(name: object) -> str:
    known = Ending.__members__.get(str(name).upper())
    return str(name).replace("_", " ") if known is None else endings.ending_text(known)


def _ended(one: Fields) -> str:
    said = one["detail"] or _ending(one["cause"])
    return f"the other end ended the flight: {said}" if one["by_peer"] else str(said)


def _refused(one: Fields) -> str:
    if one["cause"] == "second_receiver":
        return "a second receiver requested this flight: refused"
    said = str(one["detail"] or _ending(one["cause"]))
    return f"the receiver that takes over refused: {said}" if one["session"] is not None else said


def _rejoin_asked(one: Fields) -> str:
    why: dict[str, Callable[[], str]] = {
        "desync": lambda: f"the two copies of the codec differ after sample {one['sample']}",
        "gap": lambda: f"the echo of sample {one['sample']} and its repetitions were lost",
        "lag": lambda: _lag(one),
        "rest": lambda: f"what came down since sample {one['sample']} fits no state of the receiver",
        "unknown": lambda: "the receiver does not know this session",
        "guard": lambda: "the guard stopped",
        "taken_over": lambda: f"receiver session {one['session']:08x} takes over on request",
    }
    return f"{why[one['cause']]()}: requesting a new epoch after {one['epoch']}"


def _lag(one: Fields) -> str:
    if one["detail"]:
        return f"this end's copy of the codec cannot continue ({one['detail']})"
    if one["value"] is not None:
        return f"none of the last {one['number']} samples was confirmed"
    return f"no echo for {one['number']} samples"


def _dropped(one: Fields) -> str:
    texts = {
        "settled": f"slot {one['slot']} was already decided: dropped",
        "past_deadline": f"slot {one['slot']} arrived after its deadline: dropped",
        "far_ahead": f"slot {one['slot']} is {one['number']} ahead: dropped",
        "not_due": f"a symbol of slot ...{one['slot']} is not due: dropped",
        "out_of_bounds": f"dropped a frame that is out of bounds: {one['detail']}",
    }
    return texts[one["cause"]]


def _guard(one: Fields) -> str:
    return _with(f"guard {one['state']}", _guard_cause(one) if one["cause"] else "")


def _guard_cause(one: Fields) -> str:
    axis, tick, value, limit = one["axis"], one["tick"], one["value"], one["limit"]
    match str(one["cause"]):
        case "timed_out":
            return f"no command for {one['number']} ticks up to tick {tick}"
        case "stopped":
            return endings.ending_text(Ending.STOPPED)
        case "session_ended":
            return "the session has ended"
        case "flight_over":
            return "the flight has ended"
        case "sensor":
            return f"tick {tick}: {one['detail']}"
        case "angle_limit":
            name, _, unit = str(one["detail"] or f"axis {axis}, rad").partition(", ")
            return (
                f"{name}: {amount(value, unit)} at tick {tick} is beyond the soft limit of "
                f"{amount(limit, unit)}"
            )
        case "no_angle":
            return f"{one['detail'] or f'axis {axis}'} has no valid reading at tick {tick}"
        case "bad_command":
            return f"the command of tick {tick} is not a number"
    return str(one["cause"])


def _controller(one: Fields) -> str:
    if one["cause"] == "reference":
        return f"the reference of tick {one['tick']} failed: {one['detail']}"
    return f"at tick {one['tick']} the controller {one['detail']}; its last command is held"


def _peer(one: Fields) -> str:
    texts = {
        "gone": "the receiver is gone",
        "back": "the receiver is back",
        "silent": f"no symbol for {one['number']} samples: waiting for one",
    }
    return texts[one["cause"]]


def _rate(one: Fields) -> str:
    if one["cause"] == "kept":
        return "the symbol rate has recovered"
    return (
        f"the symbol rate is too low: {one['limit']:g} symbols/s are configured, "
        f"{one['value']:.0f} arrive in time, {1.0 - one['value'] / one['limit']:.1%} of the symbols "
        f"are late or were never sent. This process missed {one['missed_share']:.1%} of its ticks; in "
        f"{one['overdue_share']:.1%} of the others the receiver's answers were overdue. Lower "
        "channel.rate_baud, or give both processes more processor time"
    )


def _control(one: Fields) -> str:
    tick = one["tick"]
    before = f"tick {tick}" if tick is not None else f"sample {one['sample']}"
    # In a recording without the unit it is an angle.
    unit = "rad" if one["detail"] is None else str(one["detail"])
    texts: dict[str, Callable[[], str]] = {
        "set_point": lambda: f"set-point {amount(one['value'], unit)}",
        "follow": lambda: "follow the reference",
        "pause": lambda: f"pause before tick {one['number']}",
        "go_on": lambda: "continue",
        "pace": lambda: f"{one['value']!r} times real time",
        "impair": lambda: line_text(one["detail"] or ""),
        "corrupt": lambda: (
            f"one bit of this codec's {one['detail']} changed after sample {one['sample']}"
        ),
        "ignored": lambda: f"{one['detail']}: ignored",
    }
    return f"manual, before {before}: {texts[one['cause']]()}"


def line_text(impairments: str) -> str:
    """Return a sentence about the impairments of the line from now on."""
    return f"the line now has {impairments}" if impairments else "the line is clean"


_EVENTS: Mapping[str, Callable[[Fields], str]] = {
    "started": _begins,
    "ended": _ended,
    "refused": _refused,
    "desync": lambda one: endings.difference_text(
        one["sample"], one["transmitter_digest"], one["receiver_digest"]
    ),
    "rejoin_asked": _rejoin_asked,
    "rejoin": _begins,
    "erased": lambda one: f"slot {one['slot']} is erased",
    "late_symbol": _dropped,
    "stale": _dropped,
    "malformed": lambda one: f"dropped a message: {one['detail']}",
    "guard": _guard,
    "sensor": lambda one: f"tick {one['tick']}: {one['detail']}",
    "controller": _controller,
    "peer": _peer,
    "control": _control,
    "rate": _rate,
}

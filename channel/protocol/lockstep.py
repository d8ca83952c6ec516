"""The history for a difference between the two copies, and its records.

Each end keeps its last states and inputs. A failure is found at the transmitter up to one lag after
it happened, so the ring of states is longer than any lag that is allowed.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import NamedTuple

from channel.codec.codec import Codec, CodecState, Word
from channel.protocol.events import Event, EventKind
from channel.protocol.frames import Desync
from channel.protocol.recording import Field, RecordChannel, Recorder

HISTORY_SAMPLES = 64
HISTORY_NS = 250_000_000
"""Bound on history, whichever is longer: echoes may lag, and symbols may jump ahead, by this many
samples or this time; past it the ends rejoin instead of catching up. In samples alone, the bound of a
fast flight would be shorter than an ordinary pause of a process."""

STATES_KEPT = 2 * HISTORY_SAMPLES
INPUTS_KEPT = 64

LOCKSTEP_CHANNEL = RecordChannel(
    "lockstep_failure",
    (
        Field("sample", "integer", "", "first sample after which the two copies differ"),
        Field("epoch", "integer", "", "epoch of that sample"),
        Field("digest", "string", "", "digest of this end's state after the sample"),
        Field("peer_digest", "string", "", "digest of the other end's"),
        Field("state", "numbers", "", "this end's model state after the sample"),
        Field("coder", "numbers", "", "this end's coder state after the sample"),
        Field("peer_state", "numbers", "", "the other end's model state; null: not known here yet"),
        Field("peer_coder", "numbers", "", "the other end's coder state; null: not known here yet"),
        Field("input_samples", "integers", "", "samples of the last inputs, oldest first"),
        Field("input_words", "integers", "", "wire numbers of their words; 65535: erased"),
    ),
)


class _Kept(NamedTuple):
    epoch: int
    word: Word
    state: CodecState


class History:
    """The last samples of one copy: word consumed and state after it."""

    def __init__(self, codec: Codec, states_kept: int = STATES_KEPT) -> None:
        self._codec = codec
        self._kept: deque[_Kept] = deque(maxlen=states_kept)

    def add(self, epoch: int, word: Word, state: CodecState) -> None:
        self._kept.append(_Kept(epoch, word, state))

    def state_after(self, sample: int) -> CodecState | None:
        """Return the state after a sample, None when it is not kept (any more)."""
        for kept in reversed(self._kept):
            if kept.state.sample == sample + 1:
                return kept.state
        return None

    def last_words(self, count: int) -> list[Word]:
        """Return the words of the last samples, oldest first; may be called from another thread."""
        # Copied in one go: the flight's thread may add to it meanwhile.
        return [kept.word for kept in tuple(self._kept)[-count:]]

    def failure_row(
        self, epoch: int, sample: int, digest: int, peer_digest: int, peer: bytes
    ) -> tuple[object, ...]:
        """Return the row of `LOCKSTEP_CHANNEL`; `peer` is the other end's packed state, or empty."""
        own = self.state_after(sample)
        theirs = unpacked(self._codec, peer)
        inputs = [kept for kept in self._kept if kept.state.sample <= sample + 1][-INPUTS_KEPT:]
        word_number = self._codec.coder.alphabet.word_number
        return (
            sample,
            epoch,
            f"{digest:016x}",
            f"{peer_digest:016x}",
            own and own.model,
            own and own.coder,
            theirs and theirs.model,
            theirs and theirs.coder,
            [kept.state.sample - 1 for kept in inputs],
            [word_number(kept.word) for kept in inputs],
        )


def write_failure(
    recorder: Recorder,
    sample_ns: int,
    history: History,
    report: Desync,
    peer: bytes,
    *,
    received: bool = False,
) -> None:
    """Write a lockstep failure down as this end sees it; `received`: the other end reports it.

    `peer` is the other end's packed state, or empty: the transmitter writes a failure when it is found,
    and once more with the receiver's state.
    """
    own, other = report.transmitter_digest, report.receiver_digest
    digests = (other, own) if received else (own, other)
    row = history.failure_row(report.epoch, report.sample, *digests, peer)
    recorder.write(LOCKSTEP_CHANNEL, report.sample * sample_ns, row)


def difference_event(report: Desync) -> Event:
    """Return the event that reports a lockstep failure."""
    return Event(
        EventKind.DESYNC,
        report.sample,
        epoch=report.epoch,
        transmitter_digest=report.transmitter_digest,
        receiver_digest=report.receiver_digest,
    )


def is_answer(report: Desync, own: Desync | None) -> bool:
    """Return whether a report is the answer to this end's own: the same, with another state."""
    return own is not None and own == replace(report, state=own.state)


def unpacked(codec: Codec, data: bytes) -> CodecState | None:
    """Return the state in these bytes, None when they hold none of this codec."""
    try:
        return codec.unpack(data) if data else None
    except ValueError:
        return None

"""The files: whose they are, that they hold all rows that were written, and that none was lost."""

from __future__ import annotations

from dataclasses import replace

from channel.protocol.identity import Identity
from tenbaud.audit.base import Claim, Evidence, Findings, Place
from tenbaud.recording.encoding import SIGNALS_KEY, signals_text
from tenbaud.recording.notes import hole_notes, stray_notes
from tenbaud.recording.recover import RECOVERED_NOTE
from tenbaud.recording.table import Tables


def check_heads(evidence: Evidence, findings: Findings) -> None:
    """Both recordings are headed by the end, the timing and the configuration that they are of."""
    identity = evidence.agreement.identity
    for end, tables in evidence.record.ends():
        wanted = {
            "role": end,
            "config_digest": _recorded(identity, tables).config_digest.hex(),
            "tick_s": repr(evidence.agreement.config.timing.tick_s),
            SIGNALS_KEY: signals_text(evidence.agreement.signals),
        }
        for name, value in wanted.items():
            said = tables.metadata.get(name)
            if said is not None and said != value:
                findings.leak(Place(end, "head", name), "it is another", f"{said}, not {value}")
    clocks = {tables.metadata.get("clock") for _, tables in evidence.record.ends()}
    if len(clocks) > 1:
        findings.leak(Place("receiver", "head", "clock"), "the ends flew on different clocks")


def _recorded(identity: Identity, tables: Tables) -> Identity:
    """Return the identity whose settings are written as they were recorded, old names included."""
    return replace(identity, config=tables.metadata.get("shared_config", identity.config))


def check_rows(evidence: Evidence, findings: Findings) -> None:
    """A file holds as many rows as its recorder says it wrote, and none was lost before that."""
    for end, tables in evidence.record.ends():
        place = Place(end, "all topics", "all rows")
        held = sum(len(table) for table in tables.topics.values())
        for note in hole_notes(tables.path, tables.holes) + stray_notes(tables.path, tables.strays):
            findings.gap(place, note)
        dropped = _count(tables.end.get("rows_dropped", "0"))
        if dropped:
            findings.gap(place, "the recorder lost rows", f"{dropped}")
        if "error" in tables.end:
            findings.gap(place, "the recorder met an error", tables.end["error"])
        written = tables.end.get("rows_written")
        if tables.end and written is None:
            findings.gap(place, "the recorder did not say how many rows it wrote")
        elif written is not None and _count(written) != held:
            findings.gap(place, "not all are there", f"{held} of {written} that were written")
        # The summary of both ends is about the transmitter's recorder, that of one about its own.
        if ("coder_bits_up" in evidence.summary(end)) == (end == "transmitter"):
            _check_summary(evidence, end, held, findings)


def check_figures(evidence: Evidence, findings: Findings) -> None:
    """The summary counts as many samples, epochs and late symbols as were recorded."""
    for end, topic, name, counted in _figures(evidence):
        said = evidence.summary(end).get(name)
        if evidence.rows[end].complete and said is not None and said != counted:
            findings.gap(
                Place(end, topic, "all rows"),
                f"the summary's {name} is another",
                f"{said} said, {counted} recorded",
            )


def _figures(evidence: Evidence) -> list[tuple[str, str, str, int]]:
    """Return (end, topic, name in the summary, number recorded)."""
    found = []
    if evidence.end("transmitter") is not None:
        samples = evidence.topic("transmitter", "sample").rows
        erased = sum(row.word is None for row in samples)
        rejoins = len(evidence.topic("transmitter", "epoch")) - 1
        found += [
            ("transmitter", "sample", "digest_checks", len(samples)),
            ("transmitter", "sample", "erasures", erased),
            ("transmitter", "epoch", "rejoins", max(0, rejoins)),
        ]
        if "coder_bits_up" not in evidence.summary("transmitter"):
            found.clear()  # they are the receiver's
    if evidence.end("receiver") is not None and evidence.agreement.link.carries_slots:
        # A serial line's receiver does not write down what came after its deadline.
        late = sum(not row.taken for row in evidence.topic("receiver", "symbol"))
        found.append(("receiver", "symbol", "symbols_late", late))
    return found


def check_lockstep(evidence: Evidence, findings: Findings) -> None:
    """Two copies that differ are written down as such; a sample that did not differ is not."""
    for end in evidence.rows:
        for row in evidence.topic(end, "lockstep_failure"):
            if row.digest == row.peer_digest:
                place = Place(end, "lockstep_failure", f"sample {row.sample}", "peer_digest")
                findings.leak(place, "the digests do not differ")


def _check_summary(evidence: Evidence, end: str, held: int, findings: Findings) -> None:
    summary = evidence.summary(end)
    place = Place(end, "all topics", "all rows")
    lost = summary.get("recording_rows_lost")
    if lost:
        findings.gap(place, "the summary says that rows were lost", f"{lost}")
    if summary.get("recording_error"):
        findings.gap(place, "the summary says that recording failed", summary["recording_error"])
    said = summary.get("recording_rows")
    recovered = RECOVERED_NOTE in dict(evidence.record.ends())[end].end
    if said is not None and said != held and not recovered:
        findings.gap(place, "the summary says another number", f"{said}, {held} are there")


def _count(text: str) -> int:
    """Return a count as the recorder wrote it; -1 for any other text."""
    return int(text) if text.isdecimal() else -1


HEADS = Claim("files of this flight", check_heads, ())
ROWS = Claim("all rows that were written", check_rows, ())
FIGURES = Claim("the summary's figures", check_figures, ())
LOCKSTEP = Claim(
    "differences are differences",
    check_lockstep,
    tuple((end, "lockstep_failure", ("digest", "peer_digest")) for end in ("transmitter", "receiver")),
)

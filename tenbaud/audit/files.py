"""The files: the flight that they belong to, and that no written row is missing."""

from __future__ import annotations

from dataclasses import replace

from tenbaud.audit.base import Evidence, claim
from tenbaud.recording.encoding import SIGNALS_KEY, recorded_signals, signals_text
from tenbaud.recording.notes import hole_notes, stray_notes
from tenbaud.recording.old_rows import is_same_plant
from tenbaud.recording.recover import RECOVERED_NOTE


@claim("files of this flight")
def check_heads(evidence: Evidence) -> None:
    """Both recordings are headed by the end, the timing and the configuration that they are of."""
    identity = evidence.agreement.identity
    for end, tables in evidence.record.tables.items():
        # Settings are written as they were recorded, old names included.
        recorded = replace(identity, config=tables.metadata.get("shared_config", identity.config))
        wanted = {
            "role": end,
            "config_digest": recorded.config_digest.hex(),
            "tick_s": repr(evidence.agreement.config.timing.tick_s),
        }
        if not is_same_plant(recorded_signals(tables.metadata), evidence.agreement.signals):
            wanted[SIGNALS_KEY] = signals_text(evidence.agreement.signals)
        for name, value in wanted.items():
            said = tables.metadata.get(name)
            if said is not None and said != value:
                evidence.at(end, "head", name).leak("", "it is another", f"{said}, not {value}")
    clocks = {tables.metadata.get("clock") for tables in evidence.record.tables.values()}
    if len(clocks) > 1:
        evidence.at("receiver", "head", "clock").leak("", "the ends flew on different clocks")


@claim("all rows that were written")
def check_rows(evidence: Evidence) -> None:
    """A file holds as many rows as its recorder says it wrote, and none was lost before that."""
    for end, tables in evidence.record.tables.items():
        place = evidence.at(end, "all topics", "all rows")
        held = sum(len(table) for table in tables.topics.values())
        for note in hole_notes(tables.path, tables.holes) + stray_notes(tables.path, tables.strays):
            place.gap("", note)
        dropped = int(tables.end.get("rows_dropped", "0"))
        if dropped:
            place.gap("", "the recorder lost rows", f"{dropped}")
        if "error" in tables.end:
            place.gap("", "the recorder met an error", tables.end["error"])
        written = tables.end.get("rows_written")
        if tables.end and written is None:
            place.gap("", "the recorder did not say how many rows it wrote")
        elif written is not None and int(written) != held:
            place.gap("", "not all are there", f"{held} of {written} that were written")
        # The summary of both ends is about the transmitter's recorder, that of one about its own.
        summary = evidence.summary(end)
        if ("coder_bits_up" in summary) != (end == "transmitter"):
            continue
        if lost := summary.get("recording_rows_lost"):
            place.gap("", "the summary says that rows were lost", f"{lost}")
        if error := summary.get("recording_error"):
            place.gap("", "the summary says that recording failed", error)
        said = summary.get("recording_rows")
        if said is not None and said != held and RECOVERED_NOTE not in tables.end:
            place.gap("", "the summary says another number", f"{said}, {held} are there")


@claim("the summary's figures")
def check_figures(evidence: Evidence) -> None:
    """The summary counts as many samples, epochs and late symbols as were recorded."""
    for end, topic, name, counted in _figures(evidence):
        said = evidence.summary(end).get(name)
        if evidence.is_whole(end) and said is not None and said != counted:
            place = evidence.at(end, topic, "all rows")
            place.gap("", f"the summary's {name} is another", f"{said} said, {counted} recorded")


def _figures(evidence: Evidence) -> list[tuple[str, str, str, int]]:
    """Return (end, topic, name in the summary, number recorded)."""
    found = []
    # Without the coder's bits the summary in the transmitter's folder is the receiver's.
    if "coder_bits_up" in evidence.summary("transmitter"):
        samples = evidence.topic("transmitter", "sample").rows
        checked = sum(bool(row.peer_digest) for row in samples)
        erased = sum(row.word is None for row in samples)
        rejoins = len(evidence.topic("transmitter", "epoch")) - 1
        found += [
            ("transmitter", "sample", "digest_checks", checked),
            ("transmitter", "sample", "erasures", erased),
            ("transmitter", "epoch", "rejoins", max(0, rejoins)),
        ]
    if evidence.agreement.link.carries_slots:
        # A serial line's receiver does not write down what came after its deadline.
        late = sum(not row.taken for row in evidence.topic("receiver", "symbol"))
        found.append(("receiver", "symbol", "symbols_late", late))
    return found

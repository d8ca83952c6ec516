"""The outcome of an audit as text."""

from __future__ import annotations

from typing import Any

from tenbaud.audit.audit import Audit


def audit_text(result: Audit) -> str:
    """Return the outcome of an audit: counts, findings, verdict."""
    lines = ["counted in the recordings", *(f"  {line}" for line in _counts(result))]
    lines.append("shown")
    lines += [f"  {line}" for line in _shown(result)]
    for heading, texts in (
        ("notes", result.notes),
        ("leaks", result.leaks),
        ("not shown by these recordings", result.gaps),
    ):
        if texts:
            lines += [heading, *(f"  {text}" for text in texts)]
    if result.passed:
        lines.append("passed: the flight used only the symbols it sent")
    elif result.leaks:
        lines.append(f"failed: {len(result.leaks)} finding(s)")
    else:
        lines.append("failed: nothing wrong was found, but not everything could be shown")
    return "\n".join(lines)


def _counts(result: Audit) -> list[str]:
    counted = result.counted
    terms = result.record.agreement.terms
    lines = []
    if counted.symbols_sent is not None:
        bits = counted.symbols_sent * counted.bits_per_symbol
        lines.append(f"symbols sent        {counted.symbols_sent} in {counted.slots or 0} slots")
        lines.append(f"coder bits up       {bits:g}")
        lines.append(f"symbols refused     {counted.symbols_refused}")
        lines.append(f"symbol bytes up     {counted.symbol_bytes}")
    for name, field in (("wire bytes up", "wire_bytes_up"), ("wire bytes down", "wire_bytes_down")):
        value = _said(result, field)
        lines.append(f"{name:19} {'not in a summary' if value is None else f'{value}, by the summary'}")
    if counted.baud is not None:
        lines.append(f"baud                {counted.baud:.3f} measured, {terms.rate_baud:g} paid for")
    if counted.symbols_taken is not None:
        lines.append(f"symbols received    {counted.symbols_taken}, {counted.symbols_late} too late")
    if counted.down_symbols is not None:
        lines.append(f"coder bits down     {counted.down_symbols}")
    lines.append(f"samples             {counted.samples}, of which {counted.erased} erased")
    if result.rejoin_bytes:
        lines.append(f"states down, bytes  {result.rejoin_bytes} at rejoins")
    return lines


def _shown(result: Audit) -> list[str]:
    return [
        f"{result.digests_compared} recorded states computed again from symbols and slots",
        f"{result.jittered_states} states reached with other arrival times within the deadlines",
    ]


def _said(result: Audit, name: str) -> Any:
    for summary in result.record.summaries.values():
        if summary.get(name) is not None:
            return summary[name]
    return None

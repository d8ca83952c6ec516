"""First contact with a rig: what its encoders say while somebody turns the axes by hand.

The device is opened without its output: not one command is sent, not even a zero.
"""

from __future__ import annotations

import math
import sys
import time
from dataclasses import dataclass, field, replace
from typing import Any

from rich.console import Console
from rich.table import Table

from tenbaud.build.first_contact import proposed
from tenbaud.build.rig import build_device, real_rig_name
from tenbaud.config.load import nested, toml_text
from tenbaud.config.schema import FlightConfig
from transmitter.rigs.axes import Axis
from transmitter.rigs.formats.samples import DeviceFlag, DeviceSample

SHOW_PERIOD_S = 0.1
RATE_SPAN_S = 0.05
"""A rate is taken over at least this time; over one sample it would be counts of noise."""


@dataclass(slots=True)
class AxisCheck:
    """The measurements of one axis."""

    name: str
    channel: int
    counts_first: int
    counts_last: int
    angle_rad: float
    angle_min_rad: float
    angle_max_rad: float
    rate_max_rad_per_s: float = 0.0
    moved: bool = False
    noise_counts: int | None = None
    """smallest span of the counts over `RATE_SPAN_S`: what is left of it at rest is noise"""


@dataclass(slots=True)
class RigCheck:
    """The measurements of the whole rig."""

    rig: str
    seconds: float
    samples: int = 0
    samples_per_s: float = 0.0
    longest_gap_ms: float = 0.0
    device_clock_ppm: float | None = None
    """how much faster than ours the device's clock runs"""
    flags: list[str] = field(default_factory=list)
    axes: list[AxisCheck] = field(default_factory=list)
    counts: dict[str, Any] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
    proposal: dict[str, Any] = field(default_factory=dict)
    """settings of a first flight, by their full names"""
    not_seen: list[str] = field(default_factory=list)
    """what these settings do not rest on"""


class _Watcher:
    """Follows the samples and keeps extremes."""

    def __init__(self, axes: tuple[Axis, ...], first: DeviceSample, angles: tuple[float, ...]) -> None:
        self.axes = [
            AxisCheck(axis.name, axis.channel, first.counts[axis.channel], 0, angle, angle, angle)
            for axis, angle in zip(axes, angles, strict=True)
        ]
        self.longest_gap_ns = 0
        self._before = first
        self._rate_from = (first, angles)
        self._spans = [(axis.counts_first, axis.counts_first) for axis in self.axes]

    def take(self, sample: DeviceSample, angles: tuple[float, ...]) -> None:
        self.longest_gap_ns = max(self.longest_gap_ns, sample.host_ns - self._before.host_ns)
        self._before = sample
        start, start_angles = self._rate_from
        span_s = (sample.host_ns - start.host_ns) / 1e9
        for index, (axis, angle) in enumerate(zip(self.axes, angles, strict=True)):
            axis.counts_last = sample.counts[axis.channel]
            axis.angle_rad = angle
            axis.angle_min_rad = min(axis.angle_min_rad, angle)
            axis.angle_max_rad = max(axis.angle_max_rad, angle)
            axis.moved |= axis.counts_last != axis.counts_first
            least, most = self._spans[index]
            span = self._spans[index] = min(least, axis.counts_last), max(most, axis.counts_last)
            if span_s >= RATE_SPAN_S:
                rate = abs(angle - start_angles[index]) / span_s
                axis.rate_max_rad_per_s = max(axis.rate_max_rad_per_s, rate)
                width = span[1] - span[0]
                axis.noise_counts = min(
                    width, width if axis.noise_counts is None else axis.noise_counts
                )
                self._spans[index] = (axis.counts_last, axis.counts_last)
        if span_s >= RATE_SPAN_S:
            self._rate_from = (sample, angles)


def check_rig(config: FlightConfig, seconds: float, live: bool) -> RigCheck:
    """Look at a rig for some seconds; RigError when it cannot be opened."""
    device = build_device(config, output=False)
    with device:
        first = device.latest
        assert first is not None
        watcher = _Watcher(device.axes, first, device.angles_rad(first))
        begun = time.monotonic()
        seen_before = device.timeline.counts["samples"]
        shown_at = 0.0
        last = first
        while (now := time.monotonic()) < begun + seconds:
            sample = device.wait_for_sample(0.1)
            if sample is not None:
                watcher.take(sample, device.angles_rad(sample))
                last = sample
            if live and now - shown_at > SHOW_PERIOD_S:
                shown_at = now
                _show_live(watcher)
        if live and sys.stderr.isatty():
            sys.stderr.write("\r\033[K")
        figures = device.figures()
        samples = device.timeline.counts["samples"] - seen_before
    watcher.longest_gap_ns = max(watcher.longest_gap_ns, time.monotonic_ns() - last.host_ns)
    result = RigCheck(
        real_rig_name(config.transmitter),
        seconds,
        samples,
        samples_per_s=samples / seconds,
        longest_gap_ms=watcher.longest_gap_ns / 1e6,
        device_clock_ppm=_clock_ppm(first, last),
        flags=[
            str(flag.name).lower() for flag in (*DeviceFlag, DeviceFlag.EMULATED) if flag in last.flags
        ],
        axes=watcher.axes,
        counts=figures,
    )
    settings, not_seen = proposed(config, result.axes)
    return replace(result, problems=_problems(result, config), proposal=settings, not_seen=not_seen)


def _clock_ppm(first: DeviceSample, last: DeviceSample) -> float | None:
    host_s = (last.host_ns - first.host_ns) / 1e9
    if last.device_us is None or first.device_us is None or host_s <= 1.0:
        return None
    return ((last.device_us - first.device_us) / 1e6 / host_s - 1.0) * 1e6


def _problems(result: RigCheck, config: FlightConfig) -> list[str]:
    stale_ms = config.transmitter.bridge.stale_s * 1e3
    found = []
    if result.longest_gap_ms > stale_ms:
        found.append(
            f"{result.longest_gap_ms:.0f} ms without a sample: in flight {stale_ms:g} ms "
            "(transmitter.bridge.stale_s) end it"
        )
    if result.samples_per_s < 2.0 / config.timing.tick_s:
        found.append(
            f"{result.samples_per_s:.0f} samples/s: at least two per tick of "
            f"{config.timing.tick_s * 1e3:g} ms keep the newest one fresh"
        )
    for name, what in (
        ("lost", "samples are missing in the sequence"),
        ("bad_frames", "frames were damaged"),
        ("misaligned", "units were out of alignment"),
        ("restarts", "times the device began anew"),
    ):
        if result.counts.get(name):
            found.append(f"{result.counts[name]} {what}")
    found += [
        f"the device reports {flag.replace('_', ' ')}"
        for flag in ("estop_open", "encoder_error")
        if flag in result.flags
    ]
    limit = config.transmitter.bridge.rate_max_rad_per_s
    found += [
        f"{axis.name} turned faster than {limit:g} rad/s: a jump in flight"
        for axis in result.axes
        if axis.rate_max_rad_per_s > limit
    ]
    return found


def _show_live(watcher: _Watcher) -> None:
    if sys.stderr.isatty():
        words = (
            f"{axis.name} {axis.counts_last:+6d} = {math.degrees(axis.angle_rad):+8.2f} deg"
            for axis in watcher.axes
        )
        sys.stderr.write("\r\033[K" + "   ".join(words))
        sys.stderr.flush()


def show_check(result: RigCheck) -> None:
    """Print a check as tables, and what to do about it."""
    console = Console()
    table = Table(
        title=f"{result.rig}: {result.seconds:g} s, its output never opened", title_justify="left"
    )
    table.add_column("axis (channel)")
    for heading in ("counts", "rad now", "least", "most", "rad/s", "noise", "moved"):
        table.add_column(heading, justify="right")
    for axis in result.axes:
        table.add_row(
            f"{axis.name} ({axis.channel})",
            str(axis.counts_last),
            f"{axis.angle_rad:+.4f}",
            f"{axis.angle_min_rad:+.3f}",
            f"{axis.angle_max_rad:+.3f}",
            f"{axis.rate_max_rad_per_s:.2f}",
            "" if axis.noise_counts is None else str(axis.noise_counts),
            "yes" if axis.moved else "no",
        )
    console.print(table)
    clock = (
        ""
        if result.device_clock_ppm is None
        else f", its clock {result.device_clock_ppm:+.0f} ppm off ours"
    )
    console.print(
        f"{result.samples_per_s:.1f} samples/s, longest gap {result.longest_gap_ms:.1f} ms{clock}; "
        f"flags: {', '.join(result.flags) or 'none'}",
        highlight=False,
    )
    pitch = [axis for axis in result.axes if axis.name == "pitch"]
    (axis,) = pitch or result.axes[:1]
    field = f"transmitter.bridge.{axis.name}"
    console.print(
        f"{'Nose up' if pitch else 'Its positive direction'} must make the {axis.name} grow; if it "
        f"falls, turn {field}.sign round. An axis that did not move has not been checked. For this "
        f"position to be 0: {field}.zero_counts = {axis.counts_last}",
        highlight=False,
    )
    console.print(
        "\nFor a first flight, in a file for --config (or with --write FILE):\n", highlight=False
    )
    console.print(toml_text(nested(result.proposal)), highlight=False, markup=False, soft_wrap=True)
    for line in result.not_seen:
        console.print(f"not seen: {line}", highlight=False)
    for problem in result.problems:
        console.print(f"problem: {problem}", highlight=False, style="bold")

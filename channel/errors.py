"""The errors of the channel, one tree.

TenbaudError
├── ConfigMismatch    the two ends are not set up alike: refused before the first symbol
├── DesyncError       the two copies of the codec disagree: sample and both digests
├── CodecDiverged     the estimate left every sensible range; the inputs no longer describe the plant
├── FrameError        bytes that are no frame: counted and dropped by the links
├── LinkError         a link cannot be opened or used as asked
│   └── LinkLost      the peer was absent, or went away (also a TimeoutError)
└── SafetyStop        the plant was taken to its safe voltage and stays there

A bad argument is a plain ValueError that names the value and the allowed range.
"""

from __future__ import annotations


class TenbaudError(Exception):
    """Root of the errors shown to a user; the text gives the cause and the next step."""


class ConfigMismatch(TenbaudError):
    """Both ends must share version, configuration and arithmetic before the first symbol."""


class DesyncError(TenbaudError):
    """The digests of one sample differ between the two ends."""


class CodecDiverged(TenbaudError):
    """A state of the codec is not finite or absurdly large."""


class FrameError(TenbaudError):
    """Malformed, truncated, oversized or foreign bytes."""


class LinkError(TenbaudError):
    """A link could not be opened, or was asked for something that it does not do."""


class LinkLost(LinkError, TimeoutError):
    """The peer did not answer in time, or its end was closed."""


class SafetyStop(TenbaudError):
    """The watchdog latched the safe voltage."""

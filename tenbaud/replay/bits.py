"""Whether two values are equal to the last bit."""

from __future__ import annotations

import marshal
from typing import Any

FORMAT = 2
"""of `marshal`: floats as their bytes, and nothing that depends on how the values are held"""


def is_same(one: Any, other: Any) -> bool:
    """Return whether two values are equal, of the same types and to the last bit; 0.0 is not -0.0.

    Values of a row or of a codec's state: numbers, texts, None, and tuples of them, named ones too.
    """
    if one is other:
        return True
    if one != other or type(one) is not type(other):
        return False
    if not isinstance(one, tuple | float):
        return True
    try:
        return marshal.dumps(one, FORMAT) == marshal.dumps(other, FORMAT)
    except ValueError:  # a named tuple, as a coder from outside may have its state
        return repr(one) == repr(other)

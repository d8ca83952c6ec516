"""Arrays whose owners are not counted, for compiled code that uses them at every tick."""

from __future__ import annotations

from typing import Any

from numba.core import cgutils as untyped_cgutils
from numba.extending import intrinsic
from numba.np import arrayobj as untyped_arrayobj

cgutils: Any = untyped_cgutils
arrayobj: Any = untyped_arrayobj


@intrinsic
def _bare(typing_context: Any, array: Any) -> Any:
    """Return the same array without a count of its owners; whoever called keeps it alive.

    numba counts an array's owners, atomically, at every use; in a flight that takes longer than the
    arithmetic.
    """

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        view = arrayobj.make_array(signature.args[0])(context, builder, arguments[0])
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        view.parent = cgutils.get_null_value(view.parent.type)
        return view._getvalue()

    return array(array), build


bare: Any = _bare

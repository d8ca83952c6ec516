"""Compiled functions that only other compiled ones call.

numba optimises each function and makes machine code of it before it is linked into its caller, where it
is optimised and translated again: in a flight, which is functions within functions, that is half of the
work. A part is only linked: it is optimised, and becomes machine code, within the function that Python
calls. The bits are the same, for neither step may change them.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any

TRIED = ("0.68.",)
"""Versions of numba that this was tried with: it uses what they do not document. With others a part is
compiled as any function; this takes longer, and no bit is another."""


@cache
def part_compiler() -> dict[str, Any]:
    """Return the options with which numba compiles a part, none for another version."""
    numba: Any = import_module("numba")
    if not numba.__version__.startswith(TRIED):
        return {}
    compiler: Any = import_module("numba.core.compiler")
    machinery: Any = import_module("numba.core.compiler_machinery")
    typed_passes: Any = import_module("numba.core.typed_passes")
    library = _library()

    @machinery.register_pass(mutates_CFG=False, analysis_only=False)
    class LinkOnly(machinery.FunctionPass):  # type: ignore[misc]
        _name = "tenbaud_link_only"

        def __init__(self) -> None:
            super().__init__()

        def run_pass(self, state: Any) -> bool:
            state.library = library(state.targetctx.codegen(), state.func_id.func_qualname)
            return False

    class PartCompiler(compiler.CompilerBase):  # type: ignore[misc]
        def define_pipelines(self) -> list[Any]:
            passes = compiler.DefaultPassBuilder.define_nopython_pipeline(self.state)
            passes.add_pass_after(LinkOnly, typed_passes.NopythonTypeInference)
            passes.finalize()
            return [passes]

    return {"pipeline_class": PartCompiler}


def _library() -> Any:
    codegen: Any = import_module("numba.core.codegen")

    class PartLibrary(codegen.JITCodeLibrary):  # type: ignore[misc]
        """What a part consists of before anything is optimised that is more than one function."""

        def finalize(self) -> None:
            for library in dict.fromkeys(self._linking_libraries):
                self._reload_init.update(library._reload_init)
                self._final_module.link_in(library._get_module_for_linking(), preserve=True)
            self._final_module.verify()
            self._finalize_dynamic_globals()
            self._verify_declare_only_symbols()
            self._finalized = True

        def get_pointer_to_function(self, name: str) -> int:
            """Return 0: Python calls no part."""
            self._ensure_finalized()
            return 0

        @property
        def codegen(self) -> Any:
            """Return what numba gives a function's environment to: a part has none in memory."""
            return _NoEnvironment

        def serialize_using_object_code(self) -> Any:
            return self.serialize_using_bitcode()

    return PartLibrary


class _NoEnvironment:
    @staticmethod
    def set_env(_name: str, _environment: Any) -> None:
        """Do nothing, as for all functions within one that was read from a file."""

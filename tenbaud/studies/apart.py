"""A compiler for loops over lanes: no two arrays that such a function is handed overlap."""

from __future__ import annotations

from typing import Any

from numba.core import compiler as untyped_compiler

compiler: Any = untyped_compiler


class ApartCompiler(compiler.Compiler):  # type: ignore[misc]
    """Tells LLVM what it would otherwise have to test before every loop, or give up."""

    def define_pipelines(self) -> Any:
        """Return the usual steps."""
        self.state.flags.noalias = True
        return super().define_pipelines()

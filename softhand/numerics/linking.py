"""Kernels that are compiled as parts of what calls them.

numba optimises every function on its own, together with all that it calls, and so the innermost ones again and again.
Here a kernel that is called by another is only translated; what Python calls is optimised, once, with all its parts.
That takes half the time. It rests on inner works of numba: where they have changed, or `SOFTHAND_LINKED=0` is set,
kernels are plain functions of numba, with the same results.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, ClassVar

import numba
from llvmlite import binding as llvm
from numba.core import compiler, config, sigutils, types, typing
from numba.core.codegen import JITCodeLibrary
from numba.core.errors import NumbaError
from numba.core.registry import CPUDispatcher

from softhand.numerics.kept import Keeper, kept_in


class _Flags(compiler.Flags):
    """Options of a compilation, as numba's; but numba compares them 160,000 times, and takes a quarter of its time."""

    __slots__ = ()
    _defaults: ClassVar = {name: option.default for name, option in compiler.Flags.options.items()}
    _hash: ClassVar = hash(compiler.Flags())

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return self is other or super().__eq__(other)

    def values(self) -> dict[str, Any]:
        """All, by their names."""
        return {**self._defaults, **self._values}


class _Part(JITCodeLibrary):
    """Code of a function which waits to become part of another's."""

    def finalize(self) -> None:
        """Neither optimise nor generate anything."""
        self._raise_if_finalized()
        self._finalize_dynamic_globals()
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        """The function and all that it calls; others that have the same parts may be linked with it."""
        if self._shared_module is None:
            module = self._final_module.clone()
            for library in dict.fromkeys(self._linking_libraries):
                module.link_in(library._get_module_for_linking(), preserve=True)
            for function in module.functions:
                if not function.is_declaration and function.linkage == llvm.Linkage.external:
                    function.linkage = "linkonce_odr"
            self._shared_module = module
        return self._shared_module


class _KeptPart:
    """How a part is kept on disk: as bitcode, from which what calls it is made."""

    @staticmethod
    def reduce(_: Any, result: Any) -> Any:
        """Data of a compile result."""
        result.fndesc.typemap = result.fndesc.calltypes = None
        bitcode = result.library._get_module_for_linking().as_bitcode()
        return result.library.name, bitcode, result.fndesc, result.environment, result.signature

    @staticmethod
    def rebuild(_: Any, target_context: Any, data: Any) -> Any:
        """A compile result without machine code."""
        name, bitcode, description, environment, signature = data
        library = _Part(target_context.codegen(), name)
        library._final_module = library._shared_module = llvm.parse_bitcode(bitcode)
        library._finalized = True
        return compiler.compile_result(
            typing_context=target_context.typing_context, target_context=target_context, library=library,
            environment=environment, fndesc=description, signature=signature,
        )  # fmt: skip


class _KeptWhole:
    """How what Python calls is kept: as machine code only, since it becomes no part of anything."""

    @staticmethod
    def reduce(_: Any, result: Any) -> Any:
        """Data of a compile result."""
        library, *rest = result._reduce()
        name, _, (code, _) = library
        module = result.library._final_module
        made = [one.name for group in (module.functions, module.global_variables) for one in group]
        return (name, code, made), *rest

    @staticmethod
    def rebuild(_: Any, target_context: Any, data: Any) -> Any:
        """The compile result."""
        (name, code, made), *rest = data
        codegen = target_context.codegen()
        library = codegen.create_library(name)
        library.enable_object_caching()
        library._set_compiled_object(code)
        library._finalize_final_module()
        codegen._engine._defined_symbols.update(made)
        description, environment, signature, *_, referenced = rest
        entry = target_context.get_executable(library, description, environment)
        for one in referenced:
            codegen.set_env(one.env_name, one)
        return compiler.compile_result(
            typing_context=target_context.typing_context, target_context=target_context, library=library,
            environment=environment, entry_point=entry, fndesc=description, signature=signature, objectmode=False,
            lifted=(), reload_init=(), referenced_envs=referenced,
        )  # fmt: skip


class Kernel(CPUDispatcher):
    """A function of numba that other kernels take in as a part."""

    _compiler: Any

    def __init__(self, *args: Any, **settings: Any) -> None:
        super().__init__(*args, **settings)
        self._parts: dict[Any, Any] = {}
        self._keeper: Any = None
        self._is_plain = False
        self._compiler._customize_flags = _Flags

    def keep_in(self, folder: Path) -> None:
        """Keep it on disk, whole and as a part."""
        self._cache = Keeper(self.py_func, folder, _KeptWhole)
        self._keeper = Keeper(self.py_func, folder, _KeptPart, "-part")

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Called by numba where another kernel calls this one."""
        if self._is_plain:
            return super().get_call_template(args, kws)
        pysig, folded = self._compiler.fold_argument_types(args, kws)
        folded = tuple(types.unliteral(kind) for kind in folded)  # one part for all constants
        try:
            result = self._part(folded)
        except NumbaError:
            raise
        except Exception:  # another numba
            self._is_plain = True
            return super().get_call_template(args, kws)
        name = self.py_func.__name__
        template = typing.make_concrete_template(f"CallTemplate({name})", key=name, signatures=[result.signature])
        return template, pysig, folded, {}

    def get_overload(self, sig: Any) -> Any:
        """What numba has to look up in order to call the part."""
        args, _ = sigutils.normalize_signature(sig)
        return (self, tuple(args)) if tuple(args) in self._parts else super().get_overload(sig)

    def _part(self, args: Any) -> Any:
        if args in self._parts:
            return self._parts[args]
        result = self._keeper.load_overload(args, self.targetctx) if self._keeper else None
        if result is None:
            with self._compiling_counter:
                result = self._translate(args)
            if self._keeper:
                self._keeper.save_overload(args, result)
        self.targetctx.insert_user_function((self, args), result.fndesc, [result.library])
        self._parts[args] = result
        return result

    def _translate(self, args: Any) -> Any:
        flags: Any = _Flags()
        self.targetdescr.options.parse_as_flags(flags, self.targetoptions)
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        context: Any = self.targetctx
        library = _Part(context.codegen(), self.py_func.__qualname__)
        library.enable_object_caching()
        return compiler.compile_extra(
            self.typingctx, context, self.py_func, args, None, flags, self.locals, library,
            self._compiler.pipeline_class,
        )  # fmt: skip


def kernel(function: Any, folder: Path, **options: Any) -> Any:
    """As `numba.njit` with these options, kept in a folder."""
    if os.environ.get("SOFTHAND_LINKED") == "0" or getattr(config, "DISABLE_JIT", False):
        with kept_in(folder):
            return numba.njit(cache=True, **options)(function)
    made = Kernel(function, targetoptions={"nopython": True, "boundscheck": None, **options})
    made.keep_in(folder)
    return made

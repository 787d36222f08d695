"""What Muslin uses of an engine that is not public; everything else in Muslin uses its public face.

Taichi and Quadrants keep some of it in different places, and a later version may move or drop it. So each part is in
`PARTS`, and whatever uses one does without where it is `lacking`: slower, or with a plainer message, but right.
"""

from __future__ import annotations

import functools
import importlib
import inspect
import math
import re
import sys
import textwrap
import traceback
from types import SimpleNamespace
from typing import Any

import numpy as np

from muslin.base.engine.choice import frame_info, load


def _in_both(*places: str) -> dict[str, tuple[str, ...]]:
    return {"taichi": places, "quadrants": places}


#: What a part is used for -> where either engine keeps it: a module below its own, and names in it.
PARTS: dict[str, dict[str, tuple[str, ...]]] = {
    "the running program": _in_both("lang.impl:get_runtime"),
    "the configuration": _in_both("lang.impl:current_cfg", "lang.impl:default_cfg"),
    "whether there is a device": _in_both("lang.misc:is_arch_supported"),
    "binding a kernel to its arrays": {
        "taichi": ("lang.kernel_impl:Kernel.ensure_compiled", "_lib:core.KernelLaunchContext"),
        "quadrants": ("lang.kernel:Kernel.ensure_compiled", "_lib:core.KernelLaunchContext"),
    },
    "knowing its own functions": {
        "taichi": ("math:clamp._is_taichi_function",),
        "quadrants": ("math:clamp._is_quadrants_function",),
    },
    "reading sources once": {
        "taichi": (
            "lang.kernel_impl:getsourcelines",
            "lang.kernel_impl:getsourcefile",
            "lang.kernel_impl:textwrap.fill",
        ),
        "quadrants": ("lang._func_base:get_source_info_and_src", "lang._func_base:textwrap.fill"),
    },
    "preparing the place of an error once": {
        "taichi": (
            "lang.ast.ast_transformer_utils:ASTTransformerContext.get_pos_info",
            "lang.ast.ast_transformer_utils:TextWrapper",
        ),
        "quadrants": (
            "lang.ast.ast_transformer_utils:ASTTransformerFuncContext.memoized_get_pos_info",
            "lang.ast.ast_transformer_utils:TextWrapper",
        ),
    },
    "seeing a frame fast": _in_both("lang.kernel_impl:inspect.getframeinfo"),
    "reading kernels once, not twice": {
        "taichi": (),
        "quadrants": ("lang.kernel:Kernel._try_load_fastcache",),
    },
    "telling a mistake once": {
        "taichi": (),
        "quadrants": (
            "lang.ast.ast_transformer_utils:traceback.format_exc",
            "lang.exception:QuadrantsCompilationError",
        ),
    },
    "naming what was called": {
        "taichi": (),
        "quadrants": (
            "lang.ast.ast_transformers.call_transformer:CallTransformer.build_Call",
            "lang.expr:Expr",
        ),
    },
    "seeing what a kernel enters": {
        "taichi": ("lang.kernel_impl:Func.__call__",),
        "quadrants": ("lang.func:Func.__call__",),
    },
    "nesting loops": _in_both(
        "lang.ast.ast_transformer:ASTTransformer.build_ndrange_for",
        "lang.ast.ast_transformer:ASTTransformer.build_range_for",
    ),
    "naming a bad index": {
        "taichi": (
            "lang.impl:subscript",
            "lang.impl:ti_assert",
            "lang.ops:logical_and",
            "lang.expr:Expr",
            "lang.field:Field",
            "_lib:core.DebugInfo",
        ),
        "quadrants": (
            "lang.impl:subscript",
            "lang.impl:qd_assert",
            "lang.ops:logical_and",
            "lang.expr:Expr",
            "lang.field:Field",
            "_lib:core.DebugInfo",
        ),
    },
}


def own_module(name: str) -> Any:
    """A module below the engine's own; None if there is none."""
    try:
        return importlib.import_module(f"{load().__name__}.{name}")
    except ImportError:
        return None


@functools.cache
def has(part: str) -> bool:
    """Whether the engine has all of a part."""
    places = (place.split(":") for place in PARTS[part][load().__name__])
    return all(
        functools.reduce(lambda found, name: getattr(found, name, None), names.split("."), own_module(module))
        is not None
        for module, names in places
    )


def lacking() -> list[str]:
    """Which of the `PARTS` this engine lacks."""
    return [part for part in PARTS if not has(part)]


# what runs --------------------------------------------------------------------------------------------------


@functools.cache
def _implementation() -> Any:
    return own_module("lang.impl")


def program() -> Any:
    """The program of the last `init`; None before there is one, or if that cannot be known."""
    if not has("the running program"):
        return None
    runtime = _implementation().get_runtime()
    return runtime._prog if hasattr(runtime, "_prog") else getattr(runtime, "prog", None)


def setting(name: str) -> Any:
    """A setting of the running program, or of one to come; None if it cannot be known."""
    if not has("the configuration"):
        return None
    impl = own_module("lang.impl")
    return getattr(impl.default_cfg() if program() is None else impl.current_cfg(), name, None)


def change(name: str, value: Any) -> None:
    """Change a setting of the running program, if it has it."""
    if has("the configuration") and hasattr(config := own_module("lang.impl").current_cfg(), name):
        setattr(config, name, value)


def runs_on(arch: str) -> bool:
    """Whether the engine has an architecture and there is a device for it."""
    ti = load()
    where = getattr(ti, arch, None)
    if where is None or not has("whether there is a device"):
        return False
    return bool(own_module("lang.misc").is_arch_supported(where))


def has_windows() -> bool:
    """Whether the engine can open a window (`ti.ui`)."""
    return hasattr(load(), "ui")


def is_function(function: Any) -> bool:
    """Whether something was decorated with `@ti.func`; with anything, if the engine does not mark its own."""
    mark = f"_is_{load().__name__}_function" if has("knowing its own functions") else "__wrapped__"
    return bool(getattr(function, mark, False))


# the compiler -----------------------------------------------------------------------------------------------


def compile_faster() -> None:
    """Spare the compiler work it does over and over; what it makes and says stays the same.

    Each time a function is called in a kernel, it reads the function's source again, and it prepares the text of an
    error for every expression it meets, wrapping the line that the expression is in. That is half of the time a
    kernel takes to compile. Called whenever the engine starts.
    """
    ti = load()
    utils = own_module("lang.ast.ast_transformer_utils")
    if utils is None or hasattr(utils, "muslin"):
        return
    utils.muslin = True
    places = has("preparing the place of an error once")
    if places:
        utils.TextWrapper = _Wrapper
    if places and ti.__name__ == "taichi":
        _keep_places(utils.ASTTransformerContext)
    if has("reading sources once"):
        reader = own_module("lang.kernel_impl" if ti.__name__ == "taichi" else "lang._func_base")
        for name in ("getsourcelines", "getsourcefile", "get_source_info_and_src"):
            if hasattr(reader, name):
                setattr(reader, name, functools.cache(getattr(reader, name)))
        reader.textwrap = SimpleNamespace(fill=functools.cache(textwrap.fill), dedent=textwrap.dedent)
    if has("seeing a frame fast"):
        seen = vars(inspect) | {"getframeinfo": frame_info}
        own_module("lang.kernel_impl").inspect = SimpleNamespace(**seen)
    if ti.__name__ == "quadrants" and has("reading kernels once, not twice"):
        _read_once(own_module("lang.kernel").Kernel)


class _Wrapper(textwrap.TextWrapper):
    """Wraps lines that need no wrapping in no time."""

    def wrap(self, text: str) -> list[str]:
        """As the library does."""
        if len(text) > self.width or not text.isprintable():
            return super().wrap(text)
        return [text.rstrip()] if not text.isspace() and text else []


def _keep_places(context: Any) -> None:
    """Have Taichi remember the text about a place in a source; Quadrants does so by itself."""
    position = context.get_pos_info
    positions: dict[Any, str] = {}

    def get_pos_info(self: Any, node: Any) -> str:
        if node.lineno != node.end_lineno:
            return str(position(self, node))
        line = self.src[node.lineno - 1]
        where = (self.file, self.func.func.__name__, node.lineno + self.lineno_offset, self.indent)
        key = (*where, node.col_offset, node.end_col_offset, line)
        if key not in positions:
            positions[key] = position(self, node)
        return positions[key]

    context.get_pos_info = get_pos_info


def _read_once(kernel: Any) -> None:
    """Have Quadrants go through a kernel's source once.

    It does so twice, the first time to learn which fields of data classes are used; no kernel of Muslin takes any.
    """
    original = kernel._try_load_fastcache

    def _try_load_fastcache(self: Any, args: tuple[Any, ...], key: Any) -> set[str] | None:
        found: set[str] | None = original(self, args, key)
        plain = all(isinstance(value, (np.ndarray, int, float, np.generic)) for value in args)
        if found is None and plain and self.fast_checksum is None:
            self.used_py_dataclass_parameters_by_key_enforcing[key] = found = set()
        return found

    kernel._try_load_fastcache = _try_load_fastcache


# what goes wrong in a student's function --------------------------------------------------------------------

#: How an index that was found out of range while a kernel runs is told.
OUT_OF_RANGE = "not an index of"


#: Where Quadrants says other words than Taichi for the same mistake.
_OTHER_WORDS = (
    (
        r"'QuadrantsCallable' object has no attribute '(\w+)'\. Did you mean: '\w+'",
        r"'function' object has no attribute '\1'",
    ),
    (r"'QuadrantsCallable' object", "'function' object"),
    (
        r"TypeError when calling `Expr`: 'Quadrants Expression' object is not callable\.*",
        "'Expr' object has no attribute '__name__'",
    ),
    (r"`qd\.", "`ti."),
    (r"<qd\.Expr>", "<ti.Expr>"),
    (r"(?<![\w/\\-])quadrants(?![\w/\\-])", "taichi"),
    (r"(?<![\w/\\-])Quadrants(?![\w/\\-])", "Taichi"),
    (r"\s*\n\.(?=\s|$)", "."),
)

_TRACE, _YOURS = "quadrants stack trace:\n===\n", "\n===\n\nYour code:\n"


def said(text: str) -> str:
    """What an engine says is wrong with a student's function, as Taichi says it: students write `ti`."""
    if load().__name__ == "taichi":
        return text
    while (begin := text.rfind(_TRACE)) >= 0 and (end := text.find(_YOURS, begin)) >= 0:
        text = text[:begin] + text[end + len(_YOURS) :]
    for theirs, ours in _OTHER_WORDS:
        text = re.sub(theirs, ours, text)
    return text


def tell_plainly() -> None:
    """Have Quadrants tell a mistake in a function once; called whenever the engine starts.

    It puts its own stack trace, with all that was said so far, before every function that the mistake is passed
    through, so that what it says doubles each time: a function that calls itself would never be heard of. And
    where a call fails it trips over names of its own.
    """
    if load().__name__ == "quadrants" and has("telling a mistake once"):
        wrong = own_module("lang.exception").QuadrantsCompilationError

        def format_exc() -> str:
            return "" if isinstance(sys.exc_info()[1], wrong) else traceback.format_exc()

        own_module("lang.ast.ast_transformer_utils").traceback = SimpleNamespace(format_exc=format_exc)
    if load().__name__ == "quadrants" and has("naming what was called"):
        transformer = own_module("lang.ast.ast_transformers.call_transformer")
        missing = {"args": (object.__new__(own_module("lang.expr").Expr),), "math": math, "np": np}
        for name, value in missing.items():
            if not hasattr(transformer, name):
                setattr(transformer, name, value)


def refuse_bad_indices(debug: bool = False) -> None:
    """Make the engine name an index that is out of range.

    Its compiler does not look: it reads a neighbour, or aborts the whole process. Constant indices are checked
    while a function compiles; with `debug` the others are checked while it runs, and kept inside the range so
    that it lives to tell. Called whenever the engine starts.
    """
    if not has("naming a bad index"):
        return
    core, impl, ops = load()._lib.core, own_module("lang.impl"), own_module("lang.ops")
    claim = impl.ti_assert if hasattr(impl, "ti_assert") else impl.qd_assert
    original = getattr(impl.subscript, "original", impl.subscript)

    @functools.wraps(original)
    def subscript(builder: Any, value: Any, *indices: Any, **options: Any) -> Any:
        shape, what = _extent(value)
        kept = list(indices)
        for k, (index, size) in enumerate(zip(indices, shape, strict=False)):
            if isinstance(index, int):
                if not 0 <= index < size:
                    raise IndexError(f"{index} is not an index of {what}: they run from 0 to {size - 1}")
            elif debug and isinstance(index, own_module("lang.expr").Expr) and not index.is_tensor():
                inside = ops.logical_and(index >= 0, index < size)
                message = f"%d is {OUT_OF_RANGE} {what}"
                place = core.DebugInfo(impl.get_runtime().get_current_src_info())
                claim(inside, message, [index.ptr], place)
                kept[k] = ops.max(ops.min(index, size - 1), 0)
        return original(builder, value, *kept, **options)

    subscript.original = original  # type: ignore[attr-defined]
    impl.subscript = subscript


def _extent(value: Any) -> tuple[tuple[int, ...], str]:
    """Shape of what is indexed, where it is known, and its name."""
    if isinstance(value, own_module("lang.expr").Expr) and value.is_tensor():
        shape = tuple(value.get_shape())
        return shape, f"a vector of {shape[0]}" if len(shape) == 1 else f"a {shape[0]}x{shape[1]} matrix"
    if isinstance(value, own_module("lang.field").Field) and value.snode is not None:
        shape = tuple(value.shape)
        return shape, f"a field of {'x'.join(map(str, shape))}"
    return (), ""

"""The compiled kernels as Python calls them, loaded from the disk cache where they are there already."""

from __future__ import annotations

import hashlib
import sys
import tempfile
import types
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np
from llvmlite.binding import parse_assembly, parse_bitcode
from numba import njit
from numba.core.caching import CompileResultCacheImpl, IndexDataCacheFile, _CacheLocator

from linid.installed_kernels import installed_folder
from linid.kernel_cache import SharedCache, announce_compilation, cache_folder, locked
from linid.physics.laws.registry import LUGRE
from linid.physics.model import Model
from linid.simulation import (
    along,
    along_slopes,
    currents,
    kernel,
    kernel_by_voltage,
    lockstep,
    lockstep_slopes,
    slopes,
    told_forces,
)
from linid.simulation.bundle import Bundle
from linid.simulation.terms import terms_of


class Kernel(NamedTuple):
    """Compiled entry points; arguments as in the functions of the same name, without the terms."""

    simulate_tasks: Callable[..., int]
    along_tasks: Callable[..., None]
    reading_tasks: Callable[..., None]
    current_tasks: Callable[..., None]


class _Place(_CacheLocator):  # type: ignore[misc]
    """A folder of numba's cache that goes by a key instead of a source file."""

    def __init__(self, folder: Path, key: str) -> None:
        self._folder, self._key = str(folder), key
        self._py_file = __file__  # named in numba's warnings

    def get_cache_path(self) -> str:
        return self._folder

    def get_source_stamp(self) -> str:
        return self._key

    def get_disambiguator(self) -> str:
        return self._key


class _KernelCacheImpl(CompileResultCacheImpl):  # type: ignore[misc]
    def __init__(self, function: Any, place: _Place) -> None:
        self._lineno = function.__code__.co_firstlineno
        self._locator = place
        self._filename_base = self.get_filename_base(function.__name__, getattr(sys, "abiflags", ""))

    def reduce(self, data: Any) -> Any:
        """What is kept: machine code, and the names in it.

        numba keeps intermediate code beside it, for callers that are compiled with it; a kernel has none, and it would
        be two thirds of what is kept, and half of the time to load it.
        """
        (name, kind, (machine_code, bitcode)), *rest = super().reduce(data)
        defined = [function.name for function in parse_bitcode(bitcode).functions if not function.is_declaration]
        names = parse_assembly("\n".join(f'define void @"{one}"() {{ ret void }}' for one in defined))
        return (name, kind, (machine_code, names.as_bitcode())), *rest


class _KeyedCache(SharedCache):
    """numba's disk cache under a key of our own: closures over functions are not found again otherwise."""

    def __init__(self, function: Any, folder: Path, key: str) -> None:
        place = _Place(folder, key)
        self._name = repr(function)
        self._py_func = function
        self._impl = _KernelCacheImpl(function, place)
        self._cache_path = place.get_cache_path()
        self._cache_file = IndexDataCacheFile(self._cache_path, self._impl.filename_base, place.get_source_stamp())
        self._key = key
        self.enable()

    @property
    def begun(self) -> bool:
        """Whether anything is kept under this key."""
        return Path(self._cache_file._index_path).exists()

    def _index_key(self, signature: Any, codegen: Any) -> Any:
        return signature, codegen.magic_tuple(), self._key


class KernelCache(_KeyedCache):
    """Kernels kept on disk, after those in the folder `installed`, which are taken as they are.

    While one process compiles a kernel, others that need it wait; they may compile other ones.
    """

    def __init__(self, function: Any, folder: Path, key: str, installed: Path | None = None) -> None:
        super().__init__(function, folder, key)
        self._installed = None if installed is None else _KeyedCache(function, installed, key)
        self._lock_file = folder / f"{function.__name__}-{key}.lock"
        self._lock: Any = None  # held while this process compiles

    @property
    def begun(self) -> bool:
        """Whether anything is kept under this key, or came with the installation."""
        return super().begun or (self._installed is not None and self._installed.begun)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What is there for these types, or None, once it is said that it will be compiled."""
        found = None if self._installed is None else self._installed.load_overload(sig, target_context)
        found = found or super().load_overload(sig, target_context)
        if found is None:
            announce_compilation()
            self.release()
            self._lock = locked(self._lock_file)
            found = super().load_overload(sig, target_context)  # of whom this one has waited for
            if found is not None:
                self.release()
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled for these types, for those too that wait for it."""
        try:
            super().save_overload(sig, data)
        finally:
            self.release()

    def release(self) -> None:
        """Let others compile, if this process was about to."""
        if self._lock is not None:
            self._lock.release()
            self._lock = None


def fingerprint(*functions: Any) -> str:
    """A hash of compiled functions and of all that they call: of what they do, not of docstrings, comments or lines."""
    digest = hashlib.sha256(f"{numba.__version__} {sys.version_info[:2]}".encode())
    seen: set[int] = set()
    for function in functions:
        for piece in _pieces(function, seen):
            digest.update(piece.encode())
    return digest.hexdigest()[:16]


def _pieces(value: Any, seen: set[int]) -> Iterator[str]:
    """What decides the machine code of a value that a compiled function uses."""
    function = getattr(value, "py_func", value)
    if isinstance(value, Bundle):
        for name, member in value:
            yield name
            yield from _pieces(member, seen)
    elif isinstance(value, tuple):
        yield f"{type(value).__name__}({len(value)})"
        for item in value:
            yield from _pieces(item, seen)
    elif isinstance(function, types.FunctionType):
        yield f"{function.__module__}.{function.__qualname__}"
        if id(function) in seen:
            return
        seen.add(id(function))
        yield repr(sorted(getattr(value, "targetoptions", {}).items()))
        yield from _code(function.__code__, function.__doc__)
        for name in sorted(_names(function.__code__)):
            if name in function.__globals__:
                yield name
                yield from _pieces(function.__globals__[name], seen)
        for cell in function.__closure__ or ():
            yield from _pieces(cell.cell_contents, seen)
    elif isinstance(value, types.ModuleType):
        yield value.__name__
    elif isinstance(value, np.ndarray):
        yield f"{value.dtype} {value.shape} {value.tobytes().hex()}"
    elif isinstance(value, type):
        yield f"{value.__qualname__} {getattr(value, '_fields', ())}"
    elif hasattr(value, "_defn"):  # an intrinsic: what it writes is in its own code
        yield from _pieces(value._defn, seen)
    else:
        yield repr(value)


def _code(code: types.CodeType, docstring: str | None) -> Iterator[str]:
    yield f"{code.co_code.hex()} {code.co_names} {code.co_varnames} {code.co_freevars}"
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _code(constant, None)
        elif constant is None or constant != docstring:
            yield repr(constant)


def _names(code: types.CodeType) -> set[str]:
    """Global names that a function and the functions in it use."""
    names = set(code.co_names)
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            names |= _names(constant)
    return names


def entry_of(function: Any) -> Any:
    """A function of closures compiled for Python to call: that of the installation, else kept in `kernel_folder`."""
    compiled: Any = njit(error_model="numpy", nogil=True)(function)
    installed = installed_folder(compiled.targetctx.codegen())
    cache = KernelCache(function, kernel_folder(), fingerprint(function), installed)
    compile_it = compiled.compile

    def compile_and_release(signature: Any) -> Any:
        try:
            return compile_it(signature)
        finally:
            cache.release()  # also after Ctrl-C: nobody is to wait for what does not come

    compiled._cache, compiled.compile = cache, compile_and_release
    return compiled


def load_kernel(model: Model | None = None, by_voltage: bool = False, bare: bool = False, law: str = LUGRE) -> Kernel:
    """The compiled kernel: guarded for all effects (None) or specialised for one model.

    by_voltage: the inputs are phase voltages and the currents are states; bare: all motors, but no effects; law: of
    friction, whose steps are compiled in.
    """
    return _loaded(model, by_voltage, bare, law)


@cache  # under all arguments: where some are left out it would keep another copy
def _loaded(model: Model | None, by_voltage: bool, bare: bool, law: str) -> Kernel:
    terms = terms_of(model, bare, law)
    simulate = kernel_by_voltage.simulate_tasks_with if by_voltage else kernel.simulate_tasks_with
    entries = (simulate, along.along_tasks_with, kernel.reading_tasks_with, currents.current_tasks_with)
    return Kernel(*(entry_of(entry(terms)) for entry in entries))


@cache
def load_slopes() -> Callable[..., None]:
    """The compiled simulation with derivatives (slopes.py), all motors and effects under LuGre friction."""
    entry: Callable[..., None] = entry_of(slopes.slope_tasks_with(terms_of(None, False, LUGRE)))
    return entry


@cache
def load_lockstep_slopes() -> Callable[..., None]:
    """The compiled simulation of many at once with derivatives (lockstep_slopes.py), models as in `load_lockstep`."""
    entry: Callable[..., None] = entry_of(lockstep_slopes.lockstep_slope_tasks_with(terms_of(None, True, LUGRE)))
    return entry


@cache
def load_along_slopes() -> Callable[..., None]:
    """The compiled derivatives along a measured motion (along_slopes.py), all motors and effects, LuGre friction."""
    entry: Callable[..., None] = entry_of(along_slopes.along_slope_tasks_with(terms_of(None, False, LUGRE)))
    return entry


@cache
def load_lockstep() -> Callable[..., int]:
    """The compiled simulation of many at once (lockstep.py), of all motors under LuGre friction without effects."""
    entry: Callable[..., int] = entry_of(lockstep.lockstep_tasks_with(terms_of(None, True, LUGRE)))
    return entry


@cache
def load_told() -> Callable[..., None]:
    """The compiled forces that are told beforehand (told_forces.py), of all motors and effects."""
    entry: Callable[..., None] = entry_of(told_forces.told_tasks_with(terms_of(None, False, LUGRE)))
    return entry


@cache
def kernel_folder() -> Path:
    """The folder that kernels are kept in: `cache_folder`, or one of this process alone where that is not writable."""
    folder = cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return Path(tempfile.mkdtemp(prefix="linid-kernel-"))
    return folder

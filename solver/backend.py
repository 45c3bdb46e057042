"""The only import of Taichi's runtime and the only ``ti.init`` of the project.

Fields and arrays may be touched only by the thread that called :func:`init`; a second ``ti.init`` would wipe them,
so :func:`init` is idempotent and refuses another thread.

Taichi keeps compiled kernels in a folder for the next program, but writes them at its normal end only: a program that
is killed in its first minute would compile again for ever. So :func:`keep_compiled` has them written at once.
"""

import ast
import contextlib
import inspect
import io
import linecache
import os
import select
import shutil
import signal
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Callable
from multiprocessing.util import Finalize
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
# Taichi would ask its makers once a day whether there is a newer one, and tell them system, Python and a number that
# stands for this user.
os.environ.setdefault("TI_SKIP_VERSION_CHECK", "ON")
# Where `sys.stdout` has been replaced, as in a notebook or a test, each launch would fetch what its kernel may have
# printed: a third of the time of short launches. None here prints.
os.environ.setdefault("TI_ENABLE_PYBUF", "0")

import taichi as ti
from taichi.lang import impl, kernel_impl, snode
from taichi.lang.ast import checkers
from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext

from solver.arch import chosen
from solver.machine import available_cores
from solver.params import ParameterError

LANES_ON_CPU = 512
"""Taichi gives a CPU thread at least this many iterations of a loop in a row."""
WORTH_KEEPING = 0.25
"""Seconds of compilation after which kernels are written. The big kernel takes 3 s and more to compile, all others
together 0.5 s, and to read all of them back takes 0.07 s; Taichi tells no other difference between the two."""
LONGEST_WRITE = 10.0
"""Seconds that writing may take (0.1 is usual)."""
STALE_LOCK = 60.0
"""Age [s] of a lock in the folder of kernels at which whoever made it is gone: it is held for a moment only."""


def _place(context: ASTTransformerContext, node: ast.expr | ast.stmt) -> str:
    """File and line of a kernel's statement, for Taichi's messages.

    Taichi's own text also has a mark under every part of the line. It is written for each part of a kernel, though only
    an error shows it, and took half the time from a kernel's source to its compiler: 1 s at every start.
    """
    line, name = node.lineno, context.func.func.__name__
    return f'File "{context.file}", line {line + context.lineno_offset}, in {name}:\n{context.src[line - 1]}\n'


def _read_once(read: Callable[[FunctionType], Any]) -> Callable[[FunctionType], Any]:
    """``read``, once for all functions that are made of the same code."""
    known: dict[tuple[int, int], tuple[CodeType, CodeType, Any]] = {}

    def kept(function: FunctionType) -> Any:
        # Python takes two codes for equal that differ in their annotations, and Taichi obeys these. `read` looks
        # behind a wrapper, whose own code many functions share.
        code, behind = function.__code__, inspect.unwrap(function).__code__
        key = id(code), id(behind)
        if key not in known:
            known[key] = code, behind, read(function)  # as long as they are kept, no other code has these numbers
        return known[key][2]

    return kept


ASTTransformerContext.get_pos_info = _place
# Taichi asks for a function's source wherever a kernel calls it, and Python then looks whether its file has changed and
# where the function ends.
kernel_impl.getsourcefile = checkers.getsourcefile = _read_once(kernel_impl.getsourcefile)
kernel_impl.getsourcelines = checkers.getsourcelines = _read_once(kernel_impl.getsourcelines)


def _inside_class(level_of_class_stackframe: int) -> bool:
    """Whether a function is decorated in the body of a class: Taichi reads the line at which its frame is called.

    Taichi's own looks for that line's module among all that are loaded: 0.4 s at every start.
    """
    try:
        frame = sys._getframe(level_of_class_stackframe)
    except ValueError:  # decorated by the script itself, which nothing calls
        return False
    line = linecache.getline(frame.f_code.co_filename, frame.f_lineno).strip()
    return any(statement.match(line) for statement in kernel_impl._KERNEL_CLASS_STACKFRAME_STMT_RES)


kernel_impl._inside_class = _inside_class
# Where each field was declared is for messages on fields that are placed wrongly; ours are all made in one place. To
# write it down took 0.2 s at every start.
impl.get_traceback = snode.get_traceback = lambda stacklevel=1: ""

_owner: int | None = None
_written = 0.0
"""What Taichi had spent on compilation [s] when kernels were last written."""


def init(threads: int | None = None) -> None:
    """Start Taichi once on the chosen processor: double precision, no fast math, ``threads`` CPU threads.

    Raises ParameterError for a processor that this machine lacks and RuntimeError when another thread owns Taichi.
    """
    global _owner
    current = threading.get_ident()
    if _owner is not None:
        if _owner != current:
            raise RuntimeError("Taichi belongs to the thread that called solver.backend.init first")
        return
    arch = getattr(ti, chosen())
    if threads is None and (allowed := available_cores()) < (os.cpu_count() or 1):
        threads = allowed  # Taichi counts the cores of the machine
    options = {} if threads is None else {"cpu_max_num_threads": threads}
    ti.set_logging_level(ti.ERROR)
    _ensure_kernel_folder()
    _drop_stale_lock()
    # ti.init prints a banner that no option silences; it would stand in front of JSON on standard output.
    with contextlib.redirect_stdout(io.StringIO()):
        ti.init(
            arch=arch,
            default_fp=ti.f64,
            default_ip=ti.i32,
            fast_math=False,
            # Leaving the data flow to LLVM makes the large kernel compile four times as fast and run no slower.
            cfg_optimization=False,
            log_level=ti.ERROR,
            **options,
        )
    if impl.current_cfg().arch != arch:
        raise ParameterError(f"--arch {chosen()}: Taichi finds no such device on this machine")
    _owner = current


def trial() -> None:
    """Start Taichi on the chosen processor and let it calculate in double precision.

    Raises what :func:`init` does, and RuntimeError for a wrong sum: a device that has single precision only may round
    instead of refusing.
    """
    init()

    @ti.kernel  # type: ignore[untyped-decorator]
    def thirds(n: ti.i32) -> ti.f64:
        total = ti.cast(0.0, ti.f64)
        for k in range(n):
            total += k / 3.0
        return total

    n = 3000
    if abs(thirds(n) - n * (n - 1) / 6.0) > 1e-6:
        raise RuntimeError(f"{chosen()} calculates in less than double precision")


def serial() -> bool:
    """Whether loops run on the calling thread: with one CPU thread, each handing over to Taichi's own costs 0.1 ms."""
    config = impl.current_cfg()
    return bool(config.arch == ti.cpu and config.cpu_max_num_threads == 1)


def lanes() -> int:
    """Loop iterations per world (see ``kernels/batch.py``): one on a GPU, whose threads take one each."""
    return LANES_ON_CPU if impl.current_cfg().arch == ti.cpu else 1


def kernel_folder() -> Path:
    """Where Taichi keeps compiled kernels."""
    return Path(os.environ.get("TI_OFFLINE_CACHE_FILE_PATH") or impl.default_cfg().offline_cache_file_path)


def keep_compiled(least: float = WORTH_KEEPING) -> bool:
    """Have the kernels written that were compiled since the last time, if that took ``least`` seconds or more.

    Taichi writes them in ``Program.finalize`` only, after which a program is over. So a copy of this process does it
    and ends, while this one waits and goes on. Nothing is done where a copy would not be safe: beside other threads of
    Python or with several of Taichi (they are not copied, and what they had locked stays locked), on a GPU and on
    Windows.

    Returns:
        Whether all kernels that took long to compile are written.
    """
    global _written
    program = impl.get_runtime().prog
    spent = program.get_total_compilation_time()
    if spent - _written < least:
        return True
    if not (serial() and impl.current_cfg().offline_cache and hasattr(os, "fork") and threading.active_count() == 1):
        return False
    # Also where it fails, or a full disk would be asked again after every launch; a normal end writes once more.
    _written = spent
    return _done_by_a_copy(program.finalize)


def _done_by_a_copy(work: Callable[[], object]) -> bool:
    """Let a copy of this process do ``work`` and end at once; True if it has within ``LONGEST_WRITE``."""
    reading, writing = os.pipe()
    with warnings.catch_warnings():
        # Python 3.12 counts the idle threads of Taichi's compiler, which the copy has no use for.
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            copy = os.fork()
        except OSError:  # no memory or no room for one more process: keeping kernels is not worth a pour
            os.close(reading)
            os.close(writing)
            return False
    if copy == 0:
        failed = 1
        try:
            work()
            failed = 0
        finally:
            # Not by SystemExit: buffers, handlers and children of the original are none of the copy's business.
            os._exit(failed)
    os.close(writing)
    ended = False
    try:
        # The copy alone holds the other end, which closes when it ends, however it does.
        ended = bool(select.select([reading], [], [], LONGEST_WRITE)[0])
    finally:
        os.close(reading)
        if not ended:
            os.kill(copy, signal.SIGKILL)
        _, status = os.waitpid(copy, 0)
    return ended and status == 0


def _ensure_kernel_folder() -> None:
    """Give Taichi a folder for the time of this process where it could not write into its own.

    It writes there when it ends, even with ``offline_cache`` off, and a folder that takes nothing is a segmentation
    fault then, after all work is done.
    """
    folder = kernel_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return
    except OSError:
        own = tempfile.mkdtemp(prefix="explorer-kernels-")
    os.environ["TI_OFFLINE_CACHE_FILE_PATH"] = own
    # Also in a process of a pool, where `atexit` does nothing.
    Finalize(None, _give_up_kernel_folder, (own,), exitpriority=0)


def _give_up_kernel_folder(folder: str) -> None:
    ti.reset()
    shutil.rmtree(folder, ignore_errors=True)


def _drop_stale_lock() -> None:
    """Remove the lock of a process that was killed while it read or wrote the list of kernels.

    Taichi waits for such a lock a quarter of a second and then neither reads nor writes: every start would compile.
    """
    lock = kernel_folder() / "ticache.lock"
    with contextlib.suppress(OSError):
        if time.time() - lock.stat().st_mtime > STALE_LOCK:
            lock.unlink()

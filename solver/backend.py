"""The only import of Taichi's runtime and the only ``ti.init`` of the project.

Fields and arrays may be touched only by the thread that called :func:`init`; a second ``ti.init`` would wipe them,
so :func:`init` is idempotent and refuses another thread.
"""

import contextlib
import io
import os
import threading

os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")

import taichi as ti
from taichi.lang import impl

from solver.arch import chosen
from solver.params import ParameterError

LANES_ON_CPU = 512
"""Taichi gives a CPU thread at least this many iterations of a loop in a row."""

_owner: int | None = None


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
    options = {} if threads is None else {"cpu_max_num_threads": threads}
    ti.set_logging_level(ti.ERROR)
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
        raise ParameterError(f"--arch {chosen()}: this machine has no such device that Taichi can use")
    _owner = current


def serial() -> bool:
    """Whether loops run on the calling thread: with one CPU thread, each handing over to Taichi's own costs 0.1 ms."""
    config = impl.current_cfg()
    return bool(config.arch == ti.cpu and config.cpu_max_num_threads == 1)


def lanes() -> int:
    """Loop iterations per world (see ``kernels/batch.py``): one on a GPU, whose threads take one each."""
    return LANES_ON_CPU if impl.current_cfg().arch == ti.cpu else 1

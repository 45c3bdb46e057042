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

ARCHITECTURES = {"cpu": ti.cpu, "cuda": ti.cuda}

_owner: int | None = None


def init(threads: int | None = None, arch: str = "cpu") -> None:
    """Start Taichi once: double precision, no fast math (results repeat bit by bit), ``threads`` CPU threads.

    Raises ValueError for an unknown ``arch`` and RuntimeError when another thread already owns Taichi.
    """
    global _owner
    if arch not in ARCHITECTURES:
        raise ValueError(f"arch: {arch!r} is not one of {', '.join(ARCHITECTURES)}")
    current = threading.get_ident()
    if _owner is not None:
        if _owner != current:
            raise RuntimeError("Taichi belongs to the thread that called solver.backend.init first")
        return
    options = {} if threads is None else {"cpu_max_num_threads": threads}
    ti.set_logging_level(ti.ERROR)
    # ti.init prints a banner that no option silences; it would stand in front of JSON on standard output.
    with contextlib.redirect_stdout(io.StringIO()):
        ti.init(
            arch=ARCHITECTURES[arch],
            default_fp=ti.f64,
            default_ip=ti.i32,
            fast_math=False,
            # Leaving the data flow to LLVM makes the large kernel compile four times as fast and run 5–10 % slower.
            cfg_optimization=False,
            log_level=ti.ERROR,
            **options,
        )
    _owner = current

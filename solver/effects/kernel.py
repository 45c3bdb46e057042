"""Functions for kernels in modules that are imported without Taichi.

Scenes, sliders and files need an effect's parameters; only the solver's process has Taichi. ``ti`` here imports Taichi
when an attribute of it is first used, and ``kernel_function`` applies ``ti.func`` at the first call, which a kernel
makes. Arguments are passed by value: a function returns what it changes.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any


class _Taichi:
    def __getattr__(self, name: str) -> Any:
        from solver.backend import ti as taichi

        return getattr(taichi, name)


ti: Any = _Taichi()


class KernelFunction:
    """A function that kernels may call."""

    # Taichi reads these attributes of a callable before it compiles a call to it.
    _is_taichi_function = True
    _is_real_function = False

    def __init__(self, body: Callable[..., Any]) -> None:
        self.body = body
        self.__doc__, self.__name__ = body.__doc__, body.__name__

    @cached_property
    def compiled(self) -> Callable[..., Any]:
        """The function as ``ti.func`` makes it."""
        return ti.func(self.body)

    @property
    def func(self) -> Any:
        """Taichi's own object for the function, which Taichi reads after a call."""
        return self.compiled.func  # type: ignore[attr-defined]

    def __call__(self, *args: Any) -> Any:
        """Compile the call into the kernel that makes it."""
        return self.compiled(*args)


kernel_function = KernelFunction

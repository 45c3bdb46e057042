"""Things that exist in several kinds, and what installed packages add to them.

A package adds a thing by an entry point in its ``pyproject.toml``, whose name is the kind, a dot and the thing's name:

    [project.entry-points."repose_explorer.plugins"]
    "effect.magnetism" = "my_package.magnetism:Magnetism"

Kinds are ``contact_law``, ``design``, ``effect``, ``export``, ``observable``, ``panel``, ``rig`` and ``stage``; each
has one protocol and one :class:`Registry`, which everything else lists from (``docs/plugins.md``). A plug-in is loaded
when its kind is first asked for, so that a file which defines one may import the protocol that it follows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property, lru_cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Generic, TypeVar

GROUP = "repose_explorer.plugins"
KINDS = ("contact_law", "design", "effect", "export", "observable", "panel", "rig", "stage")
T = TypeVar("T")


class PluginError(ValueError):
    """An installed plug-in cannot be used; the message is one line that names it and its package."""


class Registry(Mapping[str, T], Generic[T]):
    """The things of one kind by name: those of this program in their order, then those of installed packages.

    Parameters
    ----------
    kind:
        First part of the name of an entry point.
    own:
        The things of this program; each has an attribute ``name``.
    fits:
        Whether what an entry point names is one of the kind.
    """

    def __init__(self, kind: str, own: Iterable[T], fits: Callable[[Any], bool]) -> None:
        self.kind = kind
        self._own, self._fits = tuple(own), fits

    @cached_property
    def things(self) -> dict[str, T]:
        """All of them by name. Raises PluginError for a plug-in that is not one, or whose name is taken."""
        found = {name_of(thing): thing for thing in self._own}
        for name, entry in plugged_in(self.kind).items():
            if name in found:
                raise PluginError(f"{described(entry)}: the name {name!r} is taken; choose another")
            found[name] = self._loaded(name, entry)
        return found

    def _loaded(self, name: str, entry: EntryPoint) -> T:
        try:
            thing: T = entry.load()
        except Exception as error:  # a package that breaks while it is imported raises anything
            why = next(iter(str(error).splitlines()), "") or type(error).__name__
            raise PluginError(f"{described(entry)}: cannot be loaded: {why}") from error
        if not self._fits(thing):
            raise PluginError(f"{described(entry)}: {entry.value} is not of the kind {self.kind.replace('_', ' ')}")
        if getattr(thing, "name", None) != name:
            raise PluginError(f"{described(entry)}: its name is {getattr(thing, 'name', None)!r}, not {name!r}")
        return thing

    def __getitem__(self, name: str) -> T:
        return self.things[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.things)

    def __len__(self) -> int:
        return len(self.things)

    def __repr__(self) -> str:
        return f"<{self.kind}: {', '.join(self)}>"


def name_of(thing: Any) -> str:
    """The name that files, the command line and the page use."""
    return str(thing.name)


def derived_from(base: type) -> Callable[[Any], bool]:
    """Whether something is a class with ``base`` among its bases, which may be a protocol."""
    return lambda thing: isinstance(thing, type) and base in thing.__mro__[1:]


def instance_of(base: type) -> Callable[[Any], bool]:
    """Whether something is an object of ``base``, which may be a protocol."""
    return lambda thing: base in type(thing).__mro__


def plugged_in(kind: str) -> dict[str, EntryPoint]:
    """Entry points of installed packages for ``kind`` by the name of the thing; none of them is loaded."""
    return {name: entry for (of, _, name), entry in _installed().items() if of == kind}


@lru_cache
def _installed() -> dict[tuple[str, str, str], EntryPoint]:
    """Every entry point of the group by its name in three parts, read once: it takes 10 ms.

    Raises PluginError for a kind that there is not, and for a thing of two packages.
    """
    found: dict[tuple[str, str, str], EntryPoint] = {}
    for entry in sorted(entry_points(group=GROUP), key=lambda one: one.name):
        parts = entry.name.partition(".")
        if parts[0] not in KINDS:
            raise PluginError(f"{described(entry)}: {parts[0]!r} is not a kind of plug-in; allowed: {', '.join(KINDS)}")
        if parts in found:
            raise PluginError(
                f"{described(entry)}: {_package(found[parts])} adds one of that name too; remove one of the two"
            )
        found[parts] = entry
    return found


def origin(kind: str, name: str) -> str:
    """Package and version that a thing comes from; empty for one of this program."""
    entry = plugged_in(kind).get(name)
    return "" if entry is None else _package(entry)


def described(entry: EntryPoint) -> str:
    """An entry point as a message names it."""
    return f"plug-in {entry.name} of {_package(entry)}"


def _package(entry: EntryPoint) -> str:
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist is not None else "an unknown package"

"""Where the shipped data files are, in a checkout and in an installed wheel alike."""

from pathlib import Path
from typing import Literal, get_args

AssetKind = Literal[
    "materials",
    "studies",
    "benchmarks",
    "scenes",
    "presets",
    "meshes",
    "source_tables",
    "laboratory",
    "designs",
    "runs",
    "photographs",
    "validation",
]

_SUFFIX: dict[AssetKind, str] = {
    "materials": ".toml",
    "studies": ".toml",
    "benchmarks": ".toml",
    "scenes": ".toml",
    "presets": ".toml",
    "meshes": ".stl",
    "source_tables": ".csv",
    "laboratory": ".csv",
    "designs": ".toml",
    "runs": ".csv",
    "photographs": ".jpg",
    "validation": ".npz",
}


_SINGULAR: dict[AssetKind, str] = {
    "materials": "material",
    "studies": "study",
    "benchmarks": "benchmark",
    "scenes": "prepared scene",
    "presets": "preset",
    "meshes": "mesh",
    "source_tables": "source table",
    "laboratory": "laboratory file",
    "designs": "factors file",
    "runs": "sheet of runs",
    "photographs": "photograph",
    "validation": "file of reference pours",
}

_FOLDER = {"runs": "designs"}
"""Kinds whose folder is that of another one: a filled sheet lies beside its factors."""


class AssetNotFoundError(ValueError):
    """A name that is neither a shipped asset nor a file."""


def asset_path(kind: AssetKind, name: str, *, relative_to: Path | None = None) -> Path:
    """Path of a shipped asset or of a user's own file.

    Args:
        kind: folder of the asset, one of `AssetKind`.
        name: a shipped name, with or without its suffix ("sunflower_extract"), or the path of a file. A file
            that exists under exactly this path wins over a shipped asset.
        relative_to: folder from which a relative path is looked up, such as the folder of the study file that
            names a material; the working directory if None.

    Raises:
        AssetNotFoundError: neither exists; the message lists the shipped names.
        ValueError: unknown kind.
    """
    if kind not in _SUFFIX:
        raise ValueError(f"asset kind {kind!r} is unknown; allowed: {', '.join(get_args(AssetKind))}")
    own = (relative_to or Path()) / own_path(name)
    if own.is_file():
        return own
    shipped = shipped_assets(kind)
    if stem := _shipped_stem(name, _SUFFIX[kind], shipped):
        return _folder(kind) / f"{stem}{_SUFFIX[kind]}"
    raise AssetNotFoundError(
        f"{_SINGULAR[kind]} {name!r} is neither a file (looked for {own.absolute()}) nor shipped; "
        f"shipped: {', '.join(shipped) or 'none'}"
    )


def own_path(name: str) -> Path:
    """The path that a person named, ``~`` being their folder; ``~somebody`` who is not there stays what it is."""
    try:
        return Path(name).expanduser()
    except RuntimeError:
        return Path(name)


def measurement_folder(name: str) -> Path:
    """Folder of a measured data set: the user's own by its path, or a shipped one by its name.

    Raises AssetNotFoundError where neither exists; the message lists the shipped names.
    """
    own = own_path(name)
    if own.is_dir():
        return own
    shipped = shipped_measurements()
    if name in shipped:
        return _folder("measurements") / name
    raise AssetNotFoundError(
        f"measurement {name!r} is neither a folder (looked for {own.absolute()}) nor shipped; "
        f"shipped: {', '.join(shipped) or 'none'}"
    )


def photograph_scales() -> Path:
    """File with what tells lengths on every shipped photograph."""
    return _folder("photographs") / "scales.toml"


def shipped_fits() -> Path:
    """Folder of the member spheres of shipped bodies (`solver.shapes.clump`)."""
    return _folder("clumps")


def shipped_measurements() -> tuple[str, ...]:
    """Names of the shipped measured data sets, sorted."""
    return tuple(sorted(path.parent.name for path in _folder("measurements").glob("*/measurement.toml")))


def shipped_assets(kind: AssetKind) -> tuple[str, ...]:
    """Names of the shipped assets of one kind, without suffix, sorted."""
    return tuple(sorted(path.stem for path in _folder(kind).glob(f"*{_SUFFIX[kind]}")))


def _shipped_stem(name: str, suffix: str, shipped: tuple[str, ...]) -> str | None:
    """The shipped name that `name` means, with or without its suffix."""
    stem = name.removesuffix(suffix)
    return stem if stem in shipped else None


def _folder(kind: str) -> Path:
    """Folder of one kind: inside this package in a wheel, in the repository's root in a checkout."""
    packaged = Path(__file__).with_suffix("")
    root = packaged if packaged.is_dir() else Path(__file__).parents[1] / "assets"
    return root / _FOLDER.get(kind, kind)

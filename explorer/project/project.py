"""A project as a folder: ``project.toml`` names its study and its measured data; results lie beside it.

format = 1
title = "Lentils, lot 7"
study = "lentil_study.toml"     # relative to this file; it names the material
measured = "measured"           # folder with measurement.toml, for the diagnosis; may be left out

Photographs that serve as its target are kept in the folder ``target``.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from explorer.errors import CommandError
from explorer.files.output_file import write_whole
from explorer.photograph.target import FOLDER
from explorer.scene.file import study_path
from explorer.scene.presets import data_folder
from explorer.scene.source import SceneSource, material_source, study_source
from explorer.scene.starter_files import STUDY_ENDING, study_scene, study_text, write_study
from solver import ParameterError
from solver.toml_file import TomlTable, checked, naming_file, read_toml

FILE = "project.toml"
FORMAT = 1
RESULTS, REPORT = "results", "report.html"


class ProjectFile(TomlTable):
    """Content of ``project.toml``."""

    format: int
    """Of the file: 1."""
    title: str = ""
    """What the page calls the project; without one, the folder's name."""
    study: str
    """Study file, relative to this file; it names the material."""
    measured: str = ""
    """Folder of measured data (``measurement.toml``), relative to this file."""


@dataclass(frozen=True)
class Project:
    """What the page works on."""

    title: str
    study: Path
    """The study file, which names the material."""
    source: SceneSource
    """The first scene to pour."""
    results: Path
    """Folder in which studies and diagnoses leave their results."""
    measured: Path | None = None
    """Folder of measured data for the diagnosis."""
    folder: Path | None = None
    """Folder of ``project.toml``; None for a material or a study without one."""

    @property
    def studies(self) -> Path:
        """Folder for the output folders of the project's studies."""
        return self.results / "studies"

    @property
    def diagnoses(self) -> Path:
        """Folder for the output folders of the project's diagnoses."""
        return self.results / "diagnoses"

    @property
    def target(self) -> Path:
        """Folder of the photographs that are its measured target, if there are any (`explorer.photograph.target`).

        Studies of the same name in different places share the folder of results, but not the target.
        """
        place = hashlib.sha256(str(self.study.absolute()).encode()).hexdigest()[:8]
        return (self.folder or self.results / "targets" / f"{self.study.stem}-{place}") / FOLDER

    @property
    def laboratory(self) -> Path:
        """Folder for the laboratory's reports, each in a folder of its own."""
        return self.results / "laboratory"

    @property
    def reports(self) -> tuple[Path, ...]:
        """Folders of this project that hold a report, newest first."""
        places = [self.results.glob(f"*/*/{REPORT}")]
        if self.folder is not None:  # reports that commands left beside the results
            places += [self.folder.glob(f"{deep}{REPORT}") for deep in ("*/", "*/*/")]
        found = {file.parent.resolve(): file.stat().st_mtime for place in places for file in place}
        return tuple(sorted(found, key=lambda folder: found[folder], reverse=True))


def new_project(folder: Path, material: str | None = None) -> list[Path]:
    """Write a project into the new ``folder``: a starter material (or ``material``, by path or shipped name) and study.

    Returns the files written, ``project.toml`` last. Raises CommandError if the folder already holds a project.
    """
    file = folder / FILE
    if file.exists():
        raise CommandError(f"{file}: exists already; choose another folder")
    written = write_study(folder, folder.name, material)
    lines = (
        f"format = {FORMAT}",
        f'title = "{folder.name}"',
        f'study = "{written[-1].name}"',
        '# measured = "measured"   # folder with measurement.toml, for the diagnosis',
    )
    write_whole(file, "\n".join(lines) + "\n")
    return [*written, file]


def load_project(folder: Path) -> Project:
    """The project in ``folder``. Raises a ValueError with one line that names file and key."""
    file = folder / FILE
    with naming_file(file, ParameterError):
        table = checked(ProjectFile, read_toml(file))
        if table.format != FORMAT:
            raise ParameterError(f"format: {table.format!r} is not {FORMAT}")
        for key, name in (("study", table.study), ("measured", table.measured)):
            if name and not (folder / name).exists():
                raise ParameterError(f"{key}: {folder / name} does not exist")
    study = folder / table.study
    return Project(
        title=table.title or folder.absolute().name,
        study=study,
        source=study_source(study),
        results=folder / RESULTS,
        measured=folder / table.measured if table.measured else None,
        folder=folder,
    )


def study_project(study: str) -> Project:
    """A project for a study alone, by its path or shipped name; results go into the user's data folder."""
    file = study_path(study)
    return Project(_words(file.stem.removesuffix(STUDY_ENDING)), file, study_source(file), data_folder())


def material_project(material: str) -> Project:
    """A project for a material alone, by its path or shipped name.

    Its study is ``<material>_study.toml`` beside it, if there is one. Otherwise a study with an example target is
    written into the user's data folder, each time again, because its factors are read off the material.
    """
    source = material_source(material)
    own = Path(source.material)
    beside = own.with_name(f"{own.stem}{STUDY_ENDING}.toml")
    if own.is_file() and beside.is_file():
        study = beside
    else:
        study = data_folder() / "starter_studies" / f"{own.stem}{STUDY_ENDING}.toml"
        study.parent.mkdir(parents=True, exist_ok=True)
        named = str(own.absolute()) if own.is_file() else source.material
        write_whole(study, study_text(study, named, study_scene(named)))
    return Project(_words(own.stem), study, source, data_folder())


def _words(name: str) -> str:
    return name.replace("_", " ").strip().capitalize()

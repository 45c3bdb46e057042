"""``explorer serve``: the live page."""

from __future__ import annotations

from pathlib import Path

import typer

from explorer.commands.shared_options import HOST, PORT, SET, STORE, TOKEN


def serve(
    project: Path | None = typer.Argument(
        None, metavar="[PROJECT]", help="Project folder, as made by `explorer new project`."
    ),
    port: int = PORT,
    host: str = HOST,
    token: str | None = TOKEN,
    study: str | None = typer.Option(
        None,
        metavar="STUDY",
        help="Study for the page's calibration: file or shipped name; by default sunflower_extract.",
    ),
    material: str | None = typer.Option(
        None, metavar="MATERIAL", help="Material to pour and calibrate: file or shipped name."
    ),
    set_: list[str] = SET,
    seed: int | None = typer.Option(None, min=0, help="Seed of the first pour; by default 1."),
    store: Path | None = STORE,
    record: Path | None = typer.Option(
        None,
        metavar="FILE.rrd",
        help="New recording of the session: the first pour in FILE.rrd, the k-th in FILE_k.rrd; listed on exit.",
    ),
    rerun: str | None = typer.Option(
        None, metavar="URL", help="Send the session to a running rerun viewer; `rerun` prints its URL."
    ),
    scheduler: str = typer.Option(
        "", metavar="tcp://…", help="Run studies, diagnoses and further pours on the workers of this Dask scheduler."
    ),
    replay: Path | None = typer.Option(
        None, metavar="FILE.rrd", help="Play this recording on the page instead of pouring."
    ),
) -> None:
    """Open the live page: watch a pour, change its parameters, calibrate and diagnose; or play a recording."""
    from explorer.errors import CommandError
    from explorer.project.project import load_project, material_project, study_project
    from explorer.scene.file import DEFAULT_STUDY, with_settings
    from explorer.viewer.app import replay as replay_page
    from explorer.viewer.app import serve as serve_page
    from solver import check_scheduler

    check_scheduler(scheduler)
    if replay and (project or study or material or set_ or record or rerun or scheduler or store or seed is not None):
        raise CommandError(
            f"--replay {replay}: a recording has its own material and parameters; leave out the other options"
        )
    if replay:
        replay_page(replay, host=host, port=port, token=token)
        return
    if study and material:
        raise CommandError(f"--material {material}: the study {study} has a material of its own; name one of the two")
    if project and (study or material):
        raise CommandError(f"{project}: a project names its own study and material; leave out --study and --material")
    if project:
        opened = load_project(project)
    elif material:
        opened = material_project(material)
    else:
        opened = study_project(study or DEFAULT_STUDY)
    scene = with_settings(opened.source.scene, set_)
    serve_page(
        opened,
        scene,
        host=host,
        port=port,
        seed=1 if seed is None else seed,
        store=store,
        record_path=record,
        rerun_viewer=rerun or "",
        token=token,
        scheduler=scheduler,
    )

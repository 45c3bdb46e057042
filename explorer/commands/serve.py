"""``explorer serve``: the live page."""

from __future__ import annotations

from pathlib import Path

import typer

HOST = typer.Option("127.0.0.1", help="Address to listen on; one that others can reach needs a token.")
TOKEN = typer.Option(
    None,
    envvar="EXPLORER_TOKEN",
    help="What a browser has to show, 16 characters or more. On the command line other users of this machine can "
    "read it: better in the environment.",
)
"""Of every command that opens a page."""


def serve(
    project: Path | None = typer.Argument(None, help="Folder of a project, as `explorer new project` makes it."),
    port: int = typer.Option(8080, min=0, max=65535, help="Port of the page; 0 takes a free one."),
    host: str = HOST,
    token: str | None = TOKEN,
    study: str | None = typer.Option(None, help="Study for the page's calibration: file or shipped name."),
    material: str | None = typer.Option(None, help="Material to pour and calibrate: file or shipped name."),
    set_: list[str] = typer.Option([], "--set", metavar="PATH=VALUE", help="Set a parameter; may be repeated."),
    seed: int | None = typer.Option(None, min=0, help="Seed of the first pour; 1 if not given."),
    store: Path | None = typer.Option(None, help="SQLite file that keeps the runs of the page's calibration."),
    record: Path | None = typer.Option(
        None,
        metavar="FILE.rrd",
        help="Record the session: the first pour here, the k-th in FILE_k.rrd. Ctrl-C names them.",
    ),
    rerun: str | None = typer.Option(
        None, metavar="URL", help="Send the session to a running rerun viewer: `rerun` tells its URL."
    ),
    scheduler: str = typer.Option(
        "", metavar="tcp://…", help="Studies, diagnoses and further pours on the workers of this Dask scheduler."
    ),
    replay: Path | None = typer.Option(None, metavar="FILE.rrd", help="Play a recording on the page instead."),
) -> None:
    """Open the page: watch a pour, turn its parameters, calibrate; or play a recording."""
    from explorer.errors import CommandError
    from explorer.project.project import load_project, material_project, study_project
    from explorer.scene.file import DEFAULT_STUDY, with_settings
    from explorer.viewer.app import replay as replay_page
    from explorer.viewer.app import serve as serve_page
    from solver import check_scheduler

    check_scheduler(scheduler)
    if replay and (project or study or material or set_ or record or rerun or scheduler or store or seed is not None):
        raise CommandError(f"--replay {replay}: a recording has its own material and parameters; leave the others out")
    if replay:
        replay_page(replay, host=host, port=port, token=token)
        return
    if study and material:
        raise CommandError(f"--material {material}: the study {study} has a material of its own; name one of the two")
    if project and (study or material):
        raise CommandError(f"{project}: a project names its study and material itself; leave --study, --material out")
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

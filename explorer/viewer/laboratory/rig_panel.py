"""Bench tests of one body on the solver, with the parameters on the screen: what comes out beside what is put in."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import viser

from explorer.errors import CommandError
from explorer.laboratory.solver_answers import rig_answer
from explorer.session import Session
from explorer.viewer.actions import Post
from explorer.viewer.background_work import BackgroundWork
from explorer.viewer.laboratory.answer_view import AnswerView
from explorer.viewer.pour.restart_panel import entered, parameter_input
from solver.params import Parameter
from solver.rigs import BENCH_RIGS
from solver.scene import Scene, parameters, with_rig

WAITING = "Puts one body, with the parameters of the pour on the screen, to a test. Choose rig and body, then: Run."


class RigPanel:
    """Rig, its parameters, answer; ``folder`` keeps the material as it was."""

    def __init__(
        self, server: viser.ViserServer, session: Session, folder: Path, post: Post, background: BackgroundWork
    ) -> None:
        self._session, self._folder, self._background, self._gui = session, folder, background, server.gui
        self._declared: dict[str, Parameter] = {}
        self._inputs: dict[str, Any] = {}
        with server.gui.add_folder("Bench test on the solver", expand_by_default=False):
            self._rig = server.gui.add_dropdown(
                "Rig",
                tuple(BENCH_RIGS),
                hint="Rigs that bodies are poured into are chosen under Pour, Rig and material.",
            )
            self._place = server.gui.add_folder(None)
            self._offer(session.status().scene)
            run = server.gui.add_button(
                "Run", hint="On the material of the rig's wall; up to a minute, in the background."
            )
            self.view = AnswerView(server, WAITING, post, charts=True)
        run.on_click(lambda _: post(self._run))

        @self._rig.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                post(lambda: self._offer(session.status().scene))

    def show(self) -> None:
        """Offer the bodies of what is being poured; call it inside ``server.atomic()``."""
        scene = self._session.status().scene
        if self._declared["rig.body"].choices != tuple(body.name for body in scene.bodies):
            self._offer(scene)

    def _offer(self, scene: Scene) -> None:
        """Boxes and lists for the parameters of the chosen rig, in place of those of the one before."""
        for one in self._inputs.values():
            one.remove()
        bench = with_rig(scene, self._chosen())
        self._declared = {path: one for path, one in parameters(bench).items() if path.startswith("rig.")}
        with self._place:
            self._inputs = {path: parameter_input(self._gui, one, bench) for path, one in self._declared.items()}

    def _chosen(self) -> str:
        rig = str(self._rig.value)
        if rig not in BENCH_RIGS:
            raise CommandError(f"rig {rig[:60]!r}: allowed are {', '.join(BENCH_RIGS)}")
        return rig

    def _run(self) -> None:
        rig, folder, status = self._chosen(), self._folder, self._session.status()
        values = {path: entered(one, self._inputs[path].value) for path, one in self._declared.items()}
        self._background.start(
            f"running {rig} on the solver",
            lambda: rig_answer(status.scene, rig, values, status.seed, folder),
            self.view.show,
        )

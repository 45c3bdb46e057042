"""Bench tests of one body on the solver, with the parameters on the screen: results beside inputs."""

from __future__ import annotations

from typing import Any

import viser

from explorer.errors import CommandError
from explorer.laboratory.command_results import rig_result
from explorer.viewer.laboratory.answer_view import AnswerView
from explorer.viewer.panel import LABORATORY, Now, PageContext, Panel
from explorer.viewer.pour.restart_panel import entered, parameter_input
from solver.params import Parameter
from solver.rigs import BENCH_RIGS
from solver.scenes.scene import Scene, parameters, with_rig

WAITING = "Puts one body, with the parameters of the pour on the screen, to a test. Choose rig and body, then: Run."


class RigPanel(Panel):
    """Rig, its parameters, answer; the material is kept as it was."""

    name, tab, title = "rig", LABORATORY, "Bench test on the solver"

    def __init__(self, page: PageContext) -> None:
        server, gui, folder, post = page.server, page.server.gui, page.uploads, page.post
        self._session, self._folder, self._background, self._gui = page.session, folder, page.bench_work, gui
        self._declared: dict[str, Parameter] = {}
        self._inputs: dict[str, Any] = {}
        self._rig = gui.add_dropdown(
            "Rig",
            tuple(BENCH_RIGS),
            hint="Rigs that bodies are poured into are chosen in Set-up, under Rig and material.",
        )
        self._place = gui.add_folder(None)
        self._offer(page.session.status().scene)
        run = gui.add_button("Run", hint="On the material of the rig's wall; up to a minute, in the background.")
        self.view = AnswerView(server, WAITING, post, charts=True)
        run.on_click(lambda _: post(self._run))

        @self._rig.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                post(lambda: self._offer(page.session.status().scene))

    def show(self, now: Now) -> None:
        """Offer the bodies of the present pour."""
        scene = now.status.scene
        if self._declared["rig.body"].choices != tuple(body.name for body in scene.bodies):
            self._offer(scene)

    def set_dark(self, dark: bool) -> None:
        """Draw the charts for a dark or a light page."""
        self.view.set_dark(dark)

    def _offer(self, scene: Scene) -> None:
        """Boxes and lists for the parameters of the chosen rig, in place of those of the previous rig."""
        for one in self._inputs.values():
            one.remove()
        bench = with_rig(scene, self._chosen())
        self._declared = {path: one for path, one in parameters(bench).items() if path.startswith("rig.")}
        with self._place:
            self._inputs = {path: parameter_input(self._gui, one, bench) for path, one in self._declared.items()}

    def _chosen(self) -> str:
        rig = str(self._rig.value)
        if rig not in BENCH_RIGS:
            raise CommandError(f"rig {rig[:60]!r}; allowed: {', '.join(BENCH_RIGS)}")
        return rig

    def _run(self) -> None:
        rig, folder, status = self._chosen(), self._folder, self._session.status()
        values = {path: entered(one, self._inputs[path].value) for path, one in self._declared.items()}
        self._background.start(
            f"running {rig} on the solver",
            lambda: rig_result(status.scene, rig, values, status.seed, folder),
            self.view.show,
        )

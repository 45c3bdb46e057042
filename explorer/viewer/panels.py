"""The panels of the page in order: this program's first, then those of installed packages."""

from __future__ import annotations

from explorer.viewer.laboratory.analysis_panel import AnalysisPanel
from explorer.viewer.laboratory.audit_panel import AuditPanel
from explorer.viewer.laboratory.bench_panel import BenchPanel
from explorer.viewer.laboratory.design_panel import DesignPanel
from explorer.viewer.laboratory.laboratory_panel import LaboratoryPanel
from explorer.viewer.laboratory.measured_data_panel import MeasuredDataPanel
from explorer.viewer.laboratory.photograph_panel import PhotographPanel
from explorer.viewer.laboratory.rig_panel import RigPanel
from explorer.viewer.look.look_panel import LookPanel
from explorer.viewer.output.engine_export import EngineExport
from explorer.viewer.output.output_panel import OutputPanel
from explorer.viewer.output.recording_panel import RecordingPanel
from explorer.viewer.panel import Panel
from explorer.viewer.pour.changes_panel import ChangesPanel
from explorer.viewer.pour.chart import Chart
from explorer.viewer.pour.controls_panel import ControlsPanel
from explorer.viewer.pour.disturb_panel import DisturbPanel
from explorer.viewer.pour.grain_panel import GrainPanel
from explorer.viewer.pour.import_panel import ImportPanel
from explorer.viewer.pour.live_panel import LivePanel
from explorer.viewer.pour.motion_chart import MotionChart
from explorer.viewer.pour.outline_panel import OutlinePanel
from explorer.viewer.pour.population_panel import PopulationPanel
from explorer.viewer.pour.readings_panel import ReadingsPanel
from explorer.viewer.pour.readout import Readout
from explorer.viewer.pour.restart_panel import RestartPanel
from explorer.viewer.pour.scene_panel import ScenePanel
from explorer.viewer.pour.second_pile import SecondPile
from explorer.viewer.pour.standing_panel import StandingPanel
from explorer.viewer.shell.pour_link import PourLink
from explorer.viewer.shell.state_line import StateLine
from explorer.viewer.shell.timeline import Timeline
from explorer.viewer.study.diagnosis_panel import DiagnosisPanel
from explorer.viewer.study.reports_panel import ReportsPanel
from explorer.viewer.study.study_panel import StudyPanel
from solver.plugins import Registry, derived_from

PANELS: Registry[type[Panel]] = Registry(
    "panel",
    (
        StateLine,
        Timeline,
        PourLink,
        Readout,
        PopulationPanel,
        StandingPanel,
        ControlsPanel,
        ReadingsPanel,
        Chart,
        MotionChart,
        OutlinePanel,
        LivePanel,
        DisturbPanel,
        ChangesPanel,
        ScenePanel,
        GrainPanel,
        ImportPanel,
        RestartPanel,
        SecondPile,
        LookPanel,
        OutputPanel,
        EngineExport,
        RecordingPanel,
        StudyPanel,
        DiagnosisPanel,
        LaboratoryPanel,
        BenchPanel,
        RigPanel,
        PhotographPanel,
        MeasuredDataPanel,
        DesignPanel,
        AnalysisPanel,
        AuditPanel,
        ReportsPanel,
    ),
    derived_from(Panel),
)

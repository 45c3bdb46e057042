"""The recording that is shown while the solver loads is that of the pour that begins."""

import numpy as np
import pytest

from explorer.live.preview import Preview, load_preview, preview_path, save_preview
from explorer.project.project import study_project
from explorer.scene.file import DEFAULT_STUDY
from solver.scenes.scene import body_counts, with_values

SCENE = study_project(DEFAULT_STUDY).source.scene


def test_what_serve_begins_with_is_shipped_and_is_this_very_pour():
    """After a change of physics or of the shipped study: `make preview`."""
    preview = load_preview(SCENE, 1)
    assert preview is not None
    assert tuple(np.bincount(preview.component)) == body_counts(SCENE)
    first, last = preview.frame(0.0, 1), preview.frame(99.0, 1)
    assert first.inside.sum() < last.inside.sum() == len(preview.component)
    # Every body lies on the plate or in the funnel at the end, and none of them below the plate.
    assert 0.0 < last.position[:, 2].min() < last.position[:, 2].max() < 0.2
    np.testing.assert_allclose(np.linalg.norm(last.quaternion, axis=1), 1.0, atol=2e-3)


def test_another_seed_or_parameter_has_no_recording():
    assert load_preview(SCENE, 2) is None
    assert load_preview(with_values(SCENE, {"pair.seed.seed.static_friction": 0.56}), 1) is None


def test_frames_are_those_of_their_time_and_come_back_from_the_file(tmp_path):
    rng = np.random.default_rng(1)
    quaternion = rng.normal(size=(3, 2, 4))
    quaternion /= np.linalg.norm(quaternion, axis=2, keepdims=True)
    preview = Preview(
        np.array([0.0, 0.1, 0.2]),
        np.array([0, 1], np.int32),
        np.array([[True, False], [True, True], [True, True]]),
        rng.uniform(-0.1, 0.1, (3, 2, 3)).astype(np.float32),
        quaternion.astype(np.float32),
        np.ones(2, np.float32),
    )
    assert [preview.frame(t, 4).number for t in (0.0, 0.099, 0.1, 5.0)] == [-1, -1, -2, -3]
    assert preview.frame(0.0, 4).generation == 4
    path = save_preview(preview, SCENE, 7, tmp_path)
    assert path == preview_path(SCENE, 7, tmp_path)
    back = load_preview(SCENE, 7, tmp_path)
    assert back is not None
    # Half precision: 2^-11 of a number.
    assert back.position == pytest.approx(preview.position, rel=2.0**-11, abs=1e-7)
    np.testing.assert_array_equal(back.inside, preview.inside)

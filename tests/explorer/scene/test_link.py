"""The text of a pour in an address: it leads back to the very scene, and to no file of the machine."""

from urllib.parse import parse_qs

import pytest

from explorer.errors import CommandError
from explorer.scene.link import LONGEST, pour_text, read_pour
from explorer.scene.source import SceneSource, material_source, prepared_source, rig_source, study_source
from explorer.scene.starter_files import write_study
from solver.assets import asset_path
from solver.scenes.scene import with_rig, with_values

BEGUN = study_source(asset_path("studies", "sunflower_extract"))
FRICTION = "pair.seed.seed.static_friction"


@pytest.mark.parametrize(
    ("source", "change"),
    [
        (BEGUN, lambda scene: with_values(scene, {FRICTION: 0.123456789012345, "body.spheres": "coarse"})),
        (BEGUN, lambda scene: with_values(with_rig(scene, "lifting_cylinder"), {"rig.lift_speed": "20 mm/s"})),
        (rig_source("rotating_drum", "sunflower_extract"), lambda scene: scene),
        (prepared_source("seed_pour"), lambda scene: with_values(scene, {"rig.mass": "5 g"})),
    ],
)
def test_a_link_leads_back_to_every_bit_of_the_scene(source, change):
    scene = change(source.scene)
    text = pour_text(source, scene, 7, BEGUN)
    found = read_pour(f"{text}&time={0.1 + 0.2!r}", BEGUN)
    assert (found.scene, found.seed, found.moment) == (scene, 7, 0.1 + 0.2)
    assert found.source == source
    assert len(text) < LONGEST / 4


def test_a_project_s_own_scene_is_told_by_its_checksum_and_known_again_only_there(tmp_path):
    write_study(tmp_path, "lentil", None)
    own = material_source(str(tmp_path / "lentil.toml"))
    text = pour_text(own, own.scene, 1, own)
    assert "lentil" not in text
    assert read_pour(text, own).scene == own.scene
    with pytest.raises(CommandError, match="neither a shipped scene nor the one that this page started with"):
        read_pour(text, BEGUN)
    with pytest.raises(CommandError, match="a file on this machine"):
        pour_text(own, own.scene, 1, BEGUN)


def test_a_scene_of_no_file_is_refused_in_writing():
    with pytest.raises(CommandError, match="link"):
        pour_text(SceneSource((), BEGUN.scene), BEGUN.scene, 1, BEGUN)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "link: '' is neither"),
        ("pour=/etc/passwd", "'/etc/passwd' is neither"),
        ("pour=./sunflower_extract.toml", "is neither"),
        ("pour=funnel&material=/etc/passwd", "'funnel /etc/passwd' is neither"),
        ("pour=funnel&material=../materials/sunflower_extract", "is neither"),
        ("pour=mesh_funnel&set=rig.mesh%3D/etc/passwd", "rig.mesh is a file"),
        ("pour=sunflower_extract&set=rig.name%3Dmesh_funnel&set=rig.mesh%3D/etc/passwd.stl", "rig.mesh is a file"),
        ("pour=sunflower_extract&set=rig.name%3D/etc", "/etc"),
        ("pour=sunflower_extract&set=nonsense", "nonsense: no such parameter"),
        ("pour=sunflower_extract&set=rig.mass%3D1e9", "rig.mass"),
        ("pour=sunflower_extract&set=rig.mass%3Dnan", "rig.mass"),
        ("pour=sunflower_extract&seed=x", "link, seed: 'x' is not a finite number"),
        ("pour=sunflower_extract&time=inf", "link, time: 'inf' is not a finite number"),
        ("pour=" + "x" * LONGEST, "allowed: up to 2000"),
    ],
)
def test_what_a_link_must_not_hold_is_refused_in_one_line(text, line):
    with pytest.raises(ValueError, match=r"link|no such|rig") as refused:
        read_pour(text, BEGUN)
    assert line in str(refused.value)
    assert "\n" not in str(refused.value)


def test_no_setting_is_read_before_files_among_them_are_refused(tmp_path):
    """Neither that a file is there nor what it holds is told."""
    mesh = tmp_path / "there.stl"
    mesh.write_text("no mesh")
    lines = []
    for file in (mesh, tmp_path / "not_there.stl"):
        with pytest.raises(CommandError) as refused:
            read_pour(f"pour=mesh_funnel&set=rig.mesh%3D{file}", BEGUN)
        lines.append(str(refused.value))
    assert lines[0] == lines[1]


def test_the_text_can_be_read_by_a_person():
    scene = with_values(BEGUN.scene, {FRICTION: 0.4})
    assert parse_qs(pour_text(BEGUN, scene, 3, BEGUN)) == {
        "pour": ["sunflower_extract"],
        "set": [f"{FRICTION}=0.4"],
        "seed": ["3"],
    }

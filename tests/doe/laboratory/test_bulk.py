"""Bulk density, drum and draw-down box: by hand, by identities between them, and bad rows."""

import math

import pytest

from doe.laboratory import LaboratoryError, analyse
from solver.assets import asset_path
from solver.observables import OBSERVABLES
from tests.doe.laboratory.readings import assert_one_line, written

VESSEL = "component,replicate,mass_g,mass_vessel_g,volume_ml,mass_tapped_g,volume_tapped_ml,particle_density_kg_m3\n"
DRUM = "component,replicate,upper_angle_deg,lower_angle_deg,speed_rpm,diameter_mm\n"
BOX = "component,replicate,shear_angle_deg,repose_angle_deg,mass_left_g,mass_discharged_g,flow_time_s\n"


def values(result):
    return {one.name: one.values for one in result.derived}


def test_densities_voidages_and_the_ratios_by_hand(tmp_path):
    """150 g in 100 ml are 1500 kg/m³, of bodies of 2500 a voidage of 0.4; in 90 ml 1666.7 and 1/3; H 10/9, C 0.1."""
    found = values(analyse("bulk_density", written(tmp_path, VESSEL + "s,1,400,250,100,,90,2500\n")))
    assert found["bulk_density_loose"] == pytest.approx((1500.0,))
    assert found["voidage_loose"] == pytest.approx((0.4,))
    assert found["bulk_density_tapped"] == pytest.approx((1500.0 / 0.9,))
    assert found["voidage_tapped"] == pytest.approx((1.0 / 3.0,))
    assert found["hausner_ratio"] == pytest.approx((10.0 / 9.0,))
    assert found["carr_index"] == pytest.approx((0.1,))


def test_tapping_by_mass_and_by_volume_agree(tmp_path):
    """The same packing: 150 g in 90 ml, or 166.67 g in 100 ml."""
    by_volume = values(analyse("bulk_density", written(tmp_path, VESSEL + "s,1,400,250,100,,90,\n", "v.csv")))
    tapped = 250.0 + 150.0 / 0.9
    by_mass = values(analyse("bulk_density", written(tmp_path, f"{VESSEL}s,1,400,250,100,{tapped!r},,\n", "m.csv")))
    assert by_mass.keys() == by_volume.keys()
    for name, numbers in by_mass.items():
        assert numbers == pytest.approx(by_volume[name])
    assert "voidage_loose" not in by_mass


def test_a_quantity_is_of_the_fillings_that_have_what_it_needs(tmp_path):
    rows = "s,1,400,250,100,,90,2500\ns,2,402,250,100,,,2500\nt,1,300,250,100,,,\n"
    result = analyse("bulk_density", written(tmp_path, VESSEL + rows))
    numbers = {(one.of[0], one.name): one.summary.n for one in result.derived}
    assert numbers["s", "bulk_density_loose"] == 2
    assert numbers["s", "hausner_ratio"] == 1
    assert ("t", "voidage_loose") not in numbers
    assert all(one.parameter == "" for one in result.derived)


def test_the_error_of_a_bulk_density_by_hand(tmp_path):
    """m ± 0.3 g of 150 g and V ± 0.5 ml of 100 ml: relative √(0.002² + 0.005²)/√3."""
    head = "component,replicate,mass_g,mass_error_g,volume_ml,volume_error_ml\n"
    (density,) = analyse("bulk_density", written(tmp_path, head + "s,1,150,0.3,100,0.5\n")).derived
    assert density.reading.standard == pytest.approx(1500 * math.hypot(0.002, 0.005) / math.sqrt(3), rel=1e-4)


def test_the_drum_by_hand(tmp_path):
    """60 rpm in 200 mm: ω = 2π, Fr = 4π² · 0.1/9.81 = 0.40243."""
    result = analyse("drum", written(tmp_path, DRUM + "s,1,40,30,60,200\n"))
    found = values(result)
    assert found["dynamic_angle"] == pytest.approx((math.radians(35.0),))
    assert found["avalanche_amplitude"] == pytest.approx((math.radians(10.0),))
    assert found["froude_number"] == pytest.approx((0.40243,), abs=1e-5)
    assert "outside 1e-4 … 1e-2" in result.notes[1]
    slow = analyse("drum", written(tmp_path, DRUM + "s,1,40,30,5,200\n"))
    assert len(slow.notes) == 1
    # Alone, an upper angle is what there is.
    assert set(values(analyse("drum", written(tmp_path, DRUM + "s,1,40,,,\n")))) == {"dynamic_angle_upper"}


def test_the_box_by_hand(tmp_path):
    """180 of 300 g out in 1.5 s."""
    found = values(analyse("draw_down", written(tmp_path, BOX + "s,1,36,31,120,180,1.5\n")))
    assert found["shear_angle"] == pytest.approx((math.radians(36.0),))
    assert found["angle_of_repose"] == pytest.approx((math.radians(31.0),))
    assert found["discharged_share"] == pytest.approx((0.6,))
    assert found["mass_flow"] == pytest.approx((0.12,))


@pytest.mark.parametrize("test", ["bulk_density", "drum", "draw_down"])
def test_a_target_names_observables_that_there_are(test):
    result = analyse(test, asset_path("laboratory", test))
    assert "a target, no parameter of the material" in result.notes[0]
    named = {
        word.strip(",()") for word in result.notes[0].split() if word.strip(",()").partition("@")[0] in OBSERVABLES
    }
    assert named
    assert all(one.reading for one in result.derived if one.name not in ("froude_number", "discharged_share"))


@pytest.mark.parametrize(
    ("test", "text", "words"),
    [
        ("bulk_density", VESSEL + "s,1,200,250,100,,,\n", ["mass_vessel", "no sample"]),
        ("bulk_density", VESSEL + "s,1,400,250,100,390,,\n", ["mass_tapped", "lower density"]),
        ("bulk_density", VESSEL + "s,1,400,250,100,,110,\n", ["volume_tapped", "lower density"]),
        ("bulk_density", VESSEL + "s,1,400,250,100,410,95,\n", ["mass_tapped", "together with volume_tapped"]),
        ("bulk_density", VESSEL + "s,1,400,250,100,,90,1600\n", ["particle_density", "above 1667"]),
        ("drum", DRUM + "s,1,30,40,5,200\n", ["lower_angle", "up to it"]),
        ("drum", DRUM + "s,1,40,30,5,\n", ["diameter", "is empty"]),
        ("drum", DRUM + "s,1,40,30,,200\n", ["speed", "is empty"]),
        ("draw_down", BOX + "s,1,36,31,120,,\n", ["mass_discharged", "with mass_left"]),
        ("draw_down", BOX + "s,1,36,31,,,1.5\n", ["mass_discharged", "with flow_time"]),
        ("draw_down", BOX + "s,1,,,,,\n", ["shear_angle", "at least one reading"]),
    ],
)
def test_bad_rows_are_one_line(test, text, words, tmp_path):
    path = written(tmp_path, text)
    with pytest.raises(LaboratoryError) as refused:
        analyse(test, path)
    assert_one_line(refused.value, path, ["row 2", *words])

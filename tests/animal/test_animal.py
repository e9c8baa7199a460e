"""A synthetic animal's files: its hidden mechanics come back, its films are predicted, and what is
at fault or missing stops nothing else.
"""

import json
import re
import shutil

import numpy as np
import pytest

from feeler.animal import (
    PLANTED,
    study_animal,
    write_animal_page,
    write_example,
    write_template,
)
from feeler.animal.plan import load_animal
from feeler.antenna.files import load_antenna
from feeler.errors import InvalidInput
from feeler.tensors.formats import load
from tests.cli._command import run


@pytest.fixture(scope="module")
def example(tmp_path_factory):
    folder = tmp_path_factory.mktemp("animal")
    write_example(folder, seed=3)
    return folder


def keep(example, folder, *sections, change=("", "")):
    """The example with these sections of its plan alone, and one text changed, in a new folder."""
    shutil.copytree(example, folder, dirs_exist_ok=True)
    text = (folder / "animal.toml").read_text()
    head, *parts = text.split("\n[")
    kept = [head, *(part for part in parts if part.partition("]")[0] in sections)]
    (folder / "animal.toml").write_text("\n[".join(kept).replace(*change))
    return folder / "animal.toml"


@pytest.mark.long
def test_the_whole_example_finds_the_animal_and_predicts_another_film(example, tmp_path):
    study = study_animal(example / "animal.toml")
    assert not study.problems and [*study.missing] == ["wall"]
    values = np.array([*PLANTED.values()])
    width = study.fit.high - study.fit.low
    assert study.fit.names == (*PLANTED,)
    inside = (values > study.fit.low - 0.3 * width) & (values < study.fit.high + 0.3 * width)
    assert inside.all() and np.all(width[:3] < 0.6)
    (told,) = study.predictions
    assert told.name == "c4" and told.error < 0.5 * told.error_before
    assert told.error < 4 * study.spread
    # the left antenna of the film meets the stone once, bends, and the simulation follows its tip
    assert len(study.contacts) == 1 and 0.5 < study.contacts["place"][0] < 1
    assert study.tip_error < 0.4  # mm
    names = write_animal_page(study, tmp_path)
    assert all((tmp_path / name).exists() for name in names)
    page = (tmp_path / "animal.html").read_text()
    assert page.index("was not used in the fit") < page.index("The fitted antenna")
    own = load_antenna(tmp_path / "antenna.toml")
    np.testing.assert_array_equal(own.stiffness, study.antenna.stiffness)
    assert load_antenna(tmp_path / "antenna_in_space.toml") == own.unflatten()
    assert load(tmp_path / "touch.nc").sizes["sensor"] == own.sensors.size
    assert json.loads((tmp_path / "animal.json").read_text())["fit"]["names"] == [*PLANTED]


def test_with_forces_alone_the_stiffness_is_fitted_and_the_rest_is_asked_for(example, tmp_path):
    plan = keep(example, tmp_path / "a", "microscope", "force")
    study = study_animal(plan)
    assert study.fit.names == ("stiffness",) and not study.problems
    assert {"prediction", "kinematics", "touch", "spikes", "wall"} == {*study.missing}
    assert "[walks]" in study.missing["kinematics"] and "release" in study.fit.held["damping"]


@pytest.mark.long
def test_a_part_at_fault_stops_no_other(example, tmp_path):
    plan = keep(
        example, tmp_path / "a", "microscope", "force", "releases", change=("p40", "p4O")
    )
    study = study_animal(plan)
    assert {*study.problems} == {f"release_c{k}.csv" for k in (1, 2, 3, 4)}
    assert "no landmark 'p4O'. Did you mean 'p40'" in study.problems["release_c1.csv"]
    assert study.antenna is not None and study.fit.names == ("stiffness",)
    done = run("animal", "animal.toml", "--out", "out", cwd=plan.parent)
    assert done.returncode == 1 and "problem with release_c1.csv" in done.stdout
    assert (plan.parent / "out" / "antenna.toml").exists()


@pytest.mark.further
@pytest.mark.parametrize("preset", ["whisker", "cricket", "uniform"])
def test_a_wall_is_as_feeler_wall_says_and_its_page_explains_it(tmp_path, preset):
    plan = tmp_path / "animal.toml"
    plan.write_text(f'schema = "feeler.animal/1"\nantenna = "{preset}"\n[wall]\nangle = 30.0\n')
    study = study_animal(plan)
    said = json.loads(run("wall", preset, "--angle", "30", "--json", cwd=tmp_path).stdout)[
        preset
    ]
    assert not study.problems
    np.testing.assert_allclose(study.wall.distance, said["distance"])
    np.testing.assert_allclose(study.wall.r2, said["r2"], rtol=1e-6)
    write_animal_page(study, tmp_path / "out")
    assert study.wall.bending.split(",")[0] in (tmp_path / "out" / "animal.html").read_text()


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (("[force]", "[forces]"), "has no 'forces'"),
        (("at = 10.0", "at = -1.0"), r"\[force\].*at must be > 0"),
        (("feeler.animal/1", "feeler.animal/9"), "must begin with schema"),
        (("modulus = 300.0", ""), "needs modulus"),
    ],
)
def test_plans_that_are_none_say_where(example, tmp_path, change, match):
    plan = keep(example, tmp_path / "a", "microscope", "force", change=change)
    with pytest.raises(InvalidInput, match=match):
        load_animal(plan)


@pytest.mark.long
@pytest.mark.parametrize(
    ("change", "match"),
    [
        (("frame_rate", "scale = 0.5\nframe_rate"), "mm long in the film.* Is scale="),
        (("at = 6.0", "at = 60.0"), r"\[releases\] at = 60 mm is beyond the antenna's tip"),
    ],
)
def test_a_plan_at_odds_with_its_films_is_questioned(example, tmp_path, change, match):
    plan = keep(example, tmp_path / "a", "microscope", "releases", change=change)
    assert re.search(match, " ".join(study_animal(plan).problems.values()))


def test_a_film_is_fitted_or_predicted(example, tmp_path):
    plan = keep(example, tmp_path / "a", "microscope", "releases")
    fitted = load_animal(plan).releases.files["c1"]
    plan.write_text(plan.read_text().replace("release_c4.csv", fitted))
    with pytest.raises(InvalidInput, match=f"{fitted} is in files and in held_out"):
        load_animal(plan)


def test_the_template_is_a_plan(tmp_path):
    write_template(tmp_path / "animal.toml")
    plan = load_animal(tmp_path / "animal.toml")
    assert {
        "microscope",
        "force",
        "releases",
        "impulses",
        "walks",
        "object",
        "wall",
        "spikes",
    } == {name for name, value in vars(plan).items() if value is not None} - {
        "name",
        "antenna",
        "folder",
    }
    with pytest.raises(InvalidInput, match="exists already"):
        write_template(tmp_path / "animal.toml")

"""Results are found again by what they are made of, and by nothing else."""

import re
import sys
from dataclasses import replace
from types import SimpleNamespace

import joblib
import numpy as np
import pytest
from PIL import Image

from feeler import provenance
from feeler.errors import FeelerError
from feeler.report import Section
from paper import cache, command
from paper.cache import Stage, hold, is_kept, keep, list_sources, run_stage
from paper.context import Context
from paper.fig4 import CachedNMF
from paper.kept import find_shipped, keep_sections
from paper.report import OPENING_MOVIE
from paper.statements import judge_statements, load_statements


@pytest.fixture
def double(tmp_path, monkeypatch):
    """Doubles arrays, and notes each call."""
    monkeypatch.setenv("FEELER_CACHE", str(tmp_path / "cache"))
    cache.begin()
    calls = []

    def double(array, factor=2, workers=1):
        calls.append(1)
        return factor * array

    double.calls = calls
    return double


def count(double, *args, **options):
    found = keep("double", double, *args, **options)
    return found.tolist(), len(double.calls)


def test_only_what_matters_makes_another_result(double):
    assert count(double, np.arange(3)) == ([0, 2, 4], 1)
    assert count(double, np.arange(3), workers=8) == ([0, 2, 4], 1)
    assert count(double, np.arange(3), factor=3) == ([0, 3, 6], 2)
    assert count(double, np.arange(3.0)) == ([0, 2, 4], 3)


def test_fresh_computes_everything_once(double, tmp_path):
    count(double, np.arange(3))
    cache.begin((tmp_path / "cache").stat().st_mtime + 1e9)
    assert count(double, np.arange(3))[1] == 2


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda path: path.write_bytes(path.read_bytes()[:-9]), "computed anew: damaged"),
        (lambda path: path.write_bytes(b""), "computed anew: damaged"),
        (lambda path: None, "made by another version"),
    ],
)
def test_a_damaged_or_old_result_is_computed_anew_and_said(
    double, tmp_path, monkeypatch, spoil, message
):
    count(double, np.arange(300))
    (path,) = (tmp_path / "cache").rglob("*.joblib")
    spoil(path)
    if "version" in message:
        monkeypatch.setattr(cache, "PHYSICS", -1)
    with pytest.warns(UserWarning, match=message):
        assert count(double, np.arange(300))[1] == 2
    assert count(double, np.arange(300))[1] == 2


def test_a_full_disk_loses_no_result_and_an_interrupted_one_leaves_nothing(
    double, tmp_path, monkeypatch
):
    def fail(*_, **__):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch, pytest.warns(UserWarning, match="No space left"):
        patch.setattr(cache.joblib, "dump", fail)
        assert count(double, np.arange(3)) == ([0, 2, 4], 1)

    def stop(array):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        keep("double", stop, np.arange(3))
    assert not [*(tmp_path / "cache").rglob("[!.]*.joblib*")]


def test_where_nothing_can_be_written_results_are_computed_and_that_is_said(double, tmp_path):
    (tmp_path / "cache").write_text("no folder")
    for calls in (1, 2):
        with pytest.warns(UserWarning, match="a double could not be cached: Not a directory"):
            assert count(double, np.arange(3)) == ([0, 2, 4], calls)


def test_a_fit_that_is_recalled_is_the_fit(double):
    rng = np.random.default_rng(0)
    tensors = rng.random((4, 3, 30))
    options = {"n_components": 2, "n_lags": 4, "max_iter": 3, "warn": False, "random_state": 0}
    first, second = (CachedNMF(**options, n_jobs=n).fit(tensors) for n in (1, 2))
    assert [one["source"] for one in cache._used] == ["computed", "cache"]
    np.testing.assert_array_equal(first.activations_, second.activations_)
    # so what is made of a fit has one key
    keys = {joblib.hash(vars(one) | {"n_jobs": None}) for one in (first, second)}
    assert len(keys) == 1
    np.testing.assert_array_equal(*(one.transform(tensors) for one in (first, second)))


def test_a_run_lists_what_was_computed_and_what_was_not(double, tmp_path):
    def show(context, section):
        keep("double", double, np.arange(3))
        keep("double", double, np.arange(4))

    count(double, np.arange(3))
    stage = Stage(name="antenna", title="t", make=show)
    made, again = (run_stage(stage, Context(out=tmp_path / "out")) for _ in range(2))
    found = list_sources([made])
    assert found["source"].tolist() == ["computed", "cache", "computed"]
    assert found["result"].tolist() == ["section", "double", "double"]
    again.kept = ""
    assert list_sources([again])["source"].tolist() == ["cache"]


def test_a_figure_shows_what_it_computed_and_its_rows_become_values(tmp_path, monkeypatch):
    def fail(data, section):
        raise AssertionError("there is nothing to show")

    figure = SimpleNamespace(
        compute=lambda context: SimpleNamespace(rows={"seeds.n": context.seed}),
        show=lambda data, section: section.text(f"{data.rows['seeds.n']}"),
        compute_part=lambda context: None,
        show_part=fail,
    )
    monkeypatch.setitem(sys.modules, "paper.fig0", figure)
    section = Section(name="antenna", title="t", folder=tmp_path)
    stage = Stage(name="antenna", title="t", figures=("fig0:part", "fig0"))
    stage.show(Context(seed=3), section)
    assert section.values == {"seeds.n": 3} and section.blocks[0]["text"] == "3"


def make_stage(make):
    return Stage(name="antenna", title="t", make=make)


@pytest.mark.parametrize(
    "change", [{"seed": 1}, {"scale": "smoke"}, {"timestep": 0.01}, {"engine": "mujoco"}]
)
def test_the_key_holds_everything_that_matters(change):
    stage = make_stage(lambda context, section: None)
    assert stage.key(Context(**change)) != stage.key(Context())
    assert stage.key(Context(workers=2)) == stage.key(Context())


def test_a_failed_stage_is_told_and_not_kept(tmp_path):
    def fail(context, section):
        raise FeelerError("no such thing")

    section = run_stage(make_stage(fail), Context(out=tmp_path))
    assert "no such thing" in section.blocks[0]["text"]
    assert section.failed == "no such thing"
    assert not list(tmp_path.rglob("section.json"))


def test_a_run_without_one_of_its_sections_does_not_end_well(tmp_path, monkeypatch):
    def reproduce(context, report):
        return [Section(name="axes", title="Axes", folder=tmp_path, failed="The disk is full.")]

    monkeypatch.setattr(command, "reproduce", reproduce)
    monkeypatch.setattr(command, "judge_statements", lambda *_: [])
    asked = {"scale": "smoke", "antenna": "cockroach", "change": [], "seed": 0, "workers": 1}
    asked |= {"engine": "chain-consistent", "timestep": None, "out": tmp_path}
    asked |= {"log_json": False, "show": False, "fresh": False}
    with pytest.raises(FeelerError, match=r"1 of 1 sections .* Axes: The disk is full\."):
        command.run(**asked)


def test_an_interrupted_stage_leaves_nothing(tmp_path):
    def stop(context, section):
        (section.folder / "half.png").write_bytes(b"x")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_stage(make_stage(stop), Context(out=tmp_path))
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


@pytest.mark.parametrize("name", ["seed", "scale", "profiles", "effort"])
def test_a_stage_cannot_read_what_its_key_does_not_hold(tmp_path, name):
    stage = Stage(
        name="antenna",
        title="t",
        make=lambda context, section: getattr(context, name),
        reads=("engine",),
    )
    with pytest.raises(AttributeError, match=f"reads context.{name} but does not declare"):
        run_stage(stage, Context(out=tmp_path))


@pytest.mark.parametrize(
    ("change", "same"), [({"seed": 1}, True), ({"engine": "mujoco"}, False)]
)
def test_only_declared_parameters_change_the_key(change, same):
    stage = Stage(
        name="antenna", title="t", make=lambda context, section: None, reads=("engine",)
    )
    assert (stage.key(Context(**change)) == stage.key(Context())) is same


def test_a_fresh_run_uses_what_it_made_itself(tmp_path):
    calls = []
    stage = make_stage(lambda context, section: calls.append(1))
    context = Context(out=tmp_path, fresh=True)
    run_stage(stage, context)
    assert run_stage(stage, context).cached
    assert len(calls) == 1


def test_who_holds_a_path_makes_its_folder_and_another_may_hold_it_after(tmp_path):
    path = tmp_path / "a" / "b" / "made"
    for _ in range(2):
        with hold(path):
            assert path.parent.is_dir()


def test_a_result_is_kept_unless_it_is_older_than_a_fresh_run(tmp_path):
    path = tmp_path / "made"
    path.write_text("x")
    made = path.stat().st_mtime
    assert is_kept(path, Context()) and not is_kept(tmp_path / "other", Context())
    assert is_kept(path, Context(fresh=True, started=made)) and not is_kept(
        path, Context(fresh=True, started=made + 1)
    )


def show(context, section):
    section.text("Three antennae.")
    section.figure("three", "Three lines.", lambda figure: figure.subplots().plot([3, 1, 2]))
    section.values["three.lines"] = 3.0


STAGE = Stage(
    name="three", title="Three", make=show, reads=("scale", "seed", "engine", "antenna")
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One kept section, of a whole run with seed 0."""
    folder = tmp_path_factory.mktemp("kept")
    (made := folder / "made").mkdir()
    section = Section(name=STAGE.name, title=STAGE.title, folder=made, seconds=41.7)
    show(None, section)
    section.save()
    keep_sections([(STAGE, section)], Context(scale="paper"), folder)
    return folder


def test_a_kept_section_has_its_numbers_and_says_whence(folder):
    found = find_shipped(STAGE, Context(scale="quick"), folder)
    assert found.values == {"three.lines": 3.0} and found.scale == "paper"
    assert re.fullmatch(
        r"Precomputed at paper scale on \d{4}-\d\d-\d\d \(seed 0, 42 s\)\.", found.kept
    )
    assert (found.folder / found.blocks[1]["file"]).stat().st_size < 100_000


def test_the_first_screen_s_movie_is_kept_as_a_movie(tmp_path):
    (made := tmp_path / "made").mkdir()
    section = Section(name=STAGE.name, title=STAGE.title, folder=made)
    for name in (OPENING_MOVIE, "other.mp4"):
        path = made / name
        path.write_bytes(b"frames")
        Image.new("RGB", (4, 3)).save(path.with_suffix(".jpg"))
        section.movie(path, "A movie.")
    section.save()
    keep_sections([(STAGE, section)], Context(scale="paper"), tmp_path)
    found = find_shipped(STAGE, Context(scale="quick"), tmp_path)
    assert [block["kind"] for block in found.blocks] == ["movie", "figure"]
    assert (found.folder / OPENING_MOVIE).read_bytes() == b"frames"
    assert (found.folder / found.blocks[0]["still"]).exists()


@pytest.mark.parametrize("asked", [{"seed": 3}, {"engine": "mujoco"}, {"is_cockroach": False}])
def test_who_asks_something_else_gets_no_kept_section(folder, asked):
    assert find_shipped(STAGE, Context(scale="quick", **asked), folder) is None


def test_a_section_of_other_physics_says_so(folder, monkeypatch):
    monkeypatch.setattr(provenance, "PHYSICS", provenance.PHYSICS + 1)
    found = find_shipped(STAGE, Context(scale="quick"), folder)
    assert found.kept.endswith("Its settings or the physics have changed since.")


def test_a_kept_section_is_judged_at_its_own_scale(tmp_path):
    statement = next(one for one in load_statements() if one.scale == "paper")
    section = Section(name=statement.section, title="", folder=tmp_path)
    judged = {
        scale: next(
            one
            for one in judge_statements([replace(section, scale=scale)], Context(scale="quick"))
            if one.statement == statement
        )
        for scale in ("", "paper")
    }
    assert "paper judges it" in judged[""].why
    assert "judges it" not in judged["paper"].why

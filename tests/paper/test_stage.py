"""Stages are kept by what matters, and a failed stage leaves nothing that looks whole."""

import pytest

from feeler.errors import FeelerError
from paper.cache import hold
from paper.context import Context
from paper.stage import Stage, is_kept, run_stage


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
    assert not list(tmp_path.rglob("section.json"))


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

"""Tasks draw the same touches for every antenna and speed, and say in one line what cannot be."""

import numpy as np
import pytest

import feeler
from feeler.errors import InvalidInput
from feeler.files import read_toml, save_toml
from feeler.objects import (
    Ball,
    Box,
    Common,
    Nuisances,
    Relative,
    Task,
    Wall,
    place,
)

TASK = Task(objects=("ball:radius=1.5", "box"), locations=(0.6, 0.9), noise="common:0.03")
ODD = feeler.Antenna(
    segment_length=np.full(6, 4.0), segment_mass=2e-4, radius=0.3, stiffness=0.3, damping=2.0
)


def read(trials):
    return [(t.feature.size, t.location, t.approach, t.friction) for t in trials]


def test_all_antennas_and_speeds_meet_the_same_touches():
    first, labels = TASK.draw(set=3, each=2)
    again, _ = TASK.draw(ODD, set=3, speed=0.06, each=5)
    kept = [touch for number, touch in enumerate(again) if number % 5 < 2]
    assert read(first) == read(kept) and {t.speed for t in kept} == {0.06}
    assert list(labels[::2]) == TASK.labels and list(labels[::2]) == list(labels[1::2])


def test_the_classes_are_drawn_in_the_order_of_their_labels_within_the_nuisances():
    trials, labels = TASK.draw(each=200)
    for number, label in enumerate(TASK.labels):
        own = trials[200 * number : 200 * number + 200]
        where, size = TASK.locations[number // 2], TASK.objects[number % 2].size
        assert set(labels[200 * number : 200 * number + 200]) == {label}
        assert {t.feature.kind for t in own} == {TASK.objects[number % 2].kind}
        for name, middle, half in (
            ("location", where, 0.015),
            ("approach", 90.0, 4.0),
            ("friction", 0.8, 0.2),
        ):
            values = np.array([getattr(t, name) for t in own])
            assert np.abs(values - middle).max() <= half * (1 + 1e-9)
            assert np.abs(values - middle).max() > 0.9 * half
        shares = np.array([t.feature.size for t in own]) / size
        assert 0.95 <= shares.min() < 0.96 and 1.04 < shares.max() <= 1.05
        assert {t.side for t in own} == {"left"}


@pytest.mark.parametrize("change", [{"set": 1}, {"purpose": "test"}])
def test_another_set_or_purpose_meets_others(change):
    assert not {*read(TASK.draw()[0])} & {*read(TASK.draw(**change)[0])}


def test_each_nuisance_has_a_stream_of_its_own():
    wider = TASK.replace(nuisances=Nuisances(size=0.2, speed=0.1))
    for one, other in zip(TASK.draw()[0], wider.draw()[0], strict=True):
        assert (one.location, one.approach, one.friction) == (
            other.location,
            other.approach,
            other.friction,
        )
        assert one.feature.size != other.feature.size and one.speed != other.speed


def test_no_speed_named_draws_each_of_the_tasks():
    task = TASK.replace(speeds=(0.06, 0.6))
    trials, labels = task.draw()
    assert [t.speed for t in trials] == [0.06] * 4 + [0.6] * 4
    assert list(labels) == 2 * task.labels


def test_touches_that_cannot_be_placed_are_drawn_again():
    bent = ODD.replace(rest_angle=np.array([0.0, 0, 0, -1.2, -1.2, -0.9]))
    task = Task(
        objects=(Ball(radius=2.0),),
        locations=(0.5,),
        nuisances={"location": 0.2, "approach": 60},
        lead=20.0,
    )
    trials, _ = task.draw(bent, each=50)
    for trial in trials:
        place(bent, trial)
    assert read(trials) != read(task.draw(ODD, each=50)[0])


def test_a_range_says_where_the_value_itself_lies():
    by = Nuisances(
        location=(0.3, 0.5),
        size=feeler.LogRange(1.0, 2.0),
        friction=0.0,
        approach=[80.0, 90.0, 99.0],
    )
    trials, _ = Task(objects="ball", locations=(0.9,), nuisances=by, lead=(2.0, 8.0)).draw(
        each=300
    )
    location, leads = (np.array([getattr(t, n) for t in trials]) for n in ("location", "lead"))
    size = np.array([t.feature.size for t in trials])
    assert 0.3 <= location.min() < 0.31 and 0.49 < location.max() <= 0.5
    assert 2 <= leads.min() < 2.2 and 7.8 < leads.max() <= 8
    assert np.median(size) == pytest.approx(np.sqrt(2), rel=0.05)
    assert {t.approach for t in trials} == {80.0, 90.0, 99.0} and {
        t.friction for t in trials
    } == {1}


@pytest.mark.further
@pytest.mark.parametrize("name", ["location", "size", "approach", "friction", "speed"])
def test_a_normal_nuisance_has_its_standard_deviation(name):
    """Shares are log-normal, so that they stay positive; place and angle are normal."""
    spread = {"approach": 3.0}.get(name, 0.02)
    by = Nuisances.only(kind="normal", **{name: spread})
    trial = feeler.Trial(feature=Ball(radius=2.0), location=0.5, speed=0.3, friction=0.7)
    moved = by.jitter([trial], np.random.default_rng(0), 4000)
    names = ("location", "size", "approach", "friction", "speed")
    values = np.array(
        [[t.location, t.feature.size, t.approach, t.friction, t.speed] for t in moved]
    )
    nominal = np.array([0.5, 2.0, 90.0, 0.7, 0.3])
    shares = np.log(values / nominal)
    moves = np.where(np.isin(names, ["location", "approach"]), values - nominal, shares)
    own = moves[:, names.index(name)]
    assert own.mean() == pytest.approx(0, abs=4 * spread / np.sqrt(4000))
    assert own.std() == pytest.approx(spread, rel=0.05)
    assert not moves[:, [n != name for n in names]].any()


def test_given_touches_are_moved_in_turn_and_walls_keep_their_size():
    trials = [
        feeler.Trial(feature=Wall(), location=0.5, speed=0.3),
        feeler.Trial(feature=Ball(radius=2.0), location=0.99, speed=0.3),
    ]
    moved = Nuisances(location=0.02, speed=0.1).jitter(trials, np.random.default_rng(1), 50)
    assert [t.feature.kind for t in moved[:4]] == ["wall", "ball", "wall", "ball"]
    assert {t.feature.name for t in moved[::2]} == {"wall"}
    assert max(t.location for t in moved) <= 1.0
    speed = np.array([t.speed for t in moved])
    assert 0.27 <= speed.min() < 0.28 and 0.32 < speed.max() <= 0.33


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {
            "nuisances": {"friction": 0.2, "kind": "normal"},
            "noise": Relative(0.2, each="vector"),
        },
        {"nuisances": {"size": feeler.LogRange(1.0, 2.0)}, "lead": (2.0, 8.0)},
        {
            "seeds": {"train": 7},
            "objects": (Ball(radius=2.0, name="marble"), Box(half_width=1.0, half_height=2.0)),
        },
    ],
)
def test_a_task_is_equal_to_that_of_its_plain_data_and_of_its_file(changes, tmp_path):
    task = TASK.replace(**changes)
    again = Task(**task.to_plain())
    save_toml(task.to_plain(), tmp_path / "task.toml")
    assert again == task == Task(**read_toml(tmp_path / "task.toml"))
    assert hash(again) == hash(task)
    assert read(again.draw()[0]) == read(task.draw()[0])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Task(objects=()), "a task needs an object"),
        (
            lambda: Task(objects=("ball", Ball(radius=1.5))),
            "two objects are called 'ball 1.5 mm",
        ),
        (lambda: Task(objects=("bell",)), "unknown .*'bell'"),
        (lambda: Task(objects=(Wall(),)), "objects must be bounded"),
        (lambda: Task(locations=()), "locations must be 1 or more numbers > 0 and ≤ 1"),
        (lambda: Task(speeds=(0.3, 0.3)), "speeds must be different numbers"),
        (lambda: Task(deadline=0.0), "deadline must be > 0 ms"),
        (lambda: Task(noise="pink"), "unknown noise model 'pink'; valid: relative, common"),
        (lambda: Task(noise="relative:-1"), "Relative.size must be ≥ 0"),
        (lambda: Task(noise="relative:0.1,per=vector"), "noise 'relative' has no 'per'"),
        (lambda: Task(noise=Common), "noise must be a standard deviation such as 0.1, a text"),
        (lambda: Task(seeds={"train": 1, "test": 1}), "seeds .* must differ"),
        (lambda: Task(nuisances={"colour": 1.0}), "Nuisances has no 'colour'; valid: location"),
        (lambda: Task(nuisances={"size": -0.1}), "Nuisances.size must be finite and ≥ 0"),
        (lambda: Task(nuisances={"kind": "box"}), "kind must be one of uniform, normal"),
        (lambda: Task(locations=np.linspace(0.1, 1, 200)), "at most 1000 classes"),
        (lambda: TASK.draw(purpose="exam"), "drawn for one of train, test, final"),
        (lambda: TASK.draw(set=-1), "number of a set must be ≥ 0"),
        (
            lambda: TASK.replace(nuisances={"location": 0.7}),
            "nuisance location cannot be placed at 0.6: Trial.location must be",
        ),
        (
            lambda: Task(objects="ball:radius=30").draw(),
            "ball 30 mm at 0.5 cannot be drawn: .* bigger than the antenna",
        ),
        (lambda: Nuisances().jitter([], np.random.default_rng(0), 0), "n_each must be ≥ 1"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(make, words):
    with pytest.raises(InvalidInput, match=words) as error:
        make()
    assert "\n" not in str(error.value)


def test_touches_leave_the_plane_and_are_else_the_same():
    antenna = feeler.presets.cockroach().unflatten()
    flat = Task(objects=["ball:radius=1.5"], locations=(0.5, 0.9))
    turned = flat.replace(nuisances=Nuisances(azimuth=60.0))
    trials, labels = turned.draw(antenna, "test", each=20)
    found = np.array([trial.azimuth for trial in trials])
    assert np.abs(found).max() <= 60 and found.std() > 20 and np.unique(found).size > 35
    same, names = flat.draw(antenna, "test", each=20)
    assert [trial.replace(azimuth=0.0) for trial in trials] == [*same]
    assert [*labels] == [*names]
    assert Task(**turned.to_plain()) == turned
    assert "azimuth" not in flat.to_plain()["nuisances"]
    with pytest.raises(
        InvalidInput, match=r"ball 1.5 mm at 0.5 cannot be drawn.*leaves the plane"
    ):
        turned.draw(antenna.flatten(), "test")

"""The studio's decoder: what must hold of what it says, whatever it was trained on."""

from threading import Event

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.objects.trials import Trial
from feeler.presets import make_preset
from feeler.studio import study
from feeler.studio.requests import AntennaRequest, ObjectRequest, TouchRequest
from feeler.studio.session import Session
from feeler.studio.study import ANSWERS, KINDS, Range, TouchDecoder

WISH = AntennaRequest(preset="robot")
SPEED = 0.3


def simulate(antenna, touches):
    return study._simulate(antenna, touches, lambda *_: None, Event())


def draw(range_, n, seed):
    """Touches at random within the range, from either side."""
    rng = np.random.default_rng(seed)
    wishes = [
        TouchRequest(
            kind=KINDS[k % 3],
            location=float(rng.uniform(*range_.location)),
            size=float(rng.uniform(*range_.size)),
            speed=float(rng.uniform(*range_.speed)),
            side=("left", "right")[rng.integers(2)],
        )
        for k in range(n)
    ]
    assert not any(range_.find_outside(wish) for wish in wishes)
    return [wish.make_trial() for wish in wishes], [wish.kind for wish in wishes]


@pytest.fixture(scope="module")
def trained(studied):
    touches, kinds = draw(studied.range, 30, 1)
    angle = simulate(WISH.make(), touches)
    return studied.decoder, studied.range, studied.scores, angle, kinds


@pytest.mark.long
def test_a_touch_sample_by_sample_is_read_as_the_whole_of_it(trained):
    decoder, *_, angle, _ = trained
    for touch in angle[:6]:
        stream = decoder.start()
        found = np.array([stream.update(sample).posterior for sample in touch.T])
        np.testing.assert_allclose(found, decoder.decode(touch)[0], atol=1e-9)


def test_what_is_known_of_a_touch_does_not_depend_on_what_comes_later(trained):
    decoder, *_, angle, _ = trained
    whole, noticed = decoder.decode(angle[0])
    part, at = decoder.decode(angle[0][:, : noticed + 40])
    np.testing.assert_allclose(part, whole[: noticed + 40], atol=1e-12)
    assert at == noticed


def test_a_missing_channel_is_no_evidence_and_no_nan(trained):
    decoder, *_, angle, _ = trained
    stream = decoder.start()
    for k, sample in enumerate(angle[0].T):
        gaps = np.where((np.arange(sample.size) + k) % 5 == 0, np.nan, sample)
        state = stream.update(gaps if k % 7 else np.full_like(gaps, np.nan))
    assert np.isfinite(state.posterior).all() and state.posterior.sum() == pytest.approx(1)


def test_nothing_is_said_before_contact(trained):
    posterior, noticed = trained[0].decode(np.zeros((trained[0].n_sensors_, 50)))
    assert noticed == -1
    np.testing.assert_allclose(posterior, [[1 / 3, 1 / 3, 1 / 3, 0]] * 50)


def test_touches_within_the_range_are_seldom_confidently_wrong_or_called_outside(trained):
    decoder, _, scores, angle, kinds = trained
    last = np.array([decoder.decode(touch)[0][-1] for touch in angle])
    right = np.array([ANSWERS.index(kind) for kind in kinds]) == last.argmax(axis=1)
    assert np.mean((last[:, :3].max(axis=1) >= 0.9) & ~right) <= 0.05
    assert np.mean(last[:, 3]) <= 0.1
    assert scores["confidently_wrong"] <= 0.05 and scores["noisy"] <= scores["clean"] + 0.05


def test_a_touch_like_none_of_the_training_is_outside_and_stays_so(trained):
    decoder, *_, angle, _ = trained
    strange = angle[0][::-1] + 0.5 * angle[3]  # base for tip
    posterior, noticed = decoder.decode(strange)
    outside = posterior[:, ANSWERS.index("outside")]
    assert noticed >= 0 and outside[-1] == 1 and set(outside) == {0.0, 1.0}
    assert np.all(np.diff(outside) >= 0)
    assert not posterior[-1, :3].any()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"friction": 0.4}, "friction 0.4 (trained: 1)"),
        ({"approach": 71.5}, "approach 71.5° (trained: 90°)"),
        ({"location": 0.41}, "location 0.41 (trained: 0.45 to 0.95)"),
        ({"size": 3.6}, "size 3.6 mm (trained: 1.2 to 3.5)"),
        ({"speed": 0.1}, "speed 0.1 m/s (trained: 0.285 to 0.315)"),
        ({"kind": "wall"}, "a wall (trained: ball, box, triangle)"),
        ({"objects": (ObjectRequest(),)}, "2 objects (trained: one)"),
    ],
)
def test_what_was_not_trained_is_named(more, words):
    wish = TouchRequest(speed=SPEED)
    assert Range.around(SPEED, 0.05).find_outside(wish) == []
    assert Range.around(SPEED, 0.05).find_outside(wish.replace(side="right")) == []
    assert Range.around(SPEED, 0.05).find_outside(wish.replace(**more)) == [words]


def test_a_speed_that_is_known_exactly_is_within_its_range():
    for speed in (0.06, 0.3, 1 / 3):
        assert Range.around(speed, 0.0).find_outside(TouchRequest(speed=speed)) == []


def test_the_session_says_outside_and_gives_no_kind(trained, monkeypatch):
    """The verdict of a touch with another friction, and of the same from the right."""
    import json

    from ._messages import unpack

    decoder, range_, scores, *_ = trained
    one = study.AntennaStudy(
        antenna=WISH.make(), speed=SPEED, labels=(), tensors=np.zeros((1, 1, 380)),
        similarity={}, encoder=_Encoder(), peak=1.0, decoder=decoder, range=range_,
        scores=scores,
    )  # fmt: skip
    monkeypatch.setattr(study, "find_study", lambda *_: one)
    for side in ("left", "right"):
        for friction in (1.0, 0.4):
            said = []
            session = Session(lambda packed, said=said: said.append(unpack(packed)))
            wish = TouchRequest(antenna=WISH, speed=SPEED, side=side, friction=friction)
            session.take(json.dumps({"type": "touch", "id": 1, "wish": wish.to_plain()}))
            while session.busy:
                Event().wait(0.001)
            ((header, arrays),) = [one for one in said if one[0]["type"] == "reading"]
            last = arrays["posterior"][-1]
            if friction == 1.0:
                assert header["outside"] == [] and last[3] == 0
            else:
                assert header["outside"] == ["friction 0.4 (trained: 1)"]
                assert last.tolist() == [0, 0, 0, 1]


class _Encoder:
    n_lags = 3

    def transform(self, values, code):
        return values


def test_an_antenna_that_feels_nothing_teaches_nothing(trained):
    silent = np.zeros((30, 4, 60))
    silent[:20, 0, 20:] = 0.1
    with pytest.raises(InvalidInput, match="10 of 30 training touches are not noticed"):
        TouchDecoder(onset=0.01).fit(silent, [KINDS[k % 3] for k in range(30)])


def test_a_curved_antenna_is_trained_from_both_sides(monkeypatch):
    """There left and right are no mirror images of each other."""
    seen = []

    def simulate(antenna, touches, tell, stop):
        seen.append({one.side for one in touches})
        raise InvalidInput("enough")

    monkeypatch.setattr(study, "_simulate", simulate)
    antenna = WISH.make()
    for one in (antenna, antenna.replace(rest_angle=np.full(antenna.n_segments, 0.01))):
        with pytest.raises(InvalidInput, match="enough"):
            study.train(one, SPEED, lambda *_: None, Event(), 0.02)
    assert seen == [{"left"}, {"left", "right"}]


def test_the_drawn_touches_fill_the_range_and_no_more():
    range_ = Range.around(SPEED, 0.1)
    touches, kinds = range_.draw(96, 0)
    assert all(isinstance(one, Trial) for one in touches)
    assert [kinds.count(kind) for kind in KINDS] == [32, 32, 32]
    for name, (low, high) in (("location", range_.location), ("speed", range_.speed)):
        values = np.array([getattr(one, name) for one in touches])
        assert low <= values.min() < low + 0.05 * (high - low)
        assert high >= values.max() > high - 0.05 * (high - low)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.06, 0.6])
@pytest.mark.parametrize("preset", ["exponential", "matched"])
def test_two_hundred_random_touches(preset, speed):
    antenna = AntennaRequest(preset=preset).make()
    decoder, range_, _ = study.train(antenna, speed, lambda *_: None, Event(), study.UNSURE)
    touches, kinds = draw(range_, 200, 2)
    last = np.array([decoder.decode(one)[0][-1] for one in simulate(antenna, touches)])
    right = np.array([ANSWERS.index(kind) for kind in kinds]) == last.argmax(axis=1)
    assert np.mean((last[:, :3].max(axis=1) >= 0.9) & ~right) <= 0.05
    assert np.mean(last[:, 3]) <= 0.05


@pytest.mark.long
def test_a_decoder_that_comes_with_the_studio_holds_what_it_says_on_touches_of_its_own():
    antenna, speed = make_preset("exponential"), 0.06
    decoder, trained, scores = study.find_trained(antenna, speed)
    touches, kinds = trained.draw(24, 977)
    found = study._simulate(antenna, touches, lambda doing, share: None, Event())
    fresh = decoder.score(found, kinds)
    assert fresh["clean"] >= scores["clean"] - 3 * np.sqrt(0.25 / 24)
    assert fresh["confidently_wrong"] <= 0.05
    assert study.find_trained(antenna, 0.061) is None  # of no other speed
    assert study.find_trained(antenna.replace(name="mine"), speed) is None

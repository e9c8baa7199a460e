"""Streaming decoder: right posterior, honest states, tolerant of lost samples, intolerant of
nonsense.
"""

import numpy as np
import pytest

from feeler.decoding.streams import StreamDecoder
from feeler.errors import InvalidInput
from feeler.robot.stream import Link, _parse_sample, read_samples
from feeler.tensors.formats import _read_model, describe_file, find_problems, save_model

REST = 30
LABELS = [("ball", 0.5, 0.1), ("box", 0.5, 0.1), ("ball", 0.9, 0.1)]


def _touch(k, rest=REST, n=300):
    """Class k: all start alike, then part ways after 40 samples."""
    time = np.maximum(np.arange(n) - rest, 0.0)
    late = np.maximum(time - 40, 0.0)
    return np.stack(
        [
            0.01 * time,
            0.004 * time + (-1) ** k * 0.004 * late,
            0.002 * time - 0.003 * (k == 2) * late,
        ]
    )


TOUCHES = [_touch(k) for k in range(3)]


def _decoder(**options):
    return StreamDecoder(**{"window": 250, "correlation": 20.0, **options}).fit(TOUCHES, LABELS)


@pytest.mark.parametrize("k", range(3))
def test_answer_is_unsure_first_then_right(k):
    states = _decoder().replay(_touch(k))
    assert [s.state for s in states[:REST]] == ["waiting"] * REST
    seen = [s.state for s in states]
    assert seen.index("unsure") < seen.index("decided") and "over" not in seen[: REST + 200]
    assert states[-1].label == LABELS[k] and states[-1].probability > 0.99
    first = states[seen.index("unsure")]
    assert first.probability < 0.6 and first.since_contact == 0


def test_a_saved_decoder_answers_with_the_same_bits(tmp_path):
    rng = np.random.default_rng(1)
    noisy = [touch + rng.normal(0, 0.01, touch.shape) for touch in TOUCHES]
    for decoder in (_decoder(), _decoder(threshold=0.7, max_lag=4).temper(noisy, LABELS)):
        decoder.save(tmp_path / "d.safetensors")
        again = StreamDecoder.load(tmp_path / "d.safetensors")
        assert (
            again.classes_.tolist() == sorted(LABELS)
            and again.get_params() == decoder.get_params()
        )
        for one, other in zip(decoder.replay(noisy[1]), again.replay(noisy[1]), strict=True):
            np.testing.assert_array_equal(one.posterior, other.posterior)
            assert (one.state, one.label) == (other.state, other.label)
    assert find_problems(tmp_path / "d.safetensors") == []
    assert "kind StreamDecoder, version 1" in describe_file(tmp_path / "d.safetensors")[1]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"window": 10**6}, "do not fit arrays"),
        ({"onset": -1}, "onset > 0"),
        ({"threshold": 0.0}, r"threshold in \(0, 1\], got 0"),
        ({"interval": "inf"}, "interval > 0, got inf"),
        ({"colour": 1}, "colour"),
    ],
)
def test_a_decoder_whose_parts_do_not_fit_is_refused(tmp_path, change, message):
    _decoder().save(tmp_path / "d.safetensors")
    model = _read_model(tmp_path / "d.safetensors", trusted=True)
    model.settings["parameters"] |= change
    save_model(model, tmp_path / "d.safetensors")
    with pytest.raises(InvalidInput, match=f"no complete StreamDecoder .*{message}"):
        StreamDecoder.load(tmp_path / "d.safetensors", trusted=True)


@pytest.mark.parametrize("name", ["expected", "weight", "constant"])
def test_a_decoder_with_one_number_that_is_none_is_refused(tmp_path, name):
    _decoder().save(tmp_path / "d.safetensors")
    model = _read_model(tmp_path / "d.safetensors", trusted=True)
    values = model.arrays[name].copy()
    values.flat[0] = np.nan
    model.arrays[name] = values
    save_model(model, tmp_path / "d.safetensors")
    with pytest.raises(InvalidInput, match="its numbers are finite"):
        StreamDecoder.load(tmp_path / "d.safetensors", trusted=True)


def test_what_no_file_can_hold_is_not_saved(tmp_path):
    with pytest.raises(InvalidInput, match="holds a function, which no file can"):
        StreamDecoder(window=5, model=lambda tensor: [1.0, 0.0]).adopt(["a", "b"], 1).save(
            tmp_path / "d.safetensors"
        )


def test_posterior_equals_bayes_written_out():
    decoder = _decoder(max_lag=0, lag_step=1)
    stream = decoder.start()
    rng = np.random.default_rng(0)
    noisy = TOUCHES[1] + rng.normal(0, 0.002, TOUCHES[1].shape)
    states = [stream.update(sample) for sample in noisy.T]
    onset = next(i for i, s in enumerate(states) if s.since_contact == 0)
    seen = noisy[:, onset : onset + 100] - stream.finder.level[:, None]
    log = np.zeros(3)
    for c in range(3):
        variance = (decoder.noise * np.abs(decoder.expected_[c]).max()) ** 2 + 0.004**2
        error = seen - decoder.expected_[c][:, :100]
        log[c] = (
            np.sum(-0.5 * error**2 / variance - 0.5 * np.log(variance)) / decoder.correlation
        )
    expected = np.exp(log - log.max())
    np.testing.assert_allclose(
        states[onset + 99].posterior, expected / expected.sum(), rtol=1e-6
    )


def test_without_contact_it_waits_for_ever():
    rng = np.random.default_rng(1)
    states = _decoder().replay(rng.normal(0, 0.004, (3, 2000)))
    assert {state.state for state in states} == {"waiting"}
    assert states[-1].label is None and np.isnan(states[-1].probability)


def test_window_ends_and_reset_starts_again():
    decoder = _decoder(window=100)
    stream = decoder.start()
    states = [stream.update(sample) for sample in TOUCHES[0].T]
    assert states[-1].state == "over" and states[-1].label == LABELS[0]
    assert np.isfinite(stream.tensor).all()
    stream.reset()
    assert stream.update(TOUCHES[0][:, 0]).state == "waiting" and np.isnan(stream.tensor).all()


def test_lost_samples_are_counted_and_do_no_harm():
    decoder, rng = _decoder(), np.random.default_rng(2)
    kept = rng.random(300) > 0.2
    stream = decoder.start()
    time = 5000.0 + np.arange(300.0) + rng.uniform(-0.3, 0.3, 300)
    for k in np.flatnonzero(kept):
        state = stream.update(TOUCHES[1][:, k], time[k])
    assert (
        state.label == LABELS[1]
        and state.sample == np.flatnonzero(kept)[-1] - np.flatnonzero(kept)[0]
    )
    assert stream.missed == state.sample + 1 - kept.sum()


def test_a_missing_channel_is_passed_over():
    touch = TOUCHES[2].copy()
    touch[0] = np.nan
    assert _decoder().replay(touch)[-1].label == LABELS[2]


def test_what_is_decided_early_becomes_right_where_the_classes_part():
    decoder = _decoder()
    early, late = (decoder.decide([*TOUCHES, np.zeros((3, 100))], until=ms) for ms in (0, 200))
    assert np.isnan(late[-1]).all()  # nothing was felt
    right = [LABELS.index(label) for label in decoder.classes_.tolist()]
    late, early = late[:-1][:, np.argsort(right)], early[:-1].max(axis=1)
    assert late.argmax(axis=1).tolist() == [*range(len(TOUCHES))]
    assert (early < decoder.threshold).all() and (np.diag(late) >= decoder.threshold).all()


def test_tempering_makes_it_as_sure_as_it_is_right():
    rng = np.random.default_rng(3)
    alike = [TOUCHES[0], TOUCHES[0] + 1e-4 * TOUCHES[2]]
    labels = LABELS[:2]
    decoder = StreamDecoder(window=250, correlation=1.0, noise=0.01).fit(alike, labels)
    picks = [0, 0, 1, 1] * 6
    drawn = [
        alike[k] * (1 + 0.1 * rng.standard_normal()) for k in picks
    ]  # scale says nothing about the class
    others = [
        labels[k] for k in [0, 1] * 12
    ]  # each touch under both names: nothing can be known
    sure = [decoder.replay(touch)[-1].probability for touch in drawn]
    tempered = decoder.temper(drawn, others)
    assert tempered.correlation_ > 10
    assert np.mean([tempered.replay(touch)[-1].probability for touch in drawn]) < np.mean(sure)
    with pytest.raises(InvalidInput, match="temper needs touches with contact"):
        decoder.temper([np.zeros((3, 50))], labels[:1])


def _update(decoder, *samples):
    stream = decoder.start()
    for sample in samples:
        stream.update(*sample)


@pytest.mark.parametrize(
    "ends",
    [
        {"threshold": 1.0},
        {"noise": 0.0},
        {"max_lag": 0},
        {"window": 1, "confirm": 1, "correlation": 1, "lag_step": 1},
    ],
)
def test_the_ends_of_a_range_belong_to_it(ends):
    assert StreamDecoder(**ends).fit(TOUCHES, LABELS).classes_.size


def test_fifty_samples_too_many_at_the_start_are_left_out_and_one_more_is_refused():
    stream = _decoder().start()
    for _ in range(51):
        stream.update(np.zeros(3), 0.0)
    assert stream.surplus == 50
    with pytest.raises(InvalidInput, match="samples come faster than every 1 ms"):
        stream.update(np.zeros(3), 0.0)


@pytest.mark.parametrize("factor", [1e3, 1e6, 1e-3])
def test_times_in_another_unit_than_ms_are_refused_before_an_answer(factor):
    stream = _decoder().start()
    with pytest.raises(InvalidInput, match=r"samples come .* time_unit="):
        for k in range(60):
            assert stream.update(np.zeros(3), 1.6 * factor * k).state == "waiting"


def test_samples_that_waited_and_come_at_once_are_no_faster_sender():
    """A busy host stamps 300 samples of 1 kHz with the same ms, after a pause as long."""
    stream = _decoder().start()
    for k in range(1200):
        stream.update(np.zeros(3), float(k if k % 400 < 100 else k // 400 * 400 + 399))
    assert stream.surplus <= 50 and stream.slot == 1199


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda d: _update(d, (np.zeros(4),)), "a sample is 3 finite numbers"),
        (lambda d: _update(d, (np.full(3, np.inf),)), "a sample is 3 finite numbers"),
        (
            lambda d: _update(
                d, (np.zeros(3), 100.0), (np.zeros(3), 150.0), (np.zeros(3), 100.0)
            ),
            "time runs backwards",
        ),
        (lambda d: _update(d, (np.zeros(3), float("nan"))), "time must be finite"),
        (
            lambda d: StreamDecoder(model=lambda _: [1.0, 0.0]).fit(TOUCHES, LABELS),
            "adopt",
        ),
        (lambda d: d.fit(TOUCHES, LABELS[:2]), "3 touches and 2 labels"),
        (
            lambda d: d.fit([np.zeros((3, 9))] * 2, LABELS[:2]),
            "at least 2 classes with contact, got 0",
        ),
        (
            lambda d: d.fit([np.full((3, 9), np.nan)], LABELS[:1]),
            "with 27 entries that are not finite",
        ),
        (
            lambda d: StreamDecoder(threshold=1.5).fit(TOUCHES, LABELS),
            r"threshold in \(0, 1\], got 1.5",
        ),
        (lambda d: StreamDecoder(window=0).fit(TOUCHES, LABELS), "window ≥ 1, got 0"),
    ],
)
def test_bad_input(act, message):
    with pytest.raises(InvalidInput, match=message):
        act(_decoder())


@pytest.mark.parametrize(
    ("line", "time", "values"),
    [
        ("1,2,3", None, [1, 2, 3]),
        ("7.5; 1;2;nan", 7.5, [1, 2, np.nan]),
        (b"10\t1\t2\t3\r\n", 10.0, [1, 2, 3]),
        ("1 2 3\n", None, [1, 2, 3]),
    ],
)
def test_lines_of_samples(line, time, values):
    got_time, got = _parse_sample(line, 3)
    assert got_time == time
    np.testing.assert_array_equal(got, values)


def test_header_notes_and_blank_lines_are_passed_over():
    lines = ["# robot: A\n", "time_ms,hinge1_rad,hinge2_rad\n", "\n", "0,1,2\n", b"1,3,nan\n"]
    samples = list(read_samples(lines, 2))
    assert [time for time, _ in samples] == [0.0, 1.0]
    link = Link(2)
    assert len(list(read_samples(["0,1,2", "a,b,c"], 2, link))) == link.broken == 1
    assert "a sample must be numbers, got 'a'" in link.fault


def test_any_model_may_say_what_is_felt():
    """A model that has seen nothing but the sign of the last sample; before contact it is not
    asked.
    """
    asked = []

    def model(tensor):
        asked.append(np.isfinite(tensor[0]).sum())
        last = tensor[0, asked[-1] - 1]
        return np.array([0.95, 0.05]) if last > 0 else np.array([0.05, 0.95])

    decoder = StreamDecoder(window=20, model=model).adopt(["up", "down"], 3)
    samples = np.zeros((3, 30))
    samples[:, 10:] = 0.2
    samples[:, 20:] = -0.2
    states = decoder.replay(samples)
    assert [state.label for state in states[:12]] == [
        None
    ] * 12  # three samples confirm contact
    assert {state.label for state in states[12:20]} == {"up"} and {
        state.label for state in states[20:]
    } == {"down"}
    assert states[15].state == "decided" and states[15].probability == 0.95
    assert asked == [*range(1, 19)]


@pytest.mark.parametrize(("sure", "said"), [(0.75, "decided"), (0.74, "unsure")])
def test_who_just_reaches_the_threshold_is_decided(sure, said):
    decoder = StreamDecoder(
        window=9, threshold=0.75, model=lambda tensor: [sure, 1 - sure]
    ).adopt(["a", "b"], 1)
    states = decoder.replay(np.r_[np.zeros(5), np.ones(5)][None])
    assert {state.state for state in states if state.since_contact >= 0} == {said}


@pytest.mark.parametrize(
    ("model", "words"),
    [
        (lambda tensor: [0.5, 0.5, 0.5], "must give 2 probabilities"),
        (lambda tensor: [2.0, 1.0], "need a softmax"),
        (lambda tensor: [np.nan, 1.0], "must give 2 probabilities"),
        (None, "adopt needs model="),
    ],
)
def test_a_model_that_gives_no_probabilities_is_refused(model, words):
    with pytest.raises(InvalidInput, match=words):
        StreamDecoder(window=5, model=model).adopt(["a", "b"], 1).replay(
            np.r_[np.zeros(5), np.ones(5)][None]
        )


LENGTHS = (3.0, 2.0, 1.0)


def sides(**options):
    return _decoder(lengths=LENGTHS, **options)


@pytest.mark.parametrize("k", range(3))
def test_with_lengths_a_touch_of_the_other_side_is_its_mirror_image(k):
    touch = _touch(k)
    touch[:, 120] = np.nan
    for one, image in zip(sides().replay(touch), sides().replay(-touch), strict=True):
        assert (one.label, one.state) == (image.label, image.state)
        np.testing.assert_array_equal(one.posterior, image.posterior)
        assert image.mirrored == (one.since_contact >= 0) and not one.mirrored
    assert not _decoder().replay(-touch)[-1].mirrored


def test_training_touches_of_both_sides_are_one_class():
    mixed = [*TOUCHES, *(-touch for touch in TOUCHES)]
    both = StreamDecoder(window=250, correlation=20.0, lengths=LENGTHS).fit(mixed, LABELS * 2)
    np.testing.assert_array_equal(both.expected_, sides().expected_)


def test_evidence_counts_anew_once_the_first_deflection_is_to_the_other_side():
    """A small twitch to one side, then a touch of the other: the twitch decides nothing."""
    touch = np.concatenate([np.zeros((3, REST)), _touch(1, rest=4)], axis=1)
    touch[:, REST : REST + 6] = -0.03
    decoder = sides(onset=0.02)
    stream = decoder.start()
    states = [stream.update(sample) for sample in touch.T]
    seen = [state.mirrored for state in states if state.since_contact >= 0]
    assert seen[0] and not seen[-1] and sum(np.diff(seen)) == 1
    felt = np.isfinite(stream.tensor[0]).sum()
    again = decoder.start()
    again.finder.level[:], again.contact, again.slot = 0.0, 0, -1
    again.mirrored, again._turns = False, lambda *_: False
    for since in range(felt):
        again._weigh(stream.tensor[:, since], since)
    np.testing.assert_allclose(again.posterior, states[-1].posterior, rtol=1e-9)
    stream.reset()
    assert stream.update(np.zeros(3)).mirrored is False


def test_lengths_are_kept_in_a_file_and_must_fit(tmp_path):
    sides().save(tmp_path / "it")
    loaded = StreamDecoder.load(tmp_path / "it")
    assert loaded.lengths == LENGTHS
    state = loaded.replay(-_touch(1))[-1]
    assert state.label == LABELS[1] and state.mirrored
    _decoder().save(tmp_path / "plain")
    assert StreamDecoder.load(tmp_path / "plain").lengths is None
    for wrong in ((1.0, 2.0), (1.0, 2.0, 0.0), (1.0, 2.0, np.inf)):
        with pytest.raises(InvalidInput, match=r"lengths must be 3 finite numbers > 0 \[mm\]"):
            _decoder(lengths=wrong)
    with pytest.raises(InvalidInput, match="lengths must be 2 finite numbers"):
        StreamDecoder(model=lambda _: [1.0, 0.0], lengths=LENGTHS).adopt(["a", "b"], 2)

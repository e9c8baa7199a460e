"""What a legend, a title, a sentence or a value names is what it holds: sections are shown planted
numbers of which no two are equal, at scales that the smoke run does not reach too.
"""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from scipy import stats

from feeler.active.contests import load_contest
from feeler.analysis import INDICES, Interval
from feeler.decoding.sweeps import Sweep
from feeler.errors import InvalidInput
from feeler.report import Section
from feeler.robot.recordings import Recording
from paper import (
    fig1,
    fig1_animal,
    fig1_compliance,
    fig1_touch,
    fig2b,
    fig2b_fit,
    fig2e,
    fig3,
    fig3_family,
    fig4,
    fig4a,
    fig5,
    fig5_bending,
    fig5_complete,
    fig5_conditions,
    fig5_speed,
    fig5f,
    fig6,
    fig6_data,
    figS2,
    figS5,
    figS6,
    movieS2,
    movieS3,
    story,
)
from paper.claims import load_claims
from paper.verdicts import EVIDENCE, Judged, judge_statements
from paper.window import WINDOWS
from studies.active import section as open_active
from studies.active.section import load_stored
from studies.bounds import section as open_bounds
from studies.design import section as open_design
from studies.gradient import section as open_gradient
from studies.speed import section as open_speed

CONTEXT = SimpleNamespace(effort=SimpleNamespace(robot_repeats=2), seed=0, engine="")


@pytest.fixture
def section(monkeypatch):
    """A section that draws and keeps nothing."""
    for drawn in ("figure", "numbers"):
        monkeypatch.setattr(Section, drawn, lambda *_, **__: None)
    return Section(name="some", title="Some", folder=None)


def list_words(section):
    return " ".join(block["text"] for block in section.blocks if block["kind"] == "text")


def read_curves(ax):
    """What is drawn, by its name in the legend."""
    handles, labels = ax.get_legend_handles_labels()
    return {
        label: line.get_ydata().tolist() for label, line in zip(labels, handles, strict=True)
    }


def make_sweep(area, **more):
    """A sweep of two repeats whose accuracy is ``area`` in each of four classes."""
    counts = 300 * np.where(np.eye(4), area, (1 - area) / 3)[None]
    parts = {"ratios": np.array([0.2]), "classes": np.arange(4), "hits": np.zeros((1, 2, 4))}
    parts |= {"confusion": counts, "kept_noisy": counts[0], "kept_clean": counts[0]}
    return Sweep(**parts | {"noisy": np.full((1, 2), area)} | more)


def test_the_decoder_s_curves_have_the_names_of_what_they_show():
    parts = {"accuracy": [0.1, 0.2, 0.3], "decided": [0.4, 0.5, 0.6]}
    parts |= {"decided_right": [0.7, 0.8, 0.9], "since_contact": [0, 50, 100]}
    fig6._plot_early(SimpleNamespace(early=SimpleNamespace(**parts)), ax := Figure().subplots())
    names = ("surrogate: best guess right", "decided", "of those, right")
    assert read_curves(ax) == dict(zip(names, list(parts.values())[:3], strict=True))


def test_bases_are_counted_from_one_beside_their_codes():
    code = np.array([[0.0, 2.0, 4.0], [8.0, 1.0, 0.0]])
    data = SimpleNamespace(examples={"ball 0.5": code}, sampling=0.7)
    fig4._plot_examples(data, axes := Figure().subplots(1, 1, squeeze=False))
    np.testing.assert_allclose(
        axes[0, 0].lines[1].get_xdata(), [0, 0.7, 1.4]
    )  # ms, not samples
    assert read_curves(axes[0, 0]) == {
        "basis 1": [0.0, 0.25, 0.5],
        "basis 2": [1.0, 0.125, 0.0],
    }


def test_both_blows_are_drawn_from_their_own_turning_point(monkeypatch):
    """The lever's and the straight one's, which come at other times."""
    time = np.arange(40.0)
    peaks = iter((12.0, 25.0))
    free = SimpleNamespace(peak_time=3.0)
    tip = xr.DataArray(
        np.ones((1, 40, 2)), dims=("trial", "time", "axis"), attrs={"units": "mm"}
    )
    found = xr.Dataset({"tip": tip}, {"time": ("time", time, {"units": "ms"})})
    monkeypatch.setattr(fig2b, "release", lambda *_, **__: found)
    monkeypatch.setattr(fig2b, "measure_free_response", lambda *_: free)
    monkeypatch.setattr(
        fig2b,
        "hit",
        lambda *_, **__: SimpleNamespace(time=time, tip=np.exp(-np.abs(time - next(peaks)))),
    )
    data = fig2b.compute()
    for at, moved in ((data.impulse_time, data.impulse), (data.slow_time, data.slow)):
        assert at[np.argmin(moved)] == 0.0
        assert moved.min() == -1.0


def test_axes_say_which_way_is_more_dispersed():
    one = Interval(estimate=0.5, low=0.4, high=0.6)
    found = SimpleNamespace(
        groups=("slow", "fast"),
        values=lambda index, group: np.array([0.5]),
        average={index: {"slow": one, "fast": one} for index in INDICES},
    )
    figS6.plot(SimpleNamespace(dispersions={"speed": {"raw": found}}), figure := Figure())
    words = [ax.get_ylabel() for ax in figure.axes if ax.get_ylabel()]
    assert words == [
        f"{known.label}\n{'low' if known.is_similarity else 'high'}: more dispersed"
        for known in INDICES.values()
    ]
    assert {known.is_similarity for known in INDICES.values()} == {True, False}


def test_boxes_stand_above_the_name_of_their_side():
    peaks = np.deg2rad([[10.0, 50.0], [20.0, 70.0]]) * 1e-3
    data = SimpleNamespace(exploration=SimpleNamespace(mean_peak=peaks))
    figS2._plot_box(data, ax := Figure().subplots())
    assert [tick.get_text() for tick in ax.get_xticklabels()] == ["left", "right"]
    dots = {
        line.get_xdata()[0]: line.get_ydata() for line in ax.lines if line.get_marker() == "."
    }
    np.testing.assert_allclose([dots[1.0], dots[2.0]], [[10, 20], [50, 70]])


def test_where_a_touch_bends_most_is_drawn_over_where_it_touches():
    window = SimpleNamespace(share=np.array([[0.2, 0.8], [0.6, 0.4]]), top=np.array([0.3, 0.1]))
    antenna = SimpleNamespace(hinge_position=np.array([0.0, 5.0]), length=10.0)
    antenna.sensors = np.array([1, 2])
    data = {"exponential": dict.fromkeys(WINDOWS, window)}
    fig5_bending.plot(
        data, {"exponential": antenna}, np.array([0.5, 0.9]), figure := Figure(figsize=(7, 3))
    )
    _, middle, _ = figure.axes
    (dots,) = (line for line in middle.lines if line.get_label() == "exponential")
    np.testing.assert_allclose(dots.get_xydata(), [[50, 30], [90, 10]])
    assert middle.get_xlabel().startswith("contact")
    assert middle.get_ylabel().startswith("bends most")


def test_ratios_stand_below_their_own_names(section):
    fig2b_fit._show_impactor(section, [(0.2, None, np.array([0.11, 0.22]))])
    table = section.blocks[-1]
    row = dict(zip(table["header"], table["rows"][0], strict=True))
    assert (row["path"], row["speed [m/s]"]) == ("straight", "0.2")
    assert (row["ratio_71"], row["ratio_86"]) == ("0.11", "0.22")


def test_restarts_agree_to_their_own_ends(section):
    """With shifts and without: four numbers, none of them equal."""
    planted = {
        "stability": np.array([0.91, 0.97]),
        "stability_in_place": np.array([0.42, 0.63]),
    }
    planted["ranked"] = np.array([0.83, 0.71, 0.64]), np.array([0.21, 0.35, 0.48])
    nothing = {"ranks": (), "residual": (), "entropy": {}}
    fig4._show_ranks(section, SimpleNamespace(**planted, **nothing, tensor_sparseness=0.5))
    words = list_words(section)
    assert (
        "cosine of at least 0.83; two different ones of it are alike to at most 0.21." in words
    )
    assert "bases to 0.91…0.97" in words
    assert "same lags to 0.42…0.63" in words


def test_durations_say_the_likeness_along_and_of_the_whole(section, monkeypatch):
    starts = dict(zip((figS5.ALONG, figS5._ALL), np.array([[0.91], [0.62]]), strict=True))
    others = dict(zip((figS5.ALONG, figS5._ALL), np.array([[0.33], [0.14]]), strict=True))
    found = SimpleNamespace(least=starts, others=others, profile_similarity=0, residual=0)
    found.basis_similarity = 0
    monkeypatch.setattr(figS5, "list_profiles", lambda _: ["exponential"])
    monkeypatch.setattr(figS5, "load_tensors", lambda *_: None)
    monkeypatch.setattr(figS5, "load", lambda _: SimpleNamespace(encoders={}))
    monkeypatch.setattr(figS5, "compute", lambda *_, **__: found)
    figS5.show(SimpleNamespace(effort=SimpleNamespace(durations=(10, 40)), seed=0), section)
    words = list_words(section)
    assert "at least 0.91 (two different bases of 40 ms to at most 0.33)" in words
    assert "cosine is at least 0.62 (at most 0.14)" in words


def test_each_profile_along_the_antenna_loses_its_own_mean():
    """Two bases of three sensors and two lags; flat ones have no shape left."""
    bases = np.array([[[1.0, 2.0], [0.0, 0.0], [4.0, 2.0]], [[5.0, 5.0]] * 3])
    assert figS5._sum_lags(bases)[..., 0].tolist() == [[0, -3, 3], [0, 0, 0]]


def test_walls_that_slid_are_counted_and_told_apart_at_both_limits(section, monkeypatch):
    asked = []
    monkeypatch.setattr(
        fig3,
        "_compute_unique_share",
        lambda touch, apart: asked.append((touch, apart)) or apart,
    )
    shape = {
        "wall": 0,
        "points": 0,
        "contact": np.array([1, 1, 1]),
        "inverted": np.array([1, 0, 0]),
    }
    monkeypatch.setattr(fig3.Shapes, "of_slides", lambda _: SimpleNamespace(**shape))
    fig3._show_slides(
        section, SimpleNamespace(far_slides={"linear": "far"}, default_slides="own")
    )
    assert "linear 1 of 3" in list_words(section)
    tenth, twentieth = fig3.APART, fig3.APART / 2
    assert asked == [("far", tenth), ("far", twentieth), ("own", tenth), ("own", twentieth)]
    assert section.values[f"wall.{fig3.DEFAULT}.unique_share.twentieth"] == twentieth


def test_the_robot_s_slow_and_fast_touches_keep_their_names(section, monkeypatch):
    """Speeds are listed from the fastest on, and slow touch is claimed to be the more dispersed."""

    def make(value):
        return {
            index: Interval(estimate=value, low=value - 0.01, high=value + 0.01)
            for index in INDICES
        }

    found = {
        "speed": {"0.27 m/s": make(0.8), "0.135 m/s": make(0.5), "0.027 m/s": make(0.2)},
        "profile": {"constant": make(0.7), "linear": make(0.3)},
    }
    monkeypatch.setattr(fig6, "compute_comparison", lambda **_: found)
    fig6._compare(CONTEXT, section)
    said = {
        name: section.values[f"robot.nmi.{name}"]["value"]
        for name in ("slow", "fast", "graded", "constant")
    }
    assert said == {"slow": 0.2, "fast": 0.8, "graded": 0.3, "constant": 0.7}
    similar = np.mean([known.is_similarity for known in INDICES.values()])
    assert section.values["robot.agree.speed"]["value"] == similar


def test_indices_agree_only_where_intervals_lie_apart(section, monkeypatch):
    """The first index lies apart in the order that is claimed, the others' intervals overlap."""
    signs = {name: 1 if known.is_similarity else -1 for name, known in INDICES.items()}
    apart, *_ = INDICES

    def make(middle):
        half = {name: 0.1 if name == apart else 0.4 for name in INDICES}
        return {
            name: Interval(
                estimate=sign * middle,
                low=sign * middle - half[name],
                high=sign * middle + half[name],
            )
            for name, sign in signs.items()
        }

    ends = {"slow": make(0.2), "fast": make(0.8)}
    fig6._keep_agreement(section, "speed", ends)
    assert section.values["robot.agree.speed"]["value"] == 1 / len(INDICES)
    fig6._keep_agreement(section, "speed", dict(zip(ends, [*ends.values()][::-1], strict=True)))
    assert section.values["robot.agree.speed"]["value"] == 0


def test_what_is_negative_is_a_share_of_all():
    assert fig2e._negative_share(np.array([-1.0, 0.0, 2.0])) == pytest.approx(1 / 5)


def test_quiet_is_the_least_of_the_noises():
    asked = {"relative": (0.1, 0.4), "common": (0.01, 0.05)}
    keys = [("ball", kind, size) for kind, sizes in asked.items() for size in sizes]
    squares = {key: np.full((3, 3), (2.0 + k) ** 2) for k, key in enumerate(keys)}
    bounds = {key: np.ones((3, 3)) for key in keys}
    swapped = {key: squares[other] for key, other in zip(keys, reversed(keys), strict=True)}
    for errors, least, quiet in ((squares, 2.0, 2.0), (swapped, 2.0, 3.0)):
        found = open_bounds._measure(errors, bounds, asked, np.arange(3))
        assert found["bounds.ratio.size"] == pytest.approx(least)
        assert found["bounds.ratio.size.quiet"] == pytest.approx(quiet)


def test_kept_variance_is_said_of_what_it_was_kept_of():
    kept = {"kept_clean": np.array([[0.5, 0.6]]), "kept_noisy": np.array([[0.91, 0.93]])}
    first = make_sweep(0.7, ratios=np.array([fig5.KEPT_AT[0]]), **kept)
    curves = SimpleNamespace(find=lambda kind: {"slow": first})
    values = fig5._collect_values({"speed": curves}, {}, 2)
    said = {
        name: values[f"classification.pca.{name} at 10 % noise"]["value"]
        for name in ("clean codes", "noisy copies")
    }
    assert said == pytest.approx({"clean codes": 0.55, "noisy copies": 0.92})


def test_every_reading_stands_beside_its_own_null(section, monkeypatch):
    """Complete touches beside identical complete touches, not beside those in the window."""
    curves = SimpleNamespace(
        find=lambda kind: {"exponential": make_sweep(0.6)},
        find_null=lambda kind: make_sweep(0.2),
    )
    monkeypatch.setattr(
        fig5_speed, "load", lambda _: SimpleNamespace(curves={"profile": curves})
    )
    monkeypatch.setattr(fig5_speed, "name_speeds", lambda _: {})
    section.values |= {
        "classification.lda.exponential": {"value": 0.5},
        "classification.null.exponential": {"value": 0.4},
    }
    complete = {"exponential": {"value": 0.9}}
    fig5_speed._keep_values(CONTEXT, section, "profile", complete, {"value": 0.3})
    readings = (fig5_speed.JOINT_CODES, *fig5_speed.TENSORS)
    pairs = [
        tuple(
            section.values[f"lda.{part}{reading}.exponential"]["value"]
            for part in ("", "null.")
        )
        for reading in readings
    ]
    np.testing.assert_allclose(pairs, [(0.5, 0.4), (0.6, 0.2), (0.9, 0.3)])


def test_what_the_window_cuts_stands_in_its_own_column_and_under_its_own_name(section):
    parts = {"end": 512.0, "cut": 7, "again": 3, "pairs": 2, "ceiling": 0.9}
    sweeps, cut = make_sweep(0.8), make_sweep(0.4)
    ends = {"estimate": 0.3, "low": 0.2, "high": 0.35}
    data = SimpleNamespace(
        windows={"linear": SimpleNamespace(**parts)},
        peaks={"constant": 0.02, "linear": 0.112},
        sweeps={noise: {"linear": sweeps} for noise in ("relative", "common")},
        dispersion=SimpleNamespace(
            average={index: {"linear": Interval(**ends)} for index in INDICES},
            values=lambda *_: np.zeros(9),
        ),
    )
    fig5_complete._tabulate(section, data)
    row = dict(zip(section.blocks[-1]["header"], section.blocks[-1]["rows"][0], strict=True))
    assert row == {
        "profile": "linear",
        "lets go at the latest [ms]": "512",
        "cut by the window": "7",
        "of these, out of contact at its end": "3",
        "identical pairs": "2",
        "ceiling": "0.9",
    }
    for name, value in parts.items():
        assert section.values[f"window.{name}.linear"] == value
    section.values |= {f"dispersion.tensor.{index}.linear": {"value": 0.6} for index in INDICES}
    before = {noise: {"linear": cut} for noise in data.sweeps}
    fig5_complete._keep_values(section, data, before)
    assert "all antennas, 0.112 rad (linear)" in section.blocks[-2]["text"]
    assert section.values["complete.peak.constant"] == 0.02
    for noise in data.sweeps:
        assert section.values[f"complete.{noise}.linear"]["value"] == pytest.approx(0.8)
        assert section.values[f"cut.{noise}.linear"]["value"] == pytest.approx(0.4)
    for index in INDICES:
        found = [section.values[f"dispersion.{window}.{index}.linear"] for window in WINDOWS]
        assert [one["value"] for one in found] == [
            0.6,
            0.3,
        ]  # first the paper's, then the whole
        assert (found[1]["low"], found[1]["high"]) == (0.2, 0.35)
    assert {cells[1] for cells in section.blocks[-1]["rows"]} == {"0.6 → 0.3"}


def test_what_is_read_by_chance_and_over_which_spacing_is_that_of_the_same_question():
    """Neighbours are 0.7 mm apart: of every third sensor, 2.1 mm. 5 places, 12 things."""

    def make(value):
        return {"value": value, "low": value - 0.01, "high": value + 0.02}

    reading = SimpleNamespace(
        place={1: make(0.5), 3: make(0.3)},
        thing={100.0: make(0.4), 500.0: make(0.8)},
        chance={"place": 1 / 5, "thing": 1 / 12},
    )
    active = SimpleNamespace(active={"threshold 1 rad": make(9.0)}, noise=make(0.05))
    data = SimpleNamespace(reading=reading, activity={1.0: active, 4.0: active})
    fig1.plot(data, 0.7, figure := Figure())
    first, second, *_ = figure.axes
    np.testing.assert_allclose(first.lines[0].get_xydata(), [[0.7, 50], [2.1, 30]])
    np.testing.assert_allclose(second.lines[0].get_xydata(), [[100, 40], [500, 80]])
    bars = first.collections[0].get_segments()
    np.testing.assert_allclose(bars, [[[0.7, 49], [0.7, 52]], [[2.1, 29], [2.1, 32]]])
    for ax, chance in ((first, 20), (second, 100 / 12)):
        (line,) = (line for line in ax.lines if line.get_label() == "chance")
        np.testing.assert_allclose(line.get_ydata(), chance)


def test_speed_and_location_are_right_whatever_the_feature_is(section):
    """One of four touches is named whole, two are right but for the feature, one but for the last
    of its labels.
    """
    true = [("ball", 0.27, 0.9), ("ball", 0.27, 0.8), ("box", 0.1, 0.9), ("box", 0.1, 0.8)]
    told = [("ball", 0.27, 0.9), ("box", 0.27, 0.8), ("box", 0.1, 0.7), ("ball", 0.1, 0.8)]
    score = SimpleNamespace(
        true=true, predicted=told, share=lambda _: (0.25, 0.1, 0.4), total=4
    )
    score.correct = {"all": 1}
    fit = SimpleNamespace(stiffness_factor=1.1, damping_factor=1.2, error=0.03)
    data = SimpleNamespace(
        score=score,
        sizes=(1.0,),
        by_size=[score],
        variants=(2,),
        by_variants=[score],
        shots=(),
        by_shots=[],
        fit=fit,
        calibration=SimpleNamespace(resolution=np.radians([0.2, 0.7, 0.3])),
    )
    fig6._list_scores(SimpleNamespace(effort=SimpleNamespace(robots=3)), section, data)
    names = ("speed_location", "p1", "p2", "fit_error", "resolution")
    said = [section.values[f"robot.{name}"] for name in names]
    assert said == pytest.approx([0.75, 1.1, 1.2, 0.03, 0.7])


def test_only_what_is_evidence_is_counted_and_only_that_can_fail():
    """The first screen's counts, of claims that are all reproduced but those of one effect."""
    claims = load_claims()
    lost = next(c for c in claims if c.whose == "paper" and c.can_fail and c.effect)
    judged = [
        Judged(
            claim=c,
            verdict="not reproduced" if c.effect == lost.effect else "reproduced",
            ours="",
            why="",
        )
        if c.can_fail
        else Judged(claim=c, verdict="by construction", ours="", why="")
        for c in claims
    ]
    shown = {}
    templates = SimpleNamespace(opening=lambda *_, **parts: shown.update(parts))
    story.open_report(templates, [], judged)
    words = judge_statements(judged)
    told = [word for word in words.values() if word in EVIDENCE]
    assert len(told) < len(words)
    assert shown["held"] == [told.count(word) for word in EVIDENCE]
    assert shown["stated"] == len(words)
    assert len(shown["failed"]) == len(told) - told.count("reproduced") > 0


def test_an_antenna_of_one_s_own_is_not_held_against_the_paper_s_wall(section, monkeypatch):
    """The paper names no R² of it: the section goes on without the family, where it broke off."""
    monkeypatch.setattr(
        fig3_family, "load", lambda _: SimpleNamespace(sweeps={"cricket": None})
    )
    fig3_family.show(CONTEXT, section)
    assert section.blocks == []


def test_a_contest_made_anew_is_told_beside_what_is_stored_in_points(section, monkeypatch):
    """They are equal where all is well, and then no factor shows."""
    monkeypatch.setattr(
        type(load_contest()),
        "make_observer",
        lambda *_: SimpleNamespace(run=lambda *_: SimpleNamespace(accuracy=[0.4, 0.93])),
    )
    open_active.show(SimpleNamespace(is_cockroach=True, effort=SimpleNamespace()), section)
    stored = load_stored(load_contest())["measured"]["accuracy"]
    kept = float(stored.sel(policy="fixed:1.2").isel(set=0, deadline=0))
    assert section.values["active.again"] == pytest.approx(93 - 100 * kept)
    assert abs(kept - 0.93) > 0.01
    assert f"93.000 % now, {100 * kept:.3f} % stored" in list_words(section)


def test_a_movie_s_panels_and_words_name_the_speed_of_their_own_touch(section, monkeypatch):
    filmed, told = {}, []
    tensors = SimpleNamespace(sel=lambda time: time)
    monkeypatch.setattr(movieS2, "touch", lambda *_, **__: tensors)
    monkeypatch.setattr(
        movieS2, "write_touches_movie", lambda _, found, *__, **___: filmed.update(found)
    )
    monkeypatch.setattr(
        movieS2, "write_touch_movie", lambda _, trial, *__, **___: told.append(trial.speed)
    )
    monkeypatch.setattr(Section, "movie", lambda _, path, words: told.append(words))
    effort = SimpleNamespace(
        fps=3, speeds=("slow", "fast", "medium"), movie_speeds=("fast", "slow")
    )
    section.folder = Path()
    movieS2.show(SimpleNamespace(effort=effort, antenna=None, physics={}), section)
    assert {*filmed} == {
        f"{name}\n{trial.speed:g} m/s"
        for name, (trial, _) in zip(("medium", "fast", "slow"), filmed.values(), strict=True)
    }
    assert len({trial.speed for trial, _ in filmed.values()}) == 3
    for speed, words in zip(told[1::2], told[2::2], strict=True):
        assert f"at {speed:g} m/s" in words


def test_every_code_s_row_stands_below_its_own_headers(section, monkeypatch):
    """In the smoke run the information reaches its ceiling, so that no exchange of both shows."""
    monkeypatch.setattr(fig4.fig4_map, "keep_values", lambda *_: None)
    names = ("information", "ceiling", "information_null", "p_information")
    planted = {
        code: SimpleNamespace(**{name: 10 * k + n for n, name in enumerate(names)})
        for k, code in enumerate(("joint", "ridge"), 1)
    }
    residual, sparseness = {"joint": 0.25, "ridge": 0.5}, {"joint": 0.125, "ridge": 0.75}
    fig4._show_codes(
        section,
        SimpleNamespace(
            mapping=planted,
            residual_by_code=residual,
            sparseness_by_code=sparseness,
            starts=None,
        ),
    )
    (table,) = (block for block in section.blocks if block["kind"] == "table")
    rows = [dict(zip(table["header"], row, strict=True)) for row in table["rows"]]
    for row, code in zip(rows, planted, strict=True):
        found = planted[code]
        wanted = {
            "code": fig4.LABELS[code],
            "residual": residual[code],
            "Hoyer sparseness": sparseness[code],
            "information on location [bits]": found.information,
            "of at most": found.ceiling,
            "under permutation": found.information_null,
            "p": found.p_information,
        }
        assert row == {name: str(value) for name, value in wanted.items()}


def test_a_speed_s_best_accuracy_and_its_interval_are_in_percent():
    dims = {"set": 3, "speed": 2, "level": 2, "window": 6}
    rng = np.random.default_rng(8)
    windows = ["whole touch", "7 mm, 5 samples", "30 ms", "20 ms", "50 ms", "90 ms"]
    fields = {
        name: (tuple(dims), rng.uniform(0.3, 0.7, tuple(dims.values())))
        for name in ("bits", "accuracy")
    }
    fields |= {name: (("set", "speed"), np.ones((3, 2))) for name in ("work", "force")}
    coords = {"speed": [0.1, 0.4], "level": ["a", "b"], "window": windows}
    coords |= {name: ("window", np.arange(6)) for name in ("kind", "value")}
    measured = {"exponential": xr.Dataset(fields, coords)}
    study = SimpleNamespace(
        shown={"common": "b"},
        windows={"matched_distance": 7, "matched_samples": 5, "deadlines": [20, 90]},
        sets=3,
        headline={"common": 0.02},
    )
    found = open_speed._collect_values(measured, study)
    for deadline in (20, 90):
        own = 100 * measured["exponential"]["accuracy"].sel(level="b", window=f"{deadline} ms")
        best = own.isel(speed=int(own.mean("set").argmax("speed"))).values
        half = stats.t.ppf(0.975, 2) * best.std(ddof=1) / np.sqrt(3)
        said = found[f"tradeoff.accuracy.{deadline}"]
        assert said["value"] == pytest.approx(best.mean())
        ends = [best.mean() - half, best.mean() + half]
        assert [said["low"], said["high"]] == pytest.approx(ends)


def test_speeds_in_the_paper_s_window_and_of_whole_touches_stand_under_their_own_names(
    monkeypatch,
):
    drawn = {}
    monkeypatch.setattr(
        fig5_speed, "plot_sweep", lambda sweep, ax, **_: drawn.setdefault(sweep.name, ax)
    )
    cut, whole = (
        {"0.1 m/s": SimpleNamespace(name=name, chance=0.2)} for name in ("cut", "whole")
    )
    figure = Figure()
    fig5_speed.plot(cut, whole, figure)
    titles = [drawn[name].get_title() for name in ("cut", "whole")]
    assert titles == list(WINDOWS) and "complete" in titles[1]
    assert [ax.get_title() for ax in figure.axes] == titles


def test_the_touch_that_is_taken_apart_is_the_slow_one_of_the_smaller_ball(monkeypatch):
    monkeypatch.setattr(fig4a, "prepare", lambda chosen: chosen["number"].values)
    monkeypatch.setattr(fig4a, "reconstruct", lambda bases, code: code)
    columns = {
        "feature": ["box", "ball", "ball", "ball", "ball", "ball"],
        "location": [0.4, 0.4, 0.4, 0.7, 0.4, 0.4],
        "speed": [0.1, 0.3, 0.1, 0.1, 0.1, 0.3],
        "size": [1.0, 0.5, 2.0, 0.6, 1.5, 3.0],
        "number": [0, 1, 2, 3, 4, 5],
    }
    tensors = xr.Dataset({name: ("trial", values) for name, values in columns.items()})
    data = SimpleNamespace(
        examples={"box 0.4": np.zeros(2), "ball 0.4": np.ones(2)},
        ranks=[7],
        encoders={7: SimpleNamespace(components_=np.ones(3))},
    )
    assert fig4a.take(data, tensors).touch == 4


def test_a_sensor_of_the_drawing_stands_at_its_own_hinge(monkeypatch):
    points = np.arange(12.0).reshape(6, 2) ** 2
    found = SimpleNamespace(values=points[None, None])
    monkeypatch.setattr(fig1_compliance, "reconstruct_posture", lambda *_: found)
    placed = SimpleNamespace(origin=np.zeros(2), velocity=np.zeros(2), forward=None)
    monkeypatch.setattr(fig1_compliance, "place", lambda *_: placed)
    monkeypatch.setattr(fig1_compliance, "make_patch", lambda *_: Circle((0, 0), 1.0))
    monkeypatch.setattr(fig1_compliance, "plot_posture", lambda *_, **__: None)
    monkeypatch.setattr(fig1_compliance, "in_unit", lambda *_: SimpleNamespace(values=[0.0]))
    antenna = SimpleNamespace(sensors=np.array([1, 3, 5]), length=9.0)  # counted from 1
    ax = Figure().subplots()
    active, trial = np.array([True, False, True]), SimpleNamespace(shape=None)
    fig1_compliance._draw(antenna, trial, {"time": None}, 0, active, ax)
    silent, felt = (line.get_xydata() for line in ax.lines)
    np.testing.assert_array_equal(silent, points[[2]])
    np.testing.assert_array_equal(felt, points[[0, 4]])


@pytest.mark.parametrize(
    ("own", "moved", "said"),
    [
        (0.4, [0.61, 0.3, 0.5, 0.42], "R² of soft lies between 0.3 and 0.61 as every"),
        (0.7, [0.61, 0.5, 0.5, 0.42], "R² of soft lies between 0.42 and 0.7 as every"),
        (np.nan, [np.nan] * 4, ""),
        (0.4, [0.4, np.nan, 0.4, 0.4], ""),
    ],
)
def test_how_far_a_hair_moves_r2_is_said_where_there_is_a_map(monkeypatch, own, moved, said):
    monkeypatch.setattr(fig3, "_row", lambda name, _: [name])
    texts = []
    section = SimpleNamespace(table=lambda *_: None, text=texts.append)
    maps = {"soft": SimpleNamespace(r2=own)}
    data = SimpleNamespace(maps=maps, default_maps=maps, straight=maps, moved_r2=moved)
    fig3._list_maps(section, data)
    assert (said in texts[0]) if said else not texts


def test_a_set_up_is_near_the_paper_s_by_what_r2_leaves_unexplained():
    """Left are a fifth, twice and ten times as much as in the paper; a factor of 2.1 is near."""
    r2 = np.array([[0.99, 0.5], [0.9, 0.3], [0.5, 0.2]])
    family = fig3_family.Family(
        names=("a", "b"), choices=(), r2=r2, offset=np.full((3, 2), np.nan), cases=()
    )
    values = fig3_family._list_values(family, {"a": 2.1, "b": 1.01}, {"a": 0.95, "b": 0.6})
    assert values["wall.family.a"]["value"] == pytest.approx(1 / 3)


def test_a_profile_s_entropy_is_the_mean_of_its_bases_spread_over_restarts(section):
    values = np.array([[1.0, 2.0, 6.0], [2.0, 3.0, 7.0]])  # (restart, basis)
    fig5f._keep_values(section, {WINDOWS[0]: {"some": {"exponential": values}}})
    found = section.values["encoding.basis_entropy.some.exponential"]
    assert (found["low"], found["high"]) == (3.0, 4.0)


def test_every_number_of_the_gradient_stands_below_its_own_header(section, monkeypatch):
    noises = list(open_gradient.UNITS_OF_NOISE)
    shape, dims = (2, 1, 1, len(noises)), ("set", "rate", "speed", "noise")
    rng = np.random.default_rng(0)
    data = xr.Dataset(
        {name: (dims, rng.random(shape)) for name in ("bits", "noise75", "within")}
        | {"peak": (dims[:3], rng.random(shape[:3]))},
        {"rate": [-0.08], "speed": [0.3], "noise": noises},
    )
    asked = {"seed": 0, "draws": 1, "sets": 2}
    for name, given in (("read_declared", asked), ("load_declared", None), ("compute", data)):
        monkeypatch.setattr(open_gradient, name, lambda *_, given=given, **__: given)
    monkeypatch.setattr(open_gradient, "_collect_values", lambda data: {})
    effort = SimpleNamespace(gradient={})
    context = SimpleNamespace(antenna=None, effort=effort, physics={})
    open_gradient.show(context, section)
    (table,) = (block for block in section.blocks if block["kind"] == "table")
    row = dict(zip(table["header"], table["rows"][0], strict=True))
    for kind, unit in open_gradient.UNITS_OF_NOISE.items():
        mean = data.isel(rate=0, speed=0).sel(noise=kind).mean("set")
        assert float(row[f"bits, {kind}"]) == pytest.approx(float(mean["bits"]), rel=0.01)
        known = float(row[f"bits, place known, {kind}"])
        assert known == pytest.approx(float(mean["within"]), rel=0.01)
        noise = float(row[f"75 % noise [{unit}], {kind}"])
        assert noise == pytest.approx(float(mean["noise75"]), rel=0.01)


def test_antennae_are_shown_after_a_push_and_speeds_after_a_time(section, monkeypatch):
    captions = []
    monkeypatch.setattr(
        Section, "figure", lambda _, name, caption, *a, **k: captions.append(caption)
    )
    monkeypatch.setattr(fig5_conditions, "_collect", lambda context: {"profiles": {}})
    fig5_conditions.show(None, section)
    pushed, later = fig5_conditions._PUSHED, fig5_conditions._LATER
    assert pushed != later
    assert f"for {pushed:g} mm" in captions[0] and f"{later:g} ms after contact" in captions[0]


def test_the_least_of_the_errors_avoided_is_the_least():
    final = {"speeds": [0.3, 0.06], "fewer": [0.2, 0.05], "half": [0.1, 0.1], "seeds": [1, 2]}
    assert open_design._collect_values({"final": final})["design.fewer.least"] == 0.05


def test_drawn_moments_are_the_nearest_samples():
    """A third of eight samples is 2.67: the third sample, not the second."""
    assert fig1_touch.choose_moments(np.ones((2, 9))) == [0, 3, 5, 8]


def test_the_drawn_body_is_two_thirds_as_long_as_the_antenna(monkeypatch):
    drawn = []
    shapes = SimpleNamespace(
        contact=np.array([True]), inverted=np.array([True]), wall=np.array([9.0])
    )
    monkeypatch.setattr(fig1_animal.Shapes, "of_sweep", lambda sweep: shapes)
    monkeypatch.setattr(fig1_animal, "_draw_body", lambda length, ax: drawn.append(length))
    antenna = SimpleNamespace(length=42.0)
    with pytest.raises(AttributeError, match="points"):  # nothing else is drawn here
        fig1_animal.plot(
            SimpleNamespace(antenna=antenna, posture=SimpleNamespace(sign=1)), None
        )
    assert drawn == [28.0]


def test_who_follows_a_wall_has_its_errors_below_their_own_names(section, monkeypatch):
    run = SimpleNamespace(error=1.5, estimate_error=2.5, nearest=7.0, collided=False)

    def follow(antenna, posture, watch):
        if antenna == "level":
            raise InvalidInput("its peak stays at the base")
        watch(None, np.zeros(3))
        return run

    monkeypatch.setattr(movieS3, "follow", follow)
    monkeypatch.setattr(
        movieS3, "get_lead", lambda: SimpleNamespace(bend=lambda antenna: antenna)
    )
    monkeypatch.setattr(movieS3, "describe_posture", lambda lead: "a set-up")
    monkeypatch.setattr(movieS3, "_write_following", lambda *given: None)
    monkeypatch.setattr(Section, "movie", lambda *_: None)
    section.folder = Path("out")
    profiles = {"graded": "graded", "level": "level", "third": "third"}
    movieS3._follow(
        SimpleNamespace(profiles=profiles, effort=SimpleNamespace(followers=2, fps=3)), section
    )
    table = next(block for block in section.blocks if block["kind"] == "table")
    names = (
        "profile",
        "tracking error [mm]",
        "estimate error [mm]",
        "nearest [mm]",
        "collided",
    )
    assert tuple(table["header"]) == names
    graded, level = table["rows"]
    assert [graded[0], *map(float, graded[1:4]), graded[4]] == ["graded", 1.5, 2.5, 7.0, "no"]
    assert list(level) == ["level", *["no map to steer by"] * 4]


def test_the_simulated_release_starts_where_the_robot_s_does_without_its_rest(monkeypatch):
    """Angles of 3 and 5 at first that rest at 1 and −2 begin at 2 and 7 beyond rest."""
    starts = []
    values = np.tile([[1.0], [-2.0]], 900)
    values[:, :100] = [[3.0], [5.0]]
    recorded = Recording(time=np.arange(900.0), values=values)
    robot = SimpleNamespace(
        antenna=SimpleNamespace(n_segments=9, rest_angle=np.zeros(9)),
        calibration=None,
        touch=lambda trials, engine: [None],
        record=lambda motion: SimpleNamespace(to_angles=lambda *_, **__: recorded),
    )
    monkeypatch.setattr(fig6_data, "make_robot", lambda: None)
    monkeypatch.setattr(fig6_data, "make_posture", lambda robot: np.zeros(8))
    monkeypatch.setattr(fig6_data, "repair", lambda given, gaps: given)
    monkeypatch.setattr(
        fig6_data, "fit_factors", lambda *_, **__: SimpleNamespace(antenna="fitted")
    )
    monkeypatch.setattr(
        fig6_data, "simulate_release", lambda antenna, start, *_, **__: starts.append(start)
    )
    _, shown, _, _ = fig6_data._compute_examples(robot, "chain")
    np.testing.assert_allclose(starts[-1], [2, 7])
    np.testing.assert_allclose(shown.values[:, 0], [2, 7])

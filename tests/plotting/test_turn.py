"""The turnable view of a touch in space: its numbers are the touch's, its eye is a rotation."""

import json
import shutil
import subprocess
from importlib.resources import files

import numpy as np
import pytest

import feeler
from feeler.errors import InvalidInput
from feeler.objects import Ball, Peg, Wall
from feeler.plotting.antennas import describe_turnable
from feeler.presets import make_preset
from feeler.tensors.transforms import reconstruct_posture

pytestmark = pytest.mark.long

RADIUS = 1.3


def touch(feature):
    antenna = make_preset("rat-whisker")
    trial = feeler.Trial(feature=feature, location=0.6, speed=0.3, azimuth=35.0)
    return antenna, trial, feeler.touch(antenna, trial, duration=14.0, all_hinges=True)


def draw(scene: dict, view: dict, now: int) -> list[dict]:
    """What ``turn.js`` draws on a canvas: each line with its colour and its places."""
    script = files("feeler.report").joinpath("turn.js").read_text()
    lines = """
      const drawn = [];
      const pen = {
        beginPath() { this.path = []; },
        moveTo(...place) { this.path.push(place); },
        lineTo(...place) { this.path.push(place); },
        stroke() { drawn.push({ colour: this.strokeStyle, path: this.path }); },
        clearRect() {},
        fillText() {},
      };
      drawScene(pen, view, scene, now);
      console.log(JSON.stringify(drawn));"""
    said = f"const scene = {json.dumps(scene)}, view = {json.dumps(view)}, now = {now};"
    whole = f"const document = {{ querySelectorAll: () => [] }};\n{script}\n{said}\n{lines}"
    done = subprocess.run(
        ["node", "-"], input=whole, capture_output=True, text=True, check=True
    )
    return json.loads(done.stdout)


def test_the_scene_is_the_touch():
    """Frames, posture and way of the object are those simulated; edges lie on the ball."""
    antenna, trial, tensors = touch(Ball(radius=RADIUS))
    scene = describe_turnable(antenna, trial, tensors)
    kept = np.isin(tensors["time"].values.round(2), scene["time"])
    wanted = reconstruct_posture(tensors, antenna).values[0][kept]
    np.testing.assert_allclose(scene["points"], wanted, atol=6e-4)
    shift, time = np.array(scene["shift"]), np.array(scene["time"])
    np.testing.assert_allclose(np.linalg.norm(shift, axis=1), 0.3 * time, atol=1e-2)
    around = np.concatenate(scene["lines"])
    centre = 0.5 * (around.max(axis=0) + around.min(axis=0))
    np.testing.assert_allclose(np.linalg.norm(around - centre, axis=1), RADIUS, rtol=0.02)
    gap = np.linalg.norm(np.array(scene["points"]) - (centre + shift)[:, None], axis=2).min(
        axis=1
    )
    assert gap[0] > RADIUS
    assert RADIUS * 0.9 < gap.min() < RADIUS * 1.3
    assert (np.array(scene["bend"]).max(), len(scene["colours"])) == (31, 32)


def test_an_antenna_in_a_plane_is_not_turned():
    antenna, trial, tensors = touch(Ball(radius=RADIUS))
    with pytest.raises(InvalidInput, match="lies in a plane, which there is nothing to turn"):
        describe_turnable(antenna.flatten(), trial.replace(azimuth=0.0), tensors)


@pytest.mark.parametrize(
    "feature", [Peg(radius=0.5, half_length=4.0), Wall()], ids=["peg", "wall"]
)
def test_other_objects_have_edges(feature):
    antenna, trial, tensors = touch(feature)
    lines = describe_turnable(antenna, trial, tensors)["lines"]
    assert all(np.shape(line)[1] == 3 for line in lines)
    extent = np.ptp(np.concatenate(lines), axis=0).max()
    assert extent > 5.0


@pytest.mark.skipif(shutil.which("node") is None, reason="needs node")
def test_the_eye_turns_and_does_not_bend():
    """From the side x lies right and y up; any other view is a rotation of it, never a mirror."""
    antenna, trial, tensors = touch(Ball(radius=RADIUS))
    scene = describe_turnable(antenna, trial, tensors) | {"lines": [np.eye(3).tolist()]}
    now = 5
    scene["shift"][now] = [0.0, 0.0, 0.0]
    plain = {"scale": 7.0, "left": 30.0, "top": 400.0, "width": 720, "height": 560}
    side = draw(scene, plain | {"turn": 0.0, "rise": 0.0}, now)
    points = np.array(scene["points"][now])
    chain = side[-(len(points) - 1) :]
    np.testing.assert_allclose(
        [one["path"][0] for one in chain], [30.0, 400.0] + 7.0 * points[:-1, :2] * [1, -1]
    )
    wanted = [scene["colours"][level] for level in scene["bend"][now]]
    assert [one["colour"] for one in chain] == wanted
    turned = draw(scene, plain | {"turn": 0.7, "rise": 0.4}, now)
    seen = (np.array(turned[3]["path"]) - [30.0, 400.0]) / [7.0, -7.0]  # of the three axes
    np.testing.assert_allclose(seen.T @ seen, np.eye(2), atol=1e-12)
    towards = np.cross(*seen.T)
    assert towards[2] > 0
    np.testing.assert_allclose(np.linalg.norm(towards), 1.0)

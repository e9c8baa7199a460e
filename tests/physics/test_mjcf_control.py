"""An exported model that can be controlled: its base follows, its sensors feel, objects are put."""

import mujoco
import numpy as np
import pytest
from awkward_touches import list_trials, make_antenna

import feeler
from feeler.physics.spec import write_mjcf


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    path = tmp_path_factory.mktemp("mjcf") / "c.xml"
    trial = feeler.Trial(feature=feeler.Ball(radius=4.0), location=0.6, speed=0.1)
    write_mjcf(feeler.presets.robot().replace(sensors=[2, 5, 8]), trial, path, control=True)
    return mujoco.MjModel.from_xml_path(str(path))


def test_what_there_is_to_feel_and_to_move(model):
    names = [model.sensor(k).name for k in range(model.nsensor)]
    assert names == [f"{what}{n}" for n in (2, 5, 8) for what in ("angle", "velocity", "touch")]
    assert [model.actuator(k).name for k in range(model.nu)] == [
        "base_x",
        "base_y",
        "base_turn",
    ]
    assert (model.nmocap, model.nq) == (1, 3 + 8)


def test_it_starts_in_the_antenna_s_own_shape(tmp_path):
    antenna, trial = make_antenna(), list_trials()[1]
    write_mjcf(antenna, trial, tmp_path / "c.xml", control=True)
    bent = mujoco.MjModel.from_xml_path(str(tmp_path / "c.xml"))
    assert np.abs(antenna.rest_angle).max() > 1e-3
    np.testing.assert_allclose(bent.key("start").qpos[3:], antenna.rest_angle, atol=1e-6)


def test_the_base_goes_where_it_is_told_and_stays_there(model):
    data = mujoco.MjData(model)
    data.mocap_pos[0] = [1000.0, 0.0, 0.0]
    data.ctrl[:] = [1.5, -0.7, 0.02]
    while data.time < 60.0:
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.qpos[:3], [1.5, -0.7, 0.02], rtol=1e-3)
    for hinge, n in ((2, 0), (5, 3), (8, 6)):
        assert data.sensordata[n] == data.qpos[2 + hinge]


def test_an_object_that_is_put_against_a_segment_is_felt_there(model):
    data = mujoco.MjData(model)
    place = (
        data.mocap_pos[0].copy() if data.mocap_pos.any() else model.body("object1").pos.copy()
    )
    mujoco.mj_step(model, data)
    touch = data.sensordata[[2, 5, 8]]
    assert not touch.any()
    while data.time < 80.0:
        data.mocap_pos[0] = np.add(place, [0.1 * data.time, 0.0, 0.0])
        mujoco.mj_step(model, data)
    assert data.sensordata[5] > 0 and data.sensordata[2] == 0
    mujoco.mj_forward(model, data)
    bent = np.abs(data.qpos[3:])
    assert bent[0] > 0.02 and bent[0] > 5 * bent[-1], bent  # a push bends the base, not the tip


def test_the_base_s_servos_are_critically_damped(model):
    """kv² = 4 m kp: it comes as fast as it can without swinging over."""
    mass = model.body("base").mass[0]
    for name in ("base_x", "base_y", "base_turn"):
        _, stiff, damped, *_ = -model.actuator(name).biasprm
        assert damped**2 == pytest.approx(4 * mass * stiff, rel=1e-4)  # digits of XML

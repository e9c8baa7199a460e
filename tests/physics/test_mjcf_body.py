"""The antenna alone as MJCF: attached to a robot it has the numbers that it has in feeler."""

import re
import warnings

import mujoco
import numpy as np
import pytest
from awkward_touches import list_trials, make_antenna

import feeler
from feeler.errors import InvalidInput
from feeler.physics.spec import _make_body, compare_body, write_body, write_mjcf

ROVER = """<mujoco><option timestep='1e-3'/><worldbody><geom type='plane' size='2 2 .1'/>
<body name='rover' pos='0 0 .031'><freejoint/><geom type='box' size='.1 .05 .03' mass='1'/>
<site name='left' pos='.1 .02 .02' xyaxes='0 0 1 1 0 0'/>
<site name='right' pos='.1 -.02 0' euler='0 0 -120'/>
</body></worldbody></mujoco>"""


def attach_twice(path):
    rover = mujoco.MjSpec.from_string(ROVER)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for side in ("left", "right"):
            child = mujoco.MjSpec.from_file(str(path))
            rover.attach(child, site=rover.site(side), prefix=f"{side}_")
        return rover.compile()


@pytest.mark.further
@pytest.mark.parametrize(("servo", "timestep"), [(False, 1e-3), (True, 1e-3), (True, 2e-3)])
def test_two_on_a_rover_of_a_kilogram_weigh_what_they_weigh(tmp_path, servo, timestep):
    """Also with MuJoCo's default timestep, 2 ms."""
    antenna = feeler.presets.robot()
    model = attach_twice(write_body(antenna, tmp_path / "a.xml", servo=servo))
    model.opt.timestep = timestep
    data = mujoco.MjData(model)
    if servo:
        data.ctrl[:] = 0.2, -0.3
    mujoco.mj_step(model, data, nstep=10_000)
    assert not any(warning.number for warning in data.warning)
    mass = 1e-3 * antenna.segment_mass.sum()
    np.testing.assert_allclose(model.body_mass.sum(), 1 + 2 * mass * (1 + servo), rtol=1e-5)
    for side in ("left", "right"):  # at rest: the weight, and its moment about the base
        force = np.linalg.norm(data.sensor(f"{side}_base_force").data)
        np.testing.assert_allclose(force, (1 + servo) * mass * 9.81, rtol=2e-2)
    middle = 1e-3 * (antenna.hinge_position + antenna.segment_length / 2)
    moment = 9.81e-3 * antenna.segment_mass @ middle
    found = np.linalg.norm(data.sensor("right_base_torque").data)
    np.testing.assert_allclose(found, moment, rtol=2e-2)
    if servo:
        np.testing.assert_allclose(data.joint("right_base_turn").qpos, -0.3, atol=2e-3)


@pytest.mark.parametrize("units", ["si", "mm"])
def test_a_release_from_the_file_is_feeler_s(tmp_path, units):
    antenna, scale = feeler.presets.robot(), 1e-3 if units == "si" else 1.0
    path = write_body(antenna, tmp_path / "a.xml", units=units)
    option = re.search("<option[^>]*>", path.read_text())[0]  # what the file says it needs
    scene = mujoco.MjSpec.from_string(f"<mujoco>{option}<worldbody/></mujoco>")
    scene.option.gravity = [0, 0, 0]
    scene.attach(
        mujoco.MjSpec.from_file(str(path)), frame=scene.worldbody.add_frame(), prefix="a_"
    )
    model = scene.compile()
    data, start = mujoco.MjData(model), np.linspace(0.2, -0.1, 8)
    data.qpos[:] = start
    simulation = feeler.Simulation(antenna, engine="mujoco", angle=start)
    for _ in range(5):
        simulation.step(4.0)
        mujoco.mj_step(model, data, nstep=round(4.0 * scale / model.opt.timestep))
        np.testing.assert_allclose(data.qpos, simulation.angle, rtol=0, atol=1e-5)
        force = data.sensor("a_base_force").data
        np.testing.assert_allclose(force[:2], simulation.base_force, rtol=0, atol=2e-5)


WHISKER = make_antenna().replace(name="thick").unflatten()


@pytest.mark.parametrize(
    "antenna",
    [
        pytest.param(make_antenna(), id="plane"),
        pytest.param(WHISKER, id="space", marks=pytest.mark.long),
    ],
)
def test_a_touch_is_feeler_s_and_other_options_are_said_to_differ(antenna):
    found = compare_body(antenna, list_trials()[0], "mm")
    assert found["peak"] > 0.01
    assert found["own"] < 1e-5 < found["2 ms"]


@pytest.mark.parametrize("control", [False, True])
def test_a_scene_in_si_is_the_same_scene(tmp_path, control):
    angles = []
    for units, scale in (("si", 1e-3), ("mm", 1.0)):
        antenna = feeler.presets.robot()
        box = feeler.Box(half_width=2.0, half_height=3.0)
        trial = feeler.Trial(feature=box, location=0.6, speed=0.2)
        path = write_mjcf(antenna, trial, tmp_path / "s.xml", control=control, units=units)
        model = mujoco.MjModel.from_xml_path(str(path))
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        if control:
            data.ctrl[:] = 2.0 * scale, 0.0, 0.1
        mujoco.mj_step(model, data, nstep=1500)
        assert model.opt.timestep == pytest.approx(0.02 * scale)
        angles.append(data.qpos[3:11] if control else data.qpos[:8])
    np.testing.assert_allclose(angles[0], angles[1], rtol=0, atol=1e-5)
    assert np.abs(angles[0]).max() > 1e-3


def test_what_cannot_be_attached_is_refused():
    with pytest.raises(InvalidInput, match="units must be one of si, mm, got 'inch'"):
        _make_body(feeler.presets.robot(), units="inch")
    with pytest.raises(InvalidInput, match="servo=True is for antennas that bend in one"):
        _make_body(WHISKER, servo=True)


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

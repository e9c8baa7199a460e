"""Divergence, Ctrl-C and bad input are the same to all engines."""

import os
import signal
from dataclasses import replace
from decimal import Decimal
from functools import partial
from threading import Event, Timer

import numpy as np
import pytest

from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput, SimulationDivergedError
from feeler.execute import ThreadExecutor, run_groups
from feeler.objects import Trial, make_feature
from feeler.physics.engine import ENGINES
from feeler.physics.run import run_group, run_scene, simulate
from feeler.physics.scene import Clock, Motion, Scene, make_scene

from .scenes import CHAINS, DYNAMIC

ENDLESS = Clock(duration=1e8, sample_interval=1e6, timestep=0.02)  # 1e10 steps
LONG = Clock(
    duration=4e4, sample_interval=2e4, timestep=0.02
)  # seconds, which a thread left alone goes on
PATIENCE = 60  # s, compiling included
SHORT = Clock(duration=3, timestep=0.02)


def stub(label: str = "") -> Scene:
    antenna = Antenna(
        segment_length=np.full(8, 0.3),
        segment_mass=1e-6,
        radius=0.2,
        stiffness=1e-3,
        damping=1e-2,
    )
    trial = Trial(feature=make_feature("ball", 1.0), location=0.6123, speed=0.3, lead=0.5432)
    return replace(make_scene(antenna, trial, "hard"), label=label)


def press_ctrl_c() -> None:
    os.kill(os.getpid(), signal.SIGINT)


@pytest.fixture(autouse=True)
def heard():
    """Ctrl-C is heard also where the tests were started with it ignored (``nohup``, ``&``), and
    none hangs for ever.
    """
    before = (
        signal.signal(signal.SIGINT, signal.default_int_handler),
        signal.signal(signal.SIGALRM, _give_up),
    )
    signal.alarm(PATIENCE)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGINT, before[0])
    signal.signal(signal.SIGALRM, before[1])


def _give_up(*_: object) -> None:
    raise TimeoutError(f"nothing has ended this test in {PATIENCE} s")


@pytest.mark.parametrize("engine", DYNAMIC)
def test_a_diverging_trial_ends_alone_with_its_name_and_time(engine):
    scenes = [stub(f"trial {k}") for k in range(10)]
    scenes[4] = replace(scenes[4], velocity=np.full(8, 1e200))
    outcomes = simulate(scenes, SHORT, engine=engine, workers=2)
    ended = outcomes.pop(4)
    assert isinstance(ended, SimulationDivergedError)
    assert "trial 4" in str(ended)
    assert ended.time == 1.0
    assert all(np.array_equal(outcome.angle, outcomes[0].angle) for outcome in outcomes)


@pytest.mark.parametrize("engine", ENGINES)
def test_the_first_ctrl_c_keeps_what_is_finished(engine):
    told = []
    run = partial(run_group, clock=SHORT, engine=engine)
    groups = [[index] for index in range(40)]
    with ThreadExecutor(1) as executor, pytest.raises(KeyboardInterrupt):
        for _, outcomes in run_groups(run, groups, lambda group: [stub()], executor=executor):
            told += outcomes
            if len(told) == 1:
                press_ctrl_c()
    assert 1 <= len(told) < 40
    assert all(isinstance(outcome, Motion) for outcome in told)


@pytest.mark.parametrize("engine", CHAINS)
def test_the_second_ctrl_c_waits_for_nothing(engine):
    """The first one lets what is running end; the second one cuts it off."""
    simulate([stub()] * 9, SHORT, engine=engine, workers=2)  # compiled by now
    for delay in (0.2, 0.4):
        Timer(delay, press_ctrl_c).start()
    with pytest.raises(KeyboardInterrupt):
        simulate([stub()] * 9, LONG, engine=engine, workers=2)


@pytest.mark.further
@pytest.mark.parametrize("engine", ENGINES)
def test_ctrl_c_ends_a_run_between_samples(engine):
    run_scene(stub(), SHORT, engine)
    Timer(0.2, press_ctrl_c).start()
    with pytest.raises(KeyboardInterrupt):  # or this test would never end
        run_scene(stub(), ENDLESS, engine)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_stop_event_ends_a_group(engine):
    stop = Event()
    stop.set()
    with pytest.raises(KeyboardInterrupt):
        run_group([stub()], ENDLESS, engine, stop)


@pytest.mark.parametrize("tenths", [1, 3, 7, 11, 23, 57, 110, 1001])
@pytest.mark.parametrize(("interval", "steps"), [(0.1, 5), (0.3, 15), (0.7, 35)])
def test_durations_that_are_not_exact_in_binary_have_the_samples_they_say(
    tenths, interval, steps
):
    """2.1 / 0.3 is 7.000000000000001 in binary, 0.3 / 0.1 is 2.9999999999999996."""
    duration = float(Decimal(str(interval)) * tenths)
    clock = Clock(duration=duration, sample_interval=interval, timestep=0.02)
    assert (clock.n_samples, clock.steps_per_sample) == (tenths, steps)
    assert clock.time[-1] == pytest.approx(duration - interval)


@pytest.mark.parametrize(
    ("duration", "samples"), [(1.0, 1), (1.001, 2), (1.999, 2), (2.0, 2), (0.3, 1)]
)
def test_samples_lie_in_the_half_open_duration(duration, samples):
    clock = Clock(duration=duration, timestep=0.02)
    assert np.array_equal(clock.time, np.arange(samples))
    assert clock.time[-1] < duration


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"duration": 0.0}, "duration must be finite and > 0 ms"),
        ({"duration": np.nan}, "duration must be finite and > 0 ms"),
        ({"timestep": -0.02}, "timestep must be finite and > 0 ms"),
        ({"timestep": 0.03}, r"whole number of timesteps.*timestep=0\.0303"),
        ({"timestep": 3.0}, "whole number of timesteps"),
        ({"duration": 1e9}, "samples; allowed are 1 to"),
    ],
)
def test_bad_clocks_are_named(fields, message):
    with pytest.raises(InvalidInput, match=message):
        Clock(**{"duration": 2.0, "timestep": 0.02} | fields)

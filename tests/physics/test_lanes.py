"""Laws of every stepper: pieces, snapshots and resets change no bit, and contacts add up."""

from dataclasses import replace

import numpy as np
import pytest

from feeler.objects import Ball
from feeler.objects.bodies import Object
from feeler.objects.motion import BaseMotion
from feeler.physics.engine import ENGINES, Stepper
from feeler.physics.scene import Scene

from .scenes import CHAINS, DYNAMIC, HOOK, touch

H = 0.02


def make(engine: str, scenes: list[Scene]) -> Stepper:
    return ENGINES[engine].make(scenes, H)


def many() -> list[Scene]:
    """Eight scenes that differ in shape, speed, base and number of objects."""
    moving = BaseMotion(velocity=(0.05, 0.02), turn=0.001)
    plain = [
        touch(kind, contact="smooth", speed=speed)
        for kind in ("ball", "box", "triangle")
        for speed in (0.6, 0.3)
    ]
    far = Object(feature=Ball(radius=0.5), place=(2.0, 8.0), velocity=(-0.2, 0.0), turn=0.01)
    return [
        *plain,
        replace(plain[0], base_motion=moving),
        replace(plain[3], objects=(*plain[3].objects, far)),
    ]


def freeze(stepper: Stepper, lane: int) -> dict[str, bytes]:
    """All bits of one lane."""
    objects = len(stepper.scenes[lane].objects)
    state = {name: value[lane] for name, value in vars(stepper.read()).items()}
    for name in ("force", "place", "forward", "object_work"):
        state[name] = state[name][:objects]
    return {
        name: np.ascontiguousarray(value).tobytes()
        for name, value in (state | vars(stepper.read_contacts(lane))).items()
    }


@pytest.mark.parametrize("engine", ENGINES)
def test_stepping_in_any_pieces_gives_the_same_bits(engine):
    scene = replace(many()[3], base_motion=BaseMotion(velocity=(0.05, 0.02), turn=0.001))
    whole, pieces = make(engine, [scene]), make(engine, [scene])
    whole.step(400)
    for count in (1, 2, 97, 0, 250, 50):
        pieces.step(count)
    assert freeze(pieces, 0) == freeze(whole, 0)
    assert len(whole.read_contacts(0)) > 0


@pytest.mark.parametrize("engine", ENGINES)
def test_a_saved_lane_goes_on_with_the_same_bits(engine):
    scenes = many() if engine in CHAINS else many()[-1:]
    stepper, lane = make(engine, scenes), len(scenes) - 1
    stepper.step(250)
    stepper.move_object(lane, 0, (0.1, 0.05), 0.01)
    stepper.move_base(lane, (0.1, 0.0), 0.002)
    saved, here = stepper.save(lane), freeze(stepper, lane)
    stepper.step(200)
    ended = freeze(stepper, lane)
    stepper.move_object(lane, 0, (9.0, 9.0), 0.0)
    stepper.move_base(lane, (0.0, 0.0), 0.0)
    stepper.step(30)
    for _ in range(2):
        stepper.load(lane, saved)
        assert freeze(stepper, lane) == here
        stepper.step(200)
        assert freeze(stepper, lane) == ended


@pytest.mark.further
@pytest.mark.parametrize("engine", CHAINS)
@pytest.mark.parametrize("new", ["same", "more objects", "more corners", "none"])
def test_a_reset_lane_starts_afresh_and_its_neighbours_go_on(engine, new):
    scenes = [*many()[:-1], many()[0]]  # eight, as machine code is made for anyway
    balls = tuple(
        Object(feature=Ball(radius=0.3), place=(x, 8.0)) for x in (0.45, -0.45, 3.0, 4.0)
    )
    scene = {
        "same": scenes[2],
        "more objects": replace(scenes[0], objects=(*scenes[0].objects, *balls)),
        "more corners": touch(HOOK, contact="smooth"),
        "none": Scene(antenna=scenes[0].antenna, angle=np.full(30, 0.01)),
    }[new]
    stepper = make(engine, scenes)
    untouched = make(engine, scenes)
    fresh = make(engine, [scene])
    for each in (stepper, untouched):
        each.step(150)
    stepper.reset(2, scene)
    for each in (stepper, untouched, fresh):
        each.step(250)
    for lane in {*range(len(scenes))} - {2}:
        assert freeze(stepper, lane) == freeze(untouched, lane), lane
    assert freeze(stepper, 2) == freeze(fresh, 0)


@pytest.mark.parametrize("engine", DYNAMIC)
def test_contacts_add_up_and_lie_on_their_segments(engine):
    """With a base at rest: the contacts of the last step were found where the lanes were before
    it.
    """
    scenes = [*(scene for scene in many() if scene.base_motion is None), many()[0]]
    groups = [scenes] if engine in CHAINS else [[scene] for scene in scenes]
    for stepper in (make(engine, group) for group in groups):
        stepper.step(220)
        before = stepper.read()
        stepper.step(1)
        state = stepper.read()
        for lane, scene in enumerate(stepper.scenes):
            found, antenna = stepper.read_contacts(lane), scene.antenna
            assert len(found) > 0
            total = np.zeros((len(scene.objects), 2))
            np.add.at(total, found.object, found.force)
            np.testing.assert_allclose(state.force[lane, : len(total)], total, atol=1e-15)
            np.testing.assert_allclose(np.hypot(*found.normal.T), 1.0, atol=1e-12)
            assert np.all(found.distance < 0)
            first = antenna.hinge_position / antenna.length
            last = np.cumsum(antenna.segment_length) / antenna.length
            assert np.all(
                (found.place >= first[found.segment - 1] - 1e-12)
                & (found.place <= last[found.segment - 1] + 1e-12)
            )
            points = antenna.shape(before.angle[lane])
            near = (
                points[found.segment - 1]
                + (found.place * antenna.length - antenna.hinge_position[found.segment - 1])[
                    :, None
                ]
                * np.diff(points, axis=0)[found.segment - 1]
                / antenna.segment_length[found.segment - 1, None]
            )
            reach = np.hypot(*(found.point - near).T)
            assert np.all(reach <= antenna.radius[found.segment - 1] + 1e-12)
            push = (found.force * found.normal).sum(axis=1)
            assert np.all(push >= -1e-15)
            assert state.contact_place[lane] == pytest.approx(
                push @ found.place / push.sum(), rel=1e-9
            )

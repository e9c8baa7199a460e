"""Smooth contact: its force begins at zero, so derivatives exist and the last bit stays the last
bit.
"""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from feeler.physics.clock import Clock
from feeler.physics.contact import CONTACTS, DEFAULT_CONTACT, HARDEST, Contact, get_contact
from feeler.physics.run import simulate
from feeler.physics.scene import Scene, make_scene
from feeler.presets import make_preset
from feeler.stimulus import Trial, make_feature
from feeler.stimulus.ninety import trials

from .scenes import touch

SMALL = (1e-4, 1e-5, 1e-6)
ALL = (1e-2, 1e-3, *SMALL)
CLOCK = Clock(duration=60, timestep=0.05)


def run(scenes: list[Scene], clock: Clock = CLOCK) -> list[np.ndarray]:
    return [motion.angle for motion in simulate(scenes, clock)]


def find_slopes(
    scene: Scene, steps: tuple[float, ...], clock: Clock = CLOCK
) -> list[np.ndarray]:
    """Central differences of the angles with respect to the logarithm of all stiffnesses, one per
    eps.
    """
    antenna = scene.antenna
    sides = [
        replace(scene, antenna=antenna.replace(stiffness=antenna.stiffness * (1 + sign * eps)))
        for eps in steps
        for sign in (1, -1)
    ]
    angle = run(sides, clock)
    return [(angle[2 * i] - angle[2 * i + 1]) / (2 * eps) for i, eps in enumerate(steps)]


@pytest.mark.parametrize(("kind", "share"), [("ball", 0.01), ("box", 0.05), ("triangle", 0.05)])
class TestDerivative:
    @pytest.mark.parametrize(("location", "speed"), [(0.6123, 0.3), (0.55, 0.12)])
    def test_with_respect_to_stiffness_converges(self, kind, share, location, speed):
        scene = touch(kind, 1.5, contact="smooth", whole=True, location=location, speed=speed)
        check_slopes(find_slopes(scene, SMALL), share)

    def test_is_that_of_the_table_in_the_docs(self, kind, share):
        """From 1e-2 on; larger steps reach across kinks, where a contact begins or slides, and at
        other places see more.
        """
        trial = Trial(feature=make_feature(kind, 1.5), location=0.7, speed=0.3)
        scene = make_scene(make_preset("cockroach"), trial, "smooth")
        check_slopes(find_slopes(scene, ALL, replace(CLOCK, duration=100)), share)


def check_slopes(slopes: list[np.ndarray], share: float) -> None:
    assert np.linalg.norm(slopes[-1]) > 1e-2
    for coarse, fine in itertools.pairwise(slopes):
        assert np.linalg.norm(coarse - fine) < share * np.linalg.norm(fine)


@pytest.mark.parametrize("kind", ["ball", "box", "triangle"])
@pytest.mark.parametrize("speed", [0.6, 0.06])
def test_the_last_bit_of_the_speed_moves_nothing_else(kind, speed):
    scene = touch(kind, 1.5, contact="smooth", whole=True, speed=speed)
    item = scene.objects[0]
    faster = item.replace(
        velocity=(float(np.nextafter(item.velocity[0], 1.0)), item.velocity[1])
    )
    first, second = run([scene, replace(scene, objects=(faster,))])
    assert np.abs(first).max() > 1e-3
    assert np.abs(first - second).max() < 1e-9


@pytest.mark.slow
def test_the_last_bit_moves_none_of_the_ninety_touches():
    scenes = [make_scene(make_preset("cockroach"), trial, "smooth") for trial in trials()]
    nudged = []
    for scene in scenes:
        item = scene.objects[0]
        x, y = item.velocity
        nudged.append(
            replace(scene, objects=(item.replace(velocity=(float(np.nextafter(x, 1.0)), y)),))
        )
    clock = Clock(duration=380, timestep=0.02)
    for first, second in zip(simulate(scenes, clock), simulate(nudged, clock), strict=True):
        assert np.abs(first.angle - second.angle).max() < 1e-9


def test_the_impedance_is_the_one_that_mujoco_documents():
    """d(r) from d_min to d_max over the width, y(x) = a x^p below the midpoint and 1 − b (1 − x)^p
    above.
    """
    from feeler.physics.chain import fields as f
    from feeler.physics.chain.contact import compute_impedance

    low, high, width, middle, power = 0.01, 0.9, 0.05, 0.3, 3.0
    obj = np.zeros((1, f.N_OBJECT, 1))
    obj[0, [f.O_D_MIN, f.O_MIDPOINT, f.O_POWER], 0] = low, middle, power
    for depth in np.linspace(0, 1.5 * width, 31):
        x = min(depth / width, 1.0)
        y = (
            x**power / middle ** (power - 1)
            if x <= middle
            else 1 - (1 - x) ** power / (1 - middle) ** (power - 1)
        )
        assert compute_impedance(-depth, high, width, obj, 0, 0) == pytest.approx(
            low + y * (high - low), rel=1e-12
        )


def test_contacts_have_names_and_smooth_is_the_default():
    assert DEFAULT_CONTACT == "smooth"
    assert get_contact() is CONTACTS["smooth"]
    assert get_contact("hard") == Contact()
    assert get_contact(Contact(solref=(0.4, 1.0))).solref == (0.4, 1.0)
    assert CONTACTS["smooth"].solimp[0] <= 1e-3  # the force begins at nothing


class TestSoftness:
    def test_follows_from_the_antenna(self):
        """At the push of the turn it sinks in by its width, which is the share of that push."""
        antenna, contact = make_preset("whisker"), get_contact()
        soft, place = (
            contact.soften(antenna),
            antenna.hinge_position + antenna.segment_length / 2,
        )
        assert np.allclose(soft.width, np.minimum(2.5e-5 * place, antenna.radius / 2))
        assert soft.d_max.min() == contact.solimp[1] and soft.d_max[0] == HARDEST
        assert np.all(np.diff(soft.d_max[:40]) <= 0)

    def test_widens_with_speed_up_to_half_the_radius(self):
        antenna, contact = make_preset("cockroach"), get_contact()
        soft = contact.soften(antenna)
        width = [soft.widen(*contact.widen(speed)) for speed in np.linspace(0, 3, 50)]
        assert np.all(np.diff(width, axis=0) >= 0) and np.all(width[0] == soft.width)
        assert np.all(width[-1] == antenna.radius / 2)

    def test_fixed_contacts_stay_as_they_are(self):
        soft = get_contact("even").soften(make_preset("cockroach"))
        assert np.all(soft.widen(*get_contact("even").widen(1.0)) == 0.05)
        assert np.all(soft.d_max == 0.95)


def test_the_last_digits_of_the_stiffness_move_the_tip_by_less_than_a_nanometre():
    antenna = make_preset("cockroach")
    for kind in ("ball", "box"):
        scene = touch(kind, 1.5, contact="smooth", whole=True, speed=0.3)
        other = replace(
            scene, antenna=antenna.replace(stiffness=antenna.stiffness * (1 + 1e-12))
        )
        first, second = run([scene, other])
        assert np.abs(antenna.tip(first) - antenna.tip(second)).max() <= 1e-6


def test_slow_motion_widens_a_contact_to_an_eighth_of_the_radius_and_none_beyond_half():
    antenna = make_preset("cricket")
    soft = get_contact("smooth").soften(antenna)
    np.testing.assert_allclose(soft.slow, antenna.radius / 8)
    np.testing.assert_allclose(soft.widest, antenna.radius / 2)

"""The paper's ninety touches, number by number."""

import itertools

from feeler.objects.trials import trials


def test_ninety_touches_are_six_features_at_five_places_and_three_speeds():
    """Speeds [P]; half-sizes and places [C], the first place [D]."""
    found = trials()
    kinds = {
        (
            t.feature.kind,
            t.feature.size,
            getattr(t.feature, "half_height", None),
            t.feature.rounding,
        )
        for t in found
    }
    assert kinds == {
        *((("ball", size, None, size)) for size in (1.5, 3.0)),
        *(((kind, size, size, 0.0)) for kind in ("box", "triangle") for size in (1.5, 3.0)),
    }
    assert len(found) == 90
    grid = {(t.feature.kind, t.feature.size, t.location, t.speed) for t in found}
    expected = itertools.product(
        ("ball", "box", "triangle"), (1.5, 3.0), (0.5, 0.6, 0.7, 0.8, 0.9), (0.6, 0.3, 0.06)
    )
    assert grid == set(expected)

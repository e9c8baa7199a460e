"""Outlines from drawings: the same shape from every format, curves within the tolerance, faults
named.
"""

import numpy as np
import pytest

from feeler import Outline
from feeler.errors import InvalidInput

SVG = '<svg xmlns="http://www.w3.org/2000/svg" {page}>{inside}</svg>'
PAGE = 'width="50mm" height="20mm" viewBox="0 0 100 40"'  # half a millimetre a unit
RECTANGLE = '<g transform="translate(10, 3)"><path id="plate" d="M 0 0 H 8 V 4 H 0 Z"/></g>'
CIRCLE = '<circle id="disc" cx="30" cy="20" r="6"/>'


def write_svg(path, inside, page=PAGE):
    path.write_text(SVG.format(page=page, inside=inside))
    return path


def test_every_format_gives_the_same_plate(tmp_path):
    (tmp_path / "a.csv").write_text("x,y\n0,-1\n4,-1\n4,1\n0,1\n")
    (tmp_path / "cm.csv").write_text("# plate\ny_cm;x_cm\n-0,1;0\n-0,1;0,4\n0,1;0,4\n0,1;0\n")
    (tmp_path / "bare.csv").write_text("0,-1\n4,-1\n4,1\n0,1\n")
    write_svg(tmp_path / "a.svg", RECTANGLE)
    plates = [
        Outline.from_file(tmp_path / file, name="plate")
        for file in ("a.csv", "cm.csv", "bare.csv", "a.svg")
    ]
    for plate in plates:
        assert {tuple(corner) for corner in np.round(plate.vertices, 12)} == {
            (0, 1),
            (0, -1),
            (-4, 1),
            (-4, -1),
        }


@pytest.mark.parametrize("tolerance", [0.1, 0.01, 0.001])
def test_curves_stay_within_the_tolerance(tmp_path, tolerance):
    outline = Outline.from_file(write_svg(tmp_path / "a.svg", CIRCLE), tolerance=tolerance)
    corners = outline.vertices + np.array([3.0, 0.0])
    middle = (corners + np.roll(corners, 1, axis=0)) / 2
    np.testing.assert_allclose(np.hypot(*corners.T), 3.0, rtol=1e-9)
    assert 3.0 - np.hypot(*middle.T).min() <= tolerance


def test_up_in_the_drawing_is_left_of_the_motion(tmp_path):
    outline = Outline.from_file(
        write_svg(tmp_path / "a.svg", '<path d="M 0 0 L 0 4 L 8 4 Z"/>')
    )  # foremost at the bottom
    np.testing.assert_allclose(outline.vertices[np.argmax(outline.vertices[:, 0])], [0.0, -1.0])


def test_one_of_several_is_chosen_and_sized(tmp_path):
    path = write_svg(tmp_path / "a.svg", RECTANGLE + CIRCLE)
    disc = Outline.from_file(path, which="disc", width=3.0)
    assert disc.size == pytest.approx(1.5)
    assert Outline.from_file(path, which=1) in [
        Outline.from_file(path, which=name) for name in ("disc", "plate")
    ]
    assert Outline.from_file(path, which="plate", scale=2.0).size == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("inside", "page", "options", "match"),
    [
        ('<path d="M 0 0 L 1 1 L 2 0"/>', PAGE, {}, "no closed path; close the outline"),
        (
            RECTANGLE + CIRCLE,
            PAGE,
            {},
            "2 closed paths; choose one by which=number or id: .*plate",
        ),
        (RECTANGLE + CIRCLE, PAGE, {"which": "leaf"}, "no one closed path 'leaf'"),
        (RECTANGLE, 'viewBox="0 0 10 10"', {}, "how long its unit is; give width="),
        (RECTANGLE, 'width="100px" height="10px"', {}, "how long its unit is"),
        (RECTANGLE, PAGE, {"width": 1.0, "scale": 1.0}, "not both"),
        (RECTANGLE, PAGE, {"width": -1.0}, "width must be > 0"),
        (RECTANGLE, PAGE, {"tolerance": 0.0}, "tolerance must be > 0"),
        ('<path d="M 0 0 L 8 4 L 8 0 L 0 4 Z"/>', PAGE, {}, "self-intersecting"),
        ("<path", PAGE, {}, "cannot be read as a SVG drawing"),
    ],
)
def test_drawings_without_one_outline_are_refused(tmp_path, inside, page, options, match):
    with pytest.raises(InvalidInput, match=match):
        Outline.from_file(write_svg(tmp_path / "a.svg", inside, page), **options)


@pytest.mark.parametrize(
    ("name", "text", "match"),
    [
        ("a.csv", "0,0\n1,1,2\n", "line 2: 3 cells where the header has 2"),
        ("a.csv", "0,0\n1,one\n2,2\n", "line 2, column 'y': 'one' is no finite number"),
        ("a.csv", "x,y,z\n0,0,1\n", "two columns, x and y"),
        ("a.csv", "x_mm,y_cm\n0,0\n", "in mm or as their names say"),
        ("a.csv", "0,0\n1,1\n", "3 to 1000 points"),
        ("a.csv", "x,y\n0,0\n1,nan\n2,2\n", "not finite, number 2: 1 nan"),
        ("a.png", "", "none of .svg, .csv"),
        ("gone.svg", None, "cannot read .*no such file. Check the path"),
    ],
)
def test_files_that_are_no_drawing_are_refused(tmp_path, name, text, match):
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(InvalidInput, match=match):
        Outline.from_file(tmp_path / name)


def test_a_drawing_without_unit_is_sized_by_its_width(tmp_path):
    path = write_svg(tmp_path / "a.svg", CIRCLE, 'viewBox="0 0 100 40"')
    with pytest.raises(InvalidInput, match="how long its unit is"):
        Outline.from_file(path)
    assert Outline.from_file(path, width=2.0, tolerance=1e-3).size == pytest.approx(
        1.0, abs=1e-3
    )


@pytest.mark.parametrize(
    ("unit", "inch"),
    [("in", 1), ("mm", 25.4), ("cm", 2.54), ("q", 101.6), ("pt", 72), ("pc", 6), ("m", 0.0254)],
)
def test_an_inch_is_25_4_mm_in_every_unit(tmp_path, unit, inch):
    """CSS Values and Units 4, absolute lengths: 1in = 2.54cm = 101.6q = 72pt = 6pc; a drawing may
    also speak of m.
    """
    path = write_svg(
        tmp_path / "a.svg", RECTANGLE, f'width="{inch}{unit}" viewBox="0 0 100 40"'
    )
    assert Outline.from_file(path).size == pytest.approx(4 * 25.4 / 100 / 2)


def test_straight_edges_get_no_corners_of_their_own(tmp_path):
    rng = np.random.default_rng(3)
    for _ in range(10):
        turn = np.sort(rng.uniform(0, 2 * np.pi, 7))
        text = " L ".join(f"{7 * np.cos(t):.9f} {7 * np.sin(t):.9f}" for t in turn)
        outline = Outline.from_file(write_svg(tmp_path / "a.svg", f'<path d="M {text} Z"/>'))
        assert len(outline.vertices) == 7


def test_a_drawing_is_looked_at_to_the_first_corner_too_many(tmp_path):
    """A curve that turns wildly would be halved into 65,536 pieces."""
    wild = "M 0 0" + " C 900000 100000 2 -1000000 3 0" * 500 + " Z"
    for inside in (f'<path d="{wild}"/>', f'<path d="M 0 0{"l 1 1 1 -1" * 600} V 9 Z"/>'):
        with pytest.raises(InvalidInput, match=r"more than 1,000 corners\. Raise tolerance="):
            Outline.from_file(write_svg(tmp_path / "a.svg", inside, 'width="10mm"'))

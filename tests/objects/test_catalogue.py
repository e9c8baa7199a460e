"""Object files: every feature under a name of its own, or a line that says what is wrong."""

import pytest

from feeler import Ball, Box
from feeler.errors import InvalidInput
from feeler.objects import load_objects


def test_a_file_gives_its_features_in_order_and_under_their_names(tmp_path):
    ball = 'shape = "ball"\nradius = 3.0'
    lid = 'name = "lid"\nshape = "box"\nhalf_width = 2.0\nhalf_height = 0.5'
    text = f"[[object]]\n{ball}\n[[object]]\n{lid}\n"
    (tmp_path / "o.toml").write_text(text)
    assert load_objects(tmp_path / "o.toml") == [
        Ball(radius=3.0),
        Box(half_width=2.0, half_height=0.5, name="lid"),
    ]


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("", "must hold 1 to 1000 tables"),
        ("[[object]]\nradius = 1", "object 1: needs a shape"),
        ("[[object]]\nshape = 'bal'\nradius = 1", "unknown shape 'bal'"),
        (
            "[[object]]\nshape = 'ball'\nradius = 1\n[[object]]\nshape = 'ball'\nradius = 2",
            "two objects are called 'ball'",
        ),
        ("[[object]]\nshape = 'ball'\nfile = 'x.svg'", "a ball has no 'file'"),
        ("[[object]]\nshape = 'outline'\nfile = 'x.csv'\nhue = 2", "a drawing has no 'hue'"),
        ("[[object]", "not valid TOML"),
    ],
)
def test_a_wrong_objects_file_is_refused_by_name(tmp_path, text, match):
    (tmp_path / "o.toml").write_text(text)
    with pytest.raises(InvalidInput, match=match):
        load_objects(tmp_path / "o.toml")


def test_a_drawing_lies_beside_the_objects_file(tmp_path):
    (tmp_path / "leaf.csv").write_text("x,y\n0,-3\n0,3\n-5,0\n")
    (tmp_path / "o.toml").write_text(
        '[[object]]\nname = "leaf"\nshape = "outline"\nfile = "leaf.csv"'
    )
    (leaf,) = load_objects(tmp_path / "o.toml")
    assert (leaf.name, leaf.size) == ("leaf", 3)

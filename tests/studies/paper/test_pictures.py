"""Every figure looks as it did when a person last looked: small pictures are kept, and a gross
change is noticed.

Letters, single points and thin lines may move. After a change that is meant, look at the figures
and keep them anew:

    feeler reproduce --scale smoke --out out && python tests/studies/paper/test_pictures.py out
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

KEPT = Path(__file__).with_name("pictures")
WIDTH = 64  # pixels
PART, GREY = 0.02, 0.06  # [C] of the pixels, that may differ by more than this share of black


def shrink(path):
    """A picture of ``WIDTH`` grey pixels, 0 to 1 (row, column)."""
    whole = Image.open(path).convert("L")
    size = WIDTH, round(WIDTH * whole.height / whole.width)
    return (
        np.asarray(whole if whole.size == size else whole.resize(size, Image.Resampling.BOX))
        / 255
    )


def is_alike(found, kept):
    return found.shape == kept.shape and np.mean(np.abs(found - kept) > GREY) <= PART


def test_every_figure_looks_as_it_did(whole):
    pictures = {path.stem: path for path in (whole / "figures").glob("*.png")}
    assert {*pictures} == {path.stem for path in KEPT.glob("*.png")}
    changed = [
        name
        for name, path in pictures.items()
        if not is_alike(shrink(path), shrink(KEPT / f"{name}.png"))
    ]
    assert not changed


def test_what_a_person_would_see_is_noticed():
    path = min(KEPT.glob("*.png"))
    kept = shrink(path)
    half = kept.copy()
    half[:, : WIDTH // 2] = 1.0
    assert is_alike(kept, kept)
    assert not is_alike(half, kept)  # half of its panels are gone
    assert not is_alike(kept[:, ::-1], kept)  # they stand in another order
    assert not is_alike(kept[:-4], kept)  # it has another shape
    assert not any(
        is_alike(shrink(other), kept) for other in KEPT.glob("*.png") if other != path
    )


def keep(out):
    """Small pictures of all figures of a smoke run."""
    for path in KEPT.glob("*.png"):
        path.unlink()
    for path in (out / "figures").glob("*.png"):
        Image.fromarray((255 * shrink(path)).round().astype(np.uint8)).save(
            KEPT / path.name, optimize=True
        )


if __name__ == "__main__":
    keep(Path(sys.argv[1]))

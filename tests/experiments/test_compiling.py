"""That it compiles is said where numba compiles, however long loading takes."""

import logging
import time

import numpy as np
import pytest
from numba import njit

import feeler
from feeler.physics import engine


@pytest.mark.parametrize("compiles", [True, False])
def test_it_says_that_it_compiles_only_where_it_does(monkeypatch, caplog, compiles):
    monkeypatch.setattr(engine, "_LOADING", 0.01)
    monkeypatch.setattr(engine, "_known", set())
    monkeypatch.setattr(engine, "_told", set())
    work = njit(lambda x: x + 1)
    if not compiles:
        work(1.0)
    with caplog.at_level(logging.WARNING, "feeler"), engine._announce_compiling("planned"):
        assert work(1.0) == 2.0
        time.sleep(0.1)
    assert [record.getMessage()[:9] for record in caplog.records] == ["compiling"] * compiles


def test_a_mesh_of_many_corners_is_one_line():
    corners = np.random.default_rng(0).normal(size=(1000, 3))
    assert len(repr(feeler.Mesh(vertices=corners))) < 90
    assert feeler.Mesh is feeler.objects.Mesh

"""The encoder by itself: without physics, files and pictures."""

import subprocess
import sys

PROGRAM = """
import sys
import numpy as np
import feeler.encoding
X = np.random.default_rng(0).random((4, 5, 30))
encoder = feeler.encoding.ConvolutiveNMF(2, 6, n_restarts=1, max_iter=2, warn=False).fit(X)
encoder.transform(X)
print(*sorted(sys.modules))
"""


def test_the_encoder_loads_no_physics_no_store_and_no_pictures():
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True
    )
    loaded = set(done.stdout.split())
    assert "feeler.encoding.factorise" in loaded
    banned = ("mujoco", "zarr", "h5py", "jinja2", "matplotlib", "feeler.physics")
    assert loaded.isdisjoint(banned)

"""Without compiling anything: every engine's touch, to the last bit."""

import json
import os
import subprocess
import sys
from hashlib import sha256

import numpy as np
import pytest

import feeler
from feeler.physics.engine import ENGINES


def fingerprint_touches() -> dict[str, str]:
    """By engine, the digest of what two trials in lanes and one trial alone record."""
    antenna = feeler.Antenna(
        segment_length=np.full(6, 1.0),
        segment_mass=1e-5,
        radius=0.15,
        stiffness=np.linspace(0.02, 0.01, 6),
        damping=0.01,
    )
    features = (
        feeler.Ball(radius=1.0),
        feeler.Box(half_width=1.5, half_height=1.5, rounding=0.9),
    )
    trials = [feeler.Trial(feature=f, location=0.5, speed=0.3, lead=0.2) for f in features]
    options = {"duration": 3.0, "timestep": 0.1, "all_hinges": True, "contact": "smooth:0.2"}
    names = ("angle", "velocity", "force", "base_moment", "work")
    found = {}
    for engine in ENGINES:
        sets = [
            feeler.touch(antenna, some, engine=engine, save=names, **options)
            for some in (trials, trials[0])
        ]
        assert all(abs(tensors["angle"]).max() > 0.01 for tensors in sets)
        held = b"".join(tensors[name].values.tobytes() for tensors in sets for name in names)
        found[engine] = sha256(held).hexdigest()
    return found


@pytest.mark.long
def test_plain_python_gives_the_bits_of_compiled_code():
    code = (
        "import json; from tests.physics.test_plain import fingerprint_touches;"
        " print(json.dumps(fingerprint_touches()))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert json.loads(done.stdout) == fingerprint_touches()

"""What libraries in C read, against damage: without the guard's limits, in a child that may crash
or hang.
"""

import os
import resource
import shutil
import signal
import tempfile
import time
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from feeler.objects import Mesh
from feeler.objects.meshes import MESHES
from feeler.sandbox import Limits
from feeler.tensors.formats import FORMATS
from feeler.tensors.schema import find_breaches
from feeler.tracking.tracks import load_tracks

from ._files import make_file
from ._mutate import change_hdf5, mutate, shape_mat, shape_obj, shape_stl
from ._survive import SECONDS, Log, survives, watched

pytestmark = pytest.mark.long

N_QUICK, N_LONG = 100, 0  # 0: as many as --inputs says
LIMITS = Limits(max_bytes=2**22)
SHAPES = {".mat": shape_mat, ".stl": shape_stl, ".obj": shape_obj}
KINDS = {"netcdf": "set.nc", "nwb": "set.nwb", "mat": "set.mat"}
KINDS |= {"stl": "block.stl", "stl cut": "bent.stl", "obj": "block.obj", "obj cut": "bent.obj"}
KINDS |= {"sleap": "sleap.h5", "deeplabcut": "deeplabcut.h5", "movement": "movement.nc"}


EXTRAS = {"nwb": ("pynwb",), "stl": ("trimesh", "coacd"), "obj": ("trimesh", "coacd")}
"""Libraries of feeler's extras that a kind needs."""


def make_input(
    kind: str, rng: np.random.Generator, seed: bytes, path: Path, share: float
) -> None:
    """A sound file with changed objects, for this share of them; else damaged bytes."""
    if rng.random() >= share:
        path.write_bytes(mutate(rng, [seed]))
        return
    shape = SHAPES.get(path.suffix)
    path.write_bytes(shape(rng, seed) if shape else seed)
    if shape:
        return
    try:
        change_hdf5(rng, str(path))
    except (OSError, ValueError, KeyError, RuntimeError, TypeError):
        path.write_bytes(seed[: int(rng.integers(len(seed)))])


def read(kind: str, path: Path) -> None:
    """As the user's call does: tensors are held against their contract, poses become tracks."""
    if kind in FORMATS:
        find_breaches(FORMATS[kind].load(path, LIMITS, False))
    elif path.suffix in MESHES:
        Mesh.from_file(path, threshold=0.5)
    else:
        load_tracks(path, frame_rate=30.0)


def attack(kind: str, numbers: range, folder: Path, out: int, share: float) -> Log:
    """Tell the number of each input, then read it."""
    seed, path, log = make_file(KINDS[kind]), folder / KINDS[kind], Log()
    # threads that a library began before the fork are not there, and would be waited for
    with watched(), _one_thread(kind):
        for number in numbers:
            os.write(out, b"%d\n" % number)
            _set_alarm()
            make_input(kind, np.random.default_rng(number), seed, path, share)
            with survives(f"{kind}, number {number}", log, library=True):
                read(kind, path)
            path.unlink()
    return log


def _one_thread(kind: str) -> threadpool_limits:
    for library in EXTRAS.get(kind[:3], ()):
        import_module(library)
    return threadpool_limits(1)


def _set_alarm() -> None:
    """End this process if the next input hangs inside the C library, which lets no handler of
    Python's run.
    """
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (int(time.process_time()) + 2 * SECONDS, hard))


def run_child(kind: str, numbers: range, folder: Path, share: float) -> tuple[int, int]:
    """Attack in a forked process; the last number it told and its wait status."""
    lines, out = os.pipe()
    pid = os.fork()
    if pid == 0:
        code = 0
        try:
            print(f"\n{kind}: {attack(kind, numbers, folder, out, share)}", flush=True)
        except BaseException as error:
            os.write(2, repr(error)[:2000].encode())
            code = 3
        os._exit(code)
    os.close(out)
    last = b""
    with os.fdopen(lines, "rb") as stream:
        for line in stream:
            last = line
    return int(last), os.waitpid(pid, 0)[1]


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("n", [N_QUICK, pytest.param(N_LONG, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", KINDS)
def test_only_errors_of_ours_come_out_and_crashes_are_contained(kind, n, request):
    share = 0.4 if n else 1.0
    n = n or request.config.getoption("--inputs")
    for library in EXTRAS.get(kind[:3], ()):
        pytest.importorskip(library)
    make_file(KINDS[kind])
    folder = Path(tempfile.mkdtemp(dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None))
    number, ended = 0, {}
    while number < n:
        last, status = run_child(kind, range(number, n), folder, share)
        assert not os.WIFEXITED(status) or os.WEXITSTATUS(status) == 0, f"input {last} raised"
        if os.WIFSIGNALED(status):
            ended[last] = signal.Signals(os.WTERMSIG(status)).name
        number = last + 1
    shutil.rmtree(folder)
    print(
        f"\n{n} damaged {kind} files; over these the library crashed or hung in its own process:"
        f" {ended}"
    )

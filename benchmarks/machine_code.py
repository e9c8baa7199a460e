"""Put the engine's machine code into a wheel, so that a fresh install compiles nothing.

    python -m pip wheel --no-deps -w dist .
    python benchmarks/machine_code.py dist/feeler-*-any.whl

writes ``dist/feeler-…-cp311-cp311-linux_x86_64.whl`` beside it. Numba keeps machine code beside
the sources, with the features of the processor that it needs. Here it is made for two classes
of x86 processors: v3 (since 2013) and v4 (AVX-512); each that has these features uses it
(``feeler.compiled``). Other processors, Pythons and versions of numba compile for themselves,
as does an installation whose folder its user cannot write to. What was made is tried in a
folder of its own: a touch there must compile nothing.
"""

import base64
import hashlib
import os
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

V3 = (
    "cx16 popcnt sahf sse sse2 sse3 sse4.1 sse4.2 ssse3 avx avx2 bmi bmi2 f16c fma lzcnt movbe"
    " xsave"
)
CLASSES = {
    "x86-64-v3": V3,
    "x86-64-v4": f"{V3} avx512f avx512bw avx512cd avx512dq avx512vl",
}
TOUCH = """
import sys, feeler
from numba.core.event import RecordingListener, install_listener
trials = feeler.presets.paper_trials()[:8]
with install_listener("numba:compile", listener := RecordingListener()):
    for antenna in (feeler.presets.cockroach(), feeler.presets.make_preset("lobster")):
        feeler.touch(antenna, trials[0], duration=20.0)
        feeler.touch(antenna, trials, duration=20.0)
    if "encode" in sys.argv:
        angle = feeler.tensors.rectify(feeler.touch(antenna, trials, duration=60.0)["angle"])
        feeler.ConvolutiveNMF(n_components=2, n_lags=10, max_iter=3).fit(angle)
print(len(listener.buffer) // 2)
"""


def touch(folder: Path, processor: str = "") -> int:
    """The number of functions that a touch compiles with feeler from ``folder``."""
    made_for = {}
    if processor:
        features = ",".join(f"+{name}" for name in CLASSES[processor].split())
        made_for = {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": features}
    done = subprocess.run(
        [sys.executable, "-c", TOUCH, "encode"],
        env=os.environ | made_for | {"PYTHONPATH": str(folder)},
        cwd=folder,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return int(done.stdout.split()[-1])


def install(wheel: Path, folder: Path) -> None:
    """Unpack a wheel, which needs nothing else."""
    with ZipFile(wheel) as packed:
        packed.extractall(folder)


def fill(wheel: Path, processors: list[str]) -> Path:
    """A wheel of this Python and system beside ``wheel``, with machine code in it."""
    tag = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    name = wheel.name.replace("py3-none-any", f"{tag}-{tag}-{platform}")
    if name == wheel.name:
        raise SystemExit(f"{wheel} must be a wheel for any Python: …-py3-none-any.whl.")
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        install(wheel, root)
        for processor in processors:
            print(f"{processor}: {touch(root, processor)} functions compiled")
        code = sorted(root.glob("feeler/**/*.nb[ic]"))
        with ZipFile(wheel) as old, ZipFile(wheel.with_name(name), "w", ZIP_DEFLATED) as new:
            for item in old.infolist():
                content = old.read(item)
                if item.filename.endswith(".dist-info/WHEEL"):
                    content = content.replace(b"true", b"false").replace(
                        b"py3-none-any", f"{tag}-{tag}-{platform}".encode()
                    )
                elif item.filename.endswith(".dist-info/RECORD"):
                    lines = [_describe(file, root) for file in code]
                    kept = content.decode().splitlines()
                    kept = [line for line in kept if "/WHEEL," not in line]
                    changed = item.filename.replace("RECORD", "WHEEL") + ",,"
                    content = "\n".join([*lines, *kept, changed, ""]).encode()
                new.writestr(item, content)
            for file in code:
                new.write(file, file.relative_to(root).as_posix())
    return wheel.with_name(name)


def _describe(file: Path, root: Path) -> str:
    """A file's line in RECORD."""
    content = file.read_bytes()
    digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
    return f"{file.relative_to(root).as_posix()},sha256={digest},{len(content)}"


def main() -> None:
    """Fill each wheel that is named, and try it."""
    for name in sys.argv[1:]:
        wheel = fill(Path(name), list(CLASSES))
        with tempfile.TemporaryDirectory() as folder:
            install(wheel, Path(folder))
            compiled = touch(Path(folder))
        print(
            f"{wheel}: {wheel.stat().st_size / 1e6:.1f} MB; a touch compiles {compiled} functions"
        )
        if compiled:
            raise SystemExit("a fresh install should compile nothing.")


if __name__ == "__main__":
    main()

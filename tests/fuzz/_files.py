"""Good files, small, of every kind that feeler reads: what the damaged ones are made from."""

import tempfile
import warnings
from functools import cache
from pathlib import Path

import numpy as np

import feeler
from feeler.antenna.files import save_antenna
from feeler.decoding.streams import StreamDecoder
from feeler.encoding import ConvolutiveNMF, save_encoder
from feeler.robot.description import write_robot
from feeler.robot.sensors import load_calibration_table, save_calibration
from feeler.tensors import make_tensors
from feeler.tensors.formats import Model, save, save_model

RECORDING = b"""# robot: one
# source: robot
# feature: ball
# size: 1.5 mm
time_ms,hinge1_deg,hinge2_deg,hinge3_deg
0,0.1,0.3,-0.3
1.0,0.5,,1e-3
2,0.1,nan,0.3
3.1,0.1,0.2,0.3
"""
CAPACITANCE = (
    b"\xef\xbb\xbf# speed: 0.3\r\n# unit: pF\r\ntime"
    b" (s);c2;c1\r\n0;1.1;1.2\r\n0.001;1.2;1.3\r\n0.003;-;1.4\r\n"
)
DLTDV = (
    b"pt1_cam1_X,pt1_cam1_Y,pt2_cam1_X,pt2_cam1_Y\n1.5,2.5,NaN,NaN\n2.5,3.5,4.5,5.5\n3,4,5,6\n"
)
FOUR = ",".join(
    f"pt{n}_cam{c}_{axis}" for n in range(1, 5) for c in (1, 2) for axis in "XY"
).encode()
FOUR += b"\n" + b",".join([b"1.25"] * 16) + b"\n" + b",".join([b"NaN", b"3"] * 8) + b"\n"
NAMED = b"left_tip_x;left_tip_y;head_x;head_y\n1.5;2.5;3;4\n2.5;3.5;4.5;5.5\n"
LANDMARKS = (
    b"# source:"
    b" synthetic\nframe\thead_x\thead_y\tabdomen_x\tabdomen_y\n1\t1\t2\t3\t4\n2\t1\t\t3\t4\n"
)
TABLE = (
    b"# robot: one\nhinge,angle_deg,capacitance_pF,time_ms\n1,0,1.0,0\n1,5,1.2,1\n1,9,1.5,2\n"
)
TABLE += b"2,0,1,3\n2,5,1.2,4\n2,9,1.4,5\n"
COUNTS = b"hinge,angle_rad,capacitance_counts\n1,0,100\n1,0,101\n1,0.1,110\n1,0.2,122\n"
TARGETS = (
    b'name = "x"\nstatus = "measured"\n[targets.frequency]\nvalue = 1.0\nspread = 0.1\nunit ='
    b' "Hz"\ntag = "D"\n'
)
TARGETS += b'[targets.ratio_71]\nvalue = 3\nspread = 0\nunit = "1"\n'
TARGETS += b'tag = "P+C"\nnote = """two\nlines"""\n'
TRACES = b"# synthetic: no animal\ntime_ms,one,two\n" + b"".join(
    b"%.1f,%.4f,%.4f\n"
    % (t, np.exp(-t / 20) * np.cos(t / 3), 2 * np.exp(-t / 9) * np.cos(t / 5))
    for t in range(12)
)
SAMPLES = [b"0.5,1.0,2.0,3.0", b"1 2 3", b"nan;1e-3;\t4"]
LINES = (
    b"# robot\ntime_ms,a,b,c\n0,0,0,0\n1,0.01,0,0\n2,0.5,0.1,0\n3,0.9,nan,0.1\n\n"
    b"5,1,0.3,0.1\n6,1,0.3,0.1\n7,1,1,1\n"
)
JOURNAL = b'{"key": "0a"}\n{"name": [[1.0]], "result": [[0.5, 2], 0.1]}\n'
JOURNAL += b'{"name": [[2], "even"], "result": {"bits": 1.5}}\n'
DRAWING = b"""<svg xmlns="http://www.w3.org/2000/svg" width="50mm" viewBox="0 0 100 40">
<defs><path id="unused" d="M 0 0 H 1 V 1 Z"/></defs>
<g transform="translate(10, 3) rotate(20) scale(2 1.5)">
<path id="leaf" d="M 0 0 C 2 3 5 4 8 0 S 9 -4 6 -5 q -2 1 -3 3 t -1 1 A 3 2 10 0 1 0 0 z"/></g>
</svg>
"""
SHAPES = b"""<svg xmlns="http://www.w3.org/2000/svg" width="2in" height="20mm"><rect width="8"
 height="4" rx="1"/></svg>"""
OBJECTS = b"""[[object]]
shape = "ball"
radius = 3.0
[[object]]
name = "lid"
shape = "outline"
vertices = [[0, 0], [2.0, 0], [1, 1.5]]
rounding = 0.1
"""
SMALL = {
    **{"segment_length": [1.0, 2.0, 3.0], "segment_mass": 1e-3, "radius": 0.2},
    **{"stiffness": [3.0, 2.0, 1.0], "damping": 1.0, "name": 'a "name"'},
}


def make_set(n_trials: int = 2):
    """A small valid Dataset."""
    rng = np.random.default_rng(1)
    labels = {
        "feature": ["ball", "wall"],
        "size": [1.5, np.inf],
        "location": [0.5, 0.7],
        "speed": [0.3, 0.06],
    }
    labels |= {"antenna": ["small"] * 2, "source": ["simulation"] * 2, "seed": [1, 2]}
    return make_tensors(
        angle=rng.normal(size=(n_trials, 3, 8)),
        time=np.arange(8.0),
        segment=[1, 2, 3],
        position=np.array([0.0, 0.3, 0.6]),
        segment_length=np.ones(3),
        trials={name: values[:n_trials] for name, values in labels.items()},
        tip=rng.normal(size=(n_trials, 8, 2)),
        attrs={"configuration": {"a": 1}, "versions": {}, "licence": "CC0-1.0"},
    )


@cache
def make_file(name: str) -> bytes:
    """The bytes of a good file; its ending and first letter say which."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, name)
        _write(path)
        return path.read_bytes()


def _write(path: Path) -> None:
    if path.name == "robot.toml":
        write_robot(path, 3)
    elif path.suffix == ".toml":
        more = (
            {"sensors": [1, 3], "rest_angle": [0.1, 0.0, -0.1]}
            if "sensors" in path.name
            else {}
        )
        save_antenna(feeler.Antenna(**SMALL, **more), path)
    elif path.suffix == ".safetensors":
        _write_model(path)
    elif path.suffix == ".json":
        path.with_name("t.csv").write_bytes(TABLE)
        save_calibration(load_calibration_table(path.with_name("t.csv")), path)
    elif path.suffix == ".mcap":
        from tests.robot.test_bags import write

        write(path, topics=("/antenna/touch",))
    else:
        save(make_set(), path)


def _write_model(path: Path) -> None:
    if "network" in path.name:
        _write_network(path)
    elif "decoder" in path.name:
        make_decoder().save(path)
    elif "encoder" in path.name:
        encoder = ConvolutiveNMF(n_components=2, n_lags=3, max_iter=3, random_state=0)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            save_encoder(encoder.fit(np.random.default_rng(0).random((2, 4, 12))), path)
    else:
        arrays, settings = {"a": np.ones((2, 3))}, {"x": [1, "y"], "z": {"w": 1.5}}
        save_model(Model(kind="lda", version=1, arrays=arrays, settings=settings), path)


def _write_network(path: Path) -> None:
    from feeler.decoding.network import TouchNetwork

    X = np.random.default_rng(0).normal(size=(8, 12, 12)).astype(np.float32)
    TouchNetwork((12, 12), max_epochs=1, device="cpu").fit(X, np.arange(8) % 2).save(path)


@cache
def make_decoder() -> StreamDecoder:
    """A decoder of two touches on three sensors."""
    touch = np.zeros((3, 40))
    touch[:, 10:] = 0.5
    decoder = StreamDecoder(window=20, max_lag=2, lag_step=1)
    return decoder.fit([touch, -touch], [("ball", 0.5, 0.3), ("box", 0.5, 0.3)])

"""The verbs around files: info, validate, convert, antenna, and progress."""

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

from feeler.antenna.animals import cockroach
from feeler.antenna.files import load_antenna
from feeler.cli.app import app
from feeler.errors import InvalidInput
from feeler.tensors import make_tensors
from feeler.tensors.formats import Model, save, save_model
from feeler.tensors.writers import save_netcdf


def call(*arguments):
    return CliRunner().invoke(app, [str(item) for item in arguments])


@pytest.fixture
def tensors():
    rng = np.random.default_rng(3)
    labels = {
        "feature": ["ball", "wall"],
        "size": [1.5, np.inf],
        "location": [0.5, 0.7],
        "speed": [0.3, 0.06],
    }
    return make_tensors(
        angle=rng.normal(size=(2, 3, 5)),
        time=np.arange(5.0),
        segment=[1, 2, 3],
        position=np.array([0.0, 0.3, 0.6]),
        segment_length=np.ones(3),
        trials={**labels, "antenna": ["a"] * 2, "source": ["simulation"] * 2, "seed": [1, 2]},
        attrs={"configuration": {"timestep": 0.01}, "licence": "CC0-1.0"},
    )


@pytest.mark.further
@pytest.mark.parametrize("name", ["set.zarr", "set.nc", "set.mat"])
def test_info_says_what_a_file_holds(tmp_path, tensors, name):
    save(tensors, tmp_path / name)
    out = call("info", tmp_path / name).output
    for words in ("angle", "[rad]", "trial ", "ball", "CC0-1.0", "timestep"):
        assert words in out
    assert ("2 of 2 trials finished" in out) == (name == "set.zarr")


def test_info_describes_antennas_and_models(tmp_path):
    assert call("antenna", tmp_path / "a.toml").exit_code == 0
    save_model(
        Model(kind="lda", version=4, arrays={"means": np.zeros((2, 3))}),
        tmp_path / "m.safetensors",
    )
    out = call("info", tmp_path / "a.toml", tmp_path / "m.safetensors").output
    assert "segments    140, 42 mm" in out
    assert "stiffness: [P]" in out
    assert "kind lda, version 4" in out
    assert "means (2, 3) float64" in out


@pytest.mark.parametrize("profile", ["exponential", "uniform"])
def test_the_antenna_written_is_the_preset(tmp_path, profile):
    call("antenna", tmp_path / "a.toml", "--profile", profile, "--sensors", "all")
    got, preset = load_antenna(tmp_path / "a.toml"), cockroach(profile, sensors="all")
    assert got.stiffness.tobytes() == preset.stiffness.tobytes()
    assert got.sensors.tolist() == preset.sensors.tolist()
    assert isinstance(call("antenna", tmp_path / "a.toml").exception, InvalidInput)


def test_validate_accepts_what_is_right_and_names_what_is_wrong(tmp_path, tensors):
    save(tensors, tmp_path / "good.nc")
    wrong = tensors.assign_coords(source=("trial", ["simulation", "guess"]))
    save_netcdf(wrong, tmp_path / "bad.nc")
    save(tensors, tmp_path / "set.zarr")
    assert call("validate", tmp_path / "good.nc", tmp_path / "set.zarr").exit_code == 0
    chunk = tmp_path / "set.zarr" / "angle" / "c.0.0.0"
    chunk.write_bytes(bytes([chunk.read_bytes()[0] ^ 1]) + chunk.read_bytes()[1:])
    result = call(
        "validate",
        tmp_path / "good.nc",
        tmp_path / "bad.nc",
        tmp_path / "set.zarr",
        tmp_path / "absent",
    )
    assert result.exit_code == 1
    assert "good.nc: valid" in result.output
    assert "'source' must be one of simulation, robot, surrogate" in result.output
    assert "c.0.0.0 (trials 0 to 1) is missing or damaged" in result.output
    assert "no such file" in result.output


def test_what_tracks_writes_of_a_posture_is_valid_as_it_is(tmp_path):
    angles = {"bend": ("joint", [0.1, 0.2]), "piece_length": ("piece", [1.0, 2.0, 3.0])}
    xr.Dataset(angles).to_netcdf(tmp_path / "a.posture.nc", engine="h5netcdf")
    found = call("validate", tmp_path / "a.posture.nc")
    assert (found.exit_code, found.output) == (0, f"{tmp_path / 'a.posture.nc'}: valid\n")

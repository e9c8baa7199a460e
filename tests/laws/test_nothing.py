"""Every rule can fail: planted nothing, pushed through the code that computes a claim's values, is
never reproduced and never holds.

Nothing is: white tensors; one tensor, whatever touches; tensors of touches whose labels are
shuffled. Bases of noise are those that white tensors have.
"""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from feeler.decoding.classifiers import make_fitting_lda
from feeler.report import Section
from feeler.studies.paper import data, figS4
from feeler.studies.paper.claims import load_claims
from feeler.studies.paper.context import Context
from feeler.studies.paper.reproduce import STAGES
from feeler.studies.paper.verdicts import judge
from feeler.studies.scale import QUICK, SCALES
from feeler.tensors.dataset import label_units

N_SENSORS, N_TIMES = 12, 190
SWEEP = {
    **QUICK.sweep,
    "ratios": (0.1, 0.3),
    "n_repeats": 3,
    "n_copies": 3,
    "n_restarts": 2,
    "null_iter": 8,
    "twins": "all",
}
SCALE = replace(
    QUICK,
    name="nothing",
    locations=(0.5, 0.7, 0.9),
    restarts=2,
    side_restarts=2,
    max_iter=8,
    sweep=SWEEP,
    network={"ratios": (0.1, 0.3), "n_repeats": 3, "n_copies": 3, "max_epochs": 1},
)
READS_TENSORS = ("encoding", "reading", "cnn")


def _make_white(touches, rng):
    return rng.random((len(touches), N_SENSORS, N_TIMES))


def _make_one(touches, rng):
    return np.repeat(_make_blobs(touches[:1]), len(touches), axis=0)


def _make_shuffled(touches, rng):
    return _make_blobs(touches)[rng.permutation(len(touches))]


def _make_blobs(touches):
    """A blob at the place of contact, the later the slower; its width is the object's size."""
    time, sensor = np.arange(N_TIMES), np.arange(N_SENSORS)
    angle = np.zeros((len(touches), N_SENSORS, N_TIMES))
    for k, trial in enumerate(touches):
        width = 1 + trial.feature.size / 2 + (trial.feature.kind == "ball")
        row = np.exp(-0.5 * ((sensor - N_SENSORS * trial.location) / width) ** 2)
        late = 40 + 60 * trial.location + 20 * (trial.speed < 0.1)
        angle[k] = row[:, None] * np.exp(-0.5 * ((time - late) / (10 * width)) ** 2)
    return angle


NOTHING = {"white": _make_white, "one": _make_one, "shuffled": _make_shuffled}


def _make_dataset(touches, angle):
    coordinates = {
        "feature": [trial.feature.kind for trial in touches],
        "size": [trial.feature.size for trial in touches],
        "location": [trial.location for trial in touches],
        "speed": [trial.speed for trial in touches],
    }
    force = np.ones((len(touches), N_TIMES, 2))
    force[:, -2:] = 0.0  # each lets go within the recording
    dataset = xr.Dataset(
        {
            "angle": (("trial", "sensor", "time"), angle),
            "curvature": (("trial", "sensor", "time"), angle),
            "force": (("trial", "time", "axis"), force),
        },
        coords={"time": np.arange(float(N_TIMES))}
        | {name: ("trial", values) for name, values in coordinates.items()},
    )
    return label_units(dataset)


@pytest.fixture(scope="module", params=list(NOTHING))
def found(request, tmp_path_factory):
    """What the claims of the sections that read tensors say of nothing."""
    out = tmp_path_factory.mktemp(request.param)
    rng = np.random.default_rng(20261123)
    kept = {}

    def load(context, profile, touches, duration, name):
        if name not in kept:
            kept[name] = _make_dataset(touches, NOTHING[request.param](touches, rng))
        return kept[name]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(data, "_load", load)
        patch.setattr(Section, "figure", lambda *args, **options: None)
        patch.setattr(figS4, "import_torch", lambda: _Torch)
        patch.setattr(figS4, "TouchNetwork", lambda shape, **options: make_fitting_lda(18, 3))
        patch.setitem(SCALES._entries, "nothing", SCALE)
        context = Context(scale="nothing", out=out)
        values = {}
        for stage in STAGES:
            if stage.name in READS_TENSORS:
                section = Section(name=stage.name, title="", folder=out, vector=False)
                stage.show(context, section)
                values |= section.values
        yield {claim.id: judge(claim, values, context) for claim in load_claims()}


class _Torch:
    """What Fig. S4 asks of PyTorch beside the network, which an LDA stands for here."""

    get_num_threads = staticmethod(lambda: 1)
    set_num_threads = staticmethod(lambda n: None)


@pytest.mark.parametrize(
    "claim",
    [c for c in load_claims() if c.can_fail and c.section in READS_TENSORS],
    ids=lambda claim: claim.id,
)
def test_nothing_bears_out_no_claim(found, claim):
    judged = found[claim.id]
    said = f"{judged.verdict}: {judged.ours}; {judged.why}"
    assert judged.verdict not in ("not judged", "not comparable"), said
    assert judged.verdict not in ("reproduced", "partly"), said

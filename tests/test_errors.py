"""What a user reads of a warning: one sentence a kind, no place in our code."""

import pickle
import warnings

import pytest

from feeler.errors import ModelValidityWarning, say_warnings


@pytest.fixture
def others(monkeypatch):
    """What is shown as Python shows it."""
    shown = []
    monkeypatch.setattr(warnings, "showwarning", lambda *told: shown.append(str(told[0])))
    return shown


@pytest.mark.filterwarnings("default")
def test_a_kind_of_warning_is_said_once_and_without_our_files(capsys, others):
    say_warnings()
    warnings.warn("sank by 0.56 of the radius", ModelValidityWarning, stacklevel=1)
    warnings.warn("sank by 12 of the radius", ModelValidityWarning, stacklevel=1)
    warnings.warn("moves 3 mm", ModelValidityWarning, stacklevel=1)
    assert capsys.readouterr().err.splitlines() == [
        "feeler: warning: sank by 0.56 of the radius",
        "feeler: warning: moves 3 mm",
    ]
    assert others == []


def test_a_warning_of_ours_is_shown_once_per_place_whatever_its_numbers():
    with warnings.catch_warnings(record=True) as shown:
        warnings.simplefilter("default")
        for depth in (0.56, 12.0):
            warning = ModelValidityWarning("sank too deep.", f"By {depth:g} of the radius.")
            again = pickle.loads(pickle.dumps(warning))
            assert (str(again), again.details) == (str(warning), warning.details)
            warnings.warn(warning, stacklevel=1)
    (one,) = shown
    line = warnings.formatwarning(one.message, one.category, one.filename, one.lineno, "")
    assert "ModelValidityWarning: sank too deep. By 0.56 of the radius." in line


LIBRARY = "/there/site-packages/sklearn/linear_model/_logistic.py"


@pytest.mark.parametrize("asked", [False, True])
def test_a_warning_of_a_library_is_one_sentence_unless_python_was_asked_for_warnings(
    capsys, monkeypatch, others, asked
):
    monkeypatch.setattr("sys.warnoptions", ["default"] if asked else [])
    say_warnings()
    for number in (3, 4):
        text = f"lbfgs failed to converge ({number}):\n  see\n https://scikit-learn.org"
        warnings.showwarning(FutureWarning(text), FutureWarning, LIBRARY, 458)
    warnings.showwarning(RuntimeWarning("x" * 900), RuntimeWarning, "/there/src/feeler/a.py", 1)
    said = [
        "feeler: warning: sklearn: lbfgs failed to converge (3): see https://scikit-learn.org",
        f"feeler: warning: feeler: {'x' * 299}…",
    ]
    assert capsys.readouterr().err.splitlines() == ([] if asked else said)
    assert len(others) == (3 if asked else 0)

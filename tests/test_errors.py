"""What a user reads of a warning: one sentence a kind, no place in our code."""

import warnings

import pytest

from feeler.errors import Doubtful, say_warnings


@pytest.mark.filterwarnings("default")
def test_a_kind_of_warning_is_said_once_and_without_our_files(capsys, monkeypatch):
    others = []
    monkeypatch.setattr(warnings, "showwarning", lambda *told: others.append(str(told[0])))
    say_warnings()
    warnings.warn("sank by 0.56 of the radius", Doubtful, stacklevel=1)
    warnings.warn("sank by 12 of the radius", Doubtful, stacklevel=1)
    warnings.warn("moves 3 mm", Doubtful, stacklevel=1)
    warnings.warn("of another package", UserWarning, stacklevel=1)
    assert capsys.readouterr().err.splitlines() == [
        "feeler: warning: sank by 0.56 of the radius",
        "feeler: warning: moves 3 mm",
    ]
    assert others == ["of another package"]

"""What a worker says whose memory does not suffice, whatever a library makes of the lack."""

import pytest

from feeler.execute import processes

CODE = b"def f():\n    return 1\n"


def raise_and_catch(error, cause=None):
    try:
        raise error from cause
    except Exception as caught:
        return caught


@pytest.mark.parametrize(
    ("content", "lacks"), [(CODE, True), (b"def f(:\n", False), (None, False)]
)
def test_sound_code_that_cannot_be_parsed_is_a_lack_of_memory(tmp_path, content, lacks):
    """Python's parser without memory calls sound code wrong; the same words about code that is
    wrong are about the code.
    """
    file = tmp_path / "code.py"
    if content is not None:
        file.write_bytes(content)
    error = SyntaxError("invalid syntax", (str(file), 1, 1, "def f():", 1, 2))
    assert processes._lacks_memory(raise_and_catch(error)) is lacks
    above = ImportError("cannot import it")
    assert processes._lacks_memory(raise_and_catch(above, error)) is lacks
    assert processes._lacks_memory(SyntaxError("invalid syntax")) is False


def test_looking_again_leaves_the_limit_as_it_was(tmp_path):
    resource = pytest.importorskip("resource")
    (tmp_path / "code.py").write_bytes(CODE)
    before = resource.getrlimit(resource.RLIMIT_DATA)
    assert processes._is_sound(str(tmp_path / "code.py"))
    assert resource.getrlimit(resource.RLIMIT_DATA) == before

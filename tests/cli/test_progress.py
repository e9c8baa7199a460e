"""Long work shows how far it is, without being asked, where somebody looks."""

import io

from feeler.progress import ProgressBar, show_progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_bar_appears_once_patience_is_over_and_one_at_a_time():
    now = iter([0.0, 1.0, 1.0, 4.9, 4.9, 6.0, 6.0, 9.0, 9.0])
    screen, other = Terminal(), Terminal()
    with ProgressBar("touches", patience=5.0, stream=screen, clock=lambda: next(now)) as bar:
        bar(1, 4)
        bar(2, 4)
        assert screen.getvalue() == ""
        bar(3, 4)
        with ProgressBar("within", stream=other) as second:
            second(1, 2)
        bar(4, 4)
    assert "touches" in screen.getvalue() and "4/4" in screen.getvalue()
    assert other.getvalue() == ""
    with ProgressBar("after", stream=other) as third:
        third(2, 2)
    assert "after" in other.getvalue()


def test_what_is_handed_in_is_called_instead():
    seen = []
    with show_progress(lambda *numbers: seen.append(numbers), "x") as advance:
        advance(1, 2)
    assert seen == [(1, 2)]

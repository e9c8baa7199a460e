"""What a board sends."""

from collections.abc import Iterable


def frame_sample(number: int, time: float, values: Iterable[float]) -> str:
    """One sample as a board's sketch sends it, without the end of the line: after the asterisk the
    exclusive or of all bytes before it.
    """
    body = f"{number % 65536},{time:.3f}," + ",".join(f"{value:.6g}" for value in values)
    total = 0
    for byte in body.encode():
        total ^= byte
    return f"${body}*{total:02X}"

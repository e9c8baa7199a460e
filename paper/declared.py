"""What the files of this folder declare, and the orders that the paper claims."""

from functools import cache
from typing import Any

from feeler.files import read_shipped

CLAIMED = ("exponential", "linear", "constant")  # [P] in the order claimed
READ_BETTER = {
    "speed": "slower touch is classified better",
    "profile": "exponential is classified best, constant worst",
}
SPREADS_MORE = {
    "speed": "slower touch spreads tensors more",
    "profile": "exponential spreads tensors most, constant least",
}


@cache
def read_declared(name: str) -> dict[str, Any]:
    """What a TOML file of this folder declares."""
    return read_shipped("paper", name)

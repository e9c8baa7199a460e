"""What the files of this folder declare, and the orders that the paper claims."""

from functools import cache
from importlib.resources import files
from typing import Any

from feeler.toml import parse_toml

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
    text = files("feeler.studies.paper").joinpath(name).read_text(encoding="utf-8")
    return parse_toml(text, name)

"""The orders that the paper claims."""

CLAIMED = ("exponential", "linear", "constant")  # [P] in the order claimed
READ_BETTER = {
    "speed": "slower touch is classified better",
    "profile": "exponential is classified best, constant worst",
}
SPREADS_MORE = {
    "speed": "slower touch spreads tensors more",
    "profile": "exponential spreads tensors most, constant least",
}

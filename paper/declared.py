"""The order of profiles that the paper claims."""

CLAIMED = ("exponential", "linear", "constant")  # [P]

"""The order of profiles that the paper claims."""

CLAIMED = ("exponential", "linear", "uniform")  # [P]

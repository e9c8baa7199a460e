"""The chain engine: MuJoCo's answer for a serial chain at O(n) cost."""

from feeler.physics.chain.engine import SCHEMES, run, run_batch

__all__ = ["SCHEMES", "run", "run_batch"]

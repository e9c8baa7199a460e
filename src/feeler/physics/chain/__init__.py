"""The chain engine: MuJoCo's answer for a serial chain at O(n) cost."""

from feeler.physics.chain.engine import run

__all__ = ["run"]

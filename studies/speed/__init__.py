"""How fast to touch: speed against accuracy against energy. Declared in feeler/tradeoff.toml.

Page: docs/slow_and_graded.md.
"""

"""How well location, size and speed can be read, beside their bounds.

Page: docs/slow_and_graded.md.
"""

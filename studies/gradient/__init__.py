"""What the gradient of stiffness does.

Page: docs/slow_and_graded.md.
"""

"""An antenna designed for sizes and locations that it has not been trained on.

Page: docs/unseen.md.
"""

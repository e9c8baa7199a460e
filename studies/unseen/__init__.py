"""An antenna designed for sizes and locations that it has never met.

Page: docs/unseen.md.
"""

"""Which antenna discriminates best.

Page: docs/searched.md.
"""

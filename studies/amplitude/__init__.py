"""Does a stiffness gradient help by more than a larger signal?

Page: docs/amplitude.md.
"""

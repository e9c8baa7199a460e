"""The chain in space under the same engine names: two bending hinges a segment, and torsion where
there is any.
"""

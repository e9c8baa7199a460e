"""The rod engine: implicit steps as long as one likes, down to an equilibrium; contact at the
hinges and the tip.
"""

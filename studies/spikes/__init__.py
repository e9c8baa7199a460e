"""What the spike trains of an antenna's sensilla convey.

Page: docs/spikes.md.
"""

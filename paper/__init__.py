"""Meng et al. 2025, figure by figure: a module for each figure and movie, claims, and the report.

Start with ``reproduce.py``; ``scale.py`` says how much smoke, quick, published and paper compute.
``python -m paper`` runs it all. Questions beyond the paper are sections from ``studies``.
"""

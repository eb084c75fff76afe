"""Signorini–Coulomb contact: one solver for every analysis."""

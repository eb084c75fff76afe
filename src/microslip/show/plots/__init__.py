"""Figures of a run: one module each, one house style."""

"""A lap joint whose sliding and stuck frequencies lie far apart: the table alone errs by per cents."""

from __future__ import annotations


def coupled_document(pairs, **sections):
    """Its description, with more sections or others."""
    return {
        "beams": {"length": "0.5 m", "thickness": "15 mm", "overlap_half_length": "60 mm"},
        "material": {
            "youngs_modulus": "70 GPa",
            "poissons_ratio": 0.33,
            "density": "2700 kg/m^3",
        },
        "contact": {"friction": 0.35, "pairs": pairs},
        "clamp": {"force": "4e5 N/m", "half_length": "40 mm"},
        "support": {"horizontal_spring": "1e5 N/m/m"},
        "damping": {"beta": "2e-6 s"},
        **sections,
    }

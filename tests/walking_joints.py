"""Lap joints whose bodies walk past each other for long: to places that change their vibration."""

WEAKLY_DAMPED = """
[beams]
length = "0.172683 m"
thickness = "18.3554 mm"
overlap_half_length = "24.4278 mm"
[material]
youngs_modulus = "1.1e11 Pa"
poissons_ratio = 0.3402
density = "4430 kg/m^3"
[contact]
friction = 0.41223
pairs = 41
[clamp]
force = "10169.5 N/m"
half_length = "14.7635 mm"
[support]
horizontal_spring = "1.56058e6 N/m/m"
[damping]
beta = "1.3904e-07 s"
[load]
moment = "2.3224 N*m/m"
"""
"""For 50,000 cycles."""

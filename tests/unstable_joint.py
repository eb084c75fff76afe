"""A lap joint whose larger vibrations are periodic and unstable over a tenth of its band."""

UNSTABLE = """
[beams]
length = "94.3535 mm"
thickness = "5.2558 mm"
overlap_half_length = "14.0192 mm"
[material]
youngs_modulus = "7e10 Pa"
poissons_ratio = 0.3665
density = "2700 kg/m^3"
[contact]
friction = 0.10163
pairs = 41
[clamp]
force = "441437 N/m"
half_length = "11.6891 mm"
[support]
horizontal_spring = "1.59809e8 N/m/m"
[damping]
beta = "8.4575e-07 s"
[load]
moment = "143.41 N*m/m"
"""
"""Without friction 362 to 520 Hz; the larger motion leaves its periodic one below 405 Hz, and beats about it
from 425.7 to 431 Hz."""

LOAD = 143.41

"""A short lap joint of thin plates with few contact pairs, quick to prepare; how it is held is left open."""

SHORT_LAP = """
[beams]
length = "250 mm"
thickness = "12 mm"
overlap_half_length = "37 mm"
[material]
youngs_modulus = "70 GPa"
poissons_ratio = 0.3
density = "2 g/cm^3"
[contact]
friction = 0.3
pairs = 21
[clamp]
force = "1 MN/m"
half_length = "25 mm"
"""

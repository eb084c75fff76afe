"""Lap joints whose bodies walk past each other for long: to places that change their vibration."""

import tomllib
from functools import lru_cache

import numpy as np

import microslip
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import raised_state
from microslip.analyses.time.watching import watched
from microslip.contact.pairs import tangential_vectors
from microslip.pipeline.targets import STEPS
from microslip.typing import Array

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


ENDS_ON_THE_WAY = """
[beams]
length = "0.147699 m"
thickness = "0.0138087 m"
overlap_half_length = "0.0277431 m"
[material]
youngs_modulus = "7e10 Pa"
poissons_ratio = 0.3819
density = "2700 kg/m^3"
[contact]
friction = 0.77119
pairs = 41
[clamp]
force = "136554 N/m"
half_length = "0.0105607 m"
[support]
horizontal_spring = "6.51018e6 N/m/m"
[damping]
beta = "3.57e-07 s"
[load]
moment = "20.001164763 N*m/m"
"""
"""For 5,000 cycles about; its motion is another where bodies are only a little farther apart."""

FALLS = """
[beams]
length = "0.0879581 m"
thickness = "0.00391935 m"
overlap_half_length = "0.0158571 m"
[material]
youngs_modulus = "1.1e11 Pa"
poissons_ratio = 0.2929
density = "4430 kg/m^3"
[contact]
friction = 0.37869
pairs = 31
[clamp]
force = "13095 N/m"
half_length = "0.00895202 m"
[support]
horizontal_spring = "581462 N/m/m"
[damping]
beta = "1.1499e-07 s"
[load]
moment = "0.69237 N*m/m"
"""
"""From the larger of its motions at 391.9 Hz, a periodic and stable one, after some hundred cycles: where its
bodies have walked to by then there is none. Joint 8 of population 16."""


SOON_AT_REST = """
[beams]
length = "0.139425 m"
thickness = "0.0075477 m"
overlap_half_length = "0.050582 m"
[material]
youngs_modulus = "2.1e11 Pa"
poissons_ratio = 0.2907
density = "7850 kg/m^3"
[contact]
friction = 0.09149
pairs = 41
[clamp]
force = "7.33073e6 N/m"
half_length = "0.0206085 m"
[support]
horizontal_spring = "1.87954e8 N/m/m"
[damping]
beta = "4.1821e-07 s"
[load]
moment = "3200.2976 N*m/m"
"""
"""Within a hundred cycles at 454.16 Hz. Joint 11 of population 34."""


def better_held(times: float) -> str:
    """The same joint with a support spring so many times as stiff."""
    return WEAKLY_DAMPED.replace('"1.56058e6 N/m/m"', f'"{1.56058e6 * times:.6g} N/m/m"')


@lru_cache
def marched_alone(described: str, frequency: float, load: float) -> tuple[Array, Array]:
    """Sizes of the vibration over 4000 cycles from rest, and where the bodies stand after each."""
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(described)))
    scheme = time_scheme(joint, 1 / (frequency * STEPS), frequency=frequency)
    raised = raised_state(scheme, frequency, load, 10)
    Q, states = watched(scheme, load, raised, 4000)
    return np.abs(Q), np.array([tangential_vectors(one.v, 2).mean() for one in states])

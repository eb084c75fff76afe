"""How large a load is. Exactly one key says it, and it fits the port that is driven.

moment                              M, N m per metre of width
moment_over_clamp_force_length      M / (P L), P the clamp force per width, L the beams' length
rho                                 C mu P L / M, with one constant C for every joint
force                               F of a named port, N per metre of width
acceleration                        a of a base, m/s²
pressure                            p on a surface of a mesh, Pa
"""

from __future__ import annotations

from typing import Literal, Self, get_args

from pydantic import Field, model_validator

from microslip.describe.quantities import (
    NAME,
    Acceleration,
    Accelerations,
    Forces,
    LineForce,
    LineMoment,
    Moments,
    Number,
    Pressures,
    Ratios,
    Rhos,
    Rule,
    Section,
    Stress,
)

LoadKey = Literal[
    "moment", "moment_over_clamp_force_length", "rho", "force", "acceleration", "pressure"
]

LOAD_KEYS: tuple[LoadKey, ...] = get_args(LoadKey)
"""The keys that can give a load, in the order that messages name them."""

RHO_CONSTANT = 1.985e-3
"""C in ``rho = C mu P L / M``: with it the reference joint is damped most at rho = 2.4, as the paper
finds (``microslip reproduce``, which calibrates it). A file may give another, `Load.rho_scale`."""


class Amplitude(Section):
    """A section in which one of several keys gives the load; what they hold is its own."""

    @property
    def load_key(self) -> LoadKey | None:
        """Which key gives the load; None where none does."""
        return next(iter(self._given()), None)

    def check_load(self) -> LoadKey:
        """The key that gives the load; raise `Rule` unless it is exactly one."""
        given = self._given()
        if len(given) != 1:
            found = " and ".join(given) if given else "none"
            raise Rule("", f"give exactly one of {', '.join(LOAD_KEYS)}; found {found}")
        return given[0]

    def _given(self) -> list[LoadKey]:
        return [key for key in LOAD_KEYS if getattr(self, key) is not None]


class OneAmplitude(Amplitude):
    """The load of one history, as a section that may do without."""

    moment: LineMoment | None = Field(default=None, gt=0)
    """Amplitude of the end moment M, per metre of width; or one of the next two. How far the
    contact slips."""
    moment_over_clamp_force_length: Number | None = Field(default=None, gt=0)
    """The same as M/(P L), without dimension. Instead of moment."""
    rho: Number | None = Field(default=None, gt=0)
    """The same as rho = C mu P L / M, with the constant of [load]. Instead of moment."""
    force: LineForce | None = Field(default=None, gt=0)
    """Amplitude of the force, per metre of width. Where load.port is a force."""
    acceleration: Acceleration | None = Field(default=None, gt=0)
    """Amplitude of the acceleration. Where load.port is a base."""
    pressure: Stress | None = Field(default=None, gt=0)
    """Amplitude of the pressure. Where load.port is one, of a mesh."""


class Load(Amplitude):
    """What drives the joint, and its amplitudes: exactly one of the keys that give them.

    ``rho = C mu P L / M`` with C = `RHO_CONSTANT`, unless `rho_scale` gives another. ``rho = 0`` is
    the joint without friction.
    """

    port: str | None = Field(default=None, pattern=NAME, max_length=40)
    """Name of the [[port]] that drives the joint; left out, equal moments at both far ends. Every
    analysis and history."""
    moment: Moments | None = None
    """Amplitudes of the end moment M, per metre of width. All that is forced: exactly one of these
    keys gives it."""
    moment_over_clamp_force_length: Ratios | None = None
    """The same as M/(P L), without dimension. Compares joints of different size: they open where
    it reaches overlap_half_length/length."""
    rho: Rhos | None = None
    """The same as rho = C mu P L / M; 0 is the joint without friction. For those who follow the
    paper."""
    force: Forces | None = None
    """Amplitudes of the force, per metre of width. Where port is a force."""
    acceleration: Accelerations | None = None
    """Amplitudes of the acceleration. Where port is a base."""
    pressure: Pressures | None = None
    """Amplitudes of the pressure. Where port is one, of a mesh."""
    rho_scale: Number | None = Field(default=None, gt=0)
    """C itself, instead. Only for loads by rho."""

    @property
    def kind(self) -> LoadKey:
        """Which of the keys gives the load."""
        return self.check_load()

    @property
    def values(self) -> tuple[float, ...]:
        """The values of that key."""
        values: tuple[float, ...] = getattr(self, self.kind)
        return values

    @model_validator(mode="after")
    def _one_load(self) -> Self:
        kind = self.check_load()
        if kind != "rho" and "rho_scale" in self.model_fields_set:
            raise Rule("rho_scale", f"only belongs to load.rho, and the load is given by {kind}")
        return self

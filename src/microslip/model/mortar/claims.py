"""Places that two entries of a joint claim: what is tied cannot slide, and no place touches twice.

A place is a pair of facets of which a mortar segment is made. Surfaces may have facets in common, and one
surface may be tied in one part and in contact in another: only where both entries couple the same facet
with the same facet do they contradict each other.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from microslip.errors import InputError
from microslip.model.mesh.facets import facets_of
from microslip.model.mesh.finite_elements import FiniteElementMesh, Surface, Tie
from microslip.model.mortar.coupling import reach_of
from microslip.model.mortar.flat import faces_of_flat
from microslip.model.mortar.segments import segments
from microslip.model.mortar.ties import tolerance_of
from microslip.typing import Array

SLIVER = 1e-9
"""Of the area of an interface: less in common is rounding at the edges of facets."""

Place = frozenset[tuple[int, ...]]
"""Nodes of the facets that meet."""


@dataclass(frozen=True)
class Claim:
    """Two surfaces, or one and a rigid flat, that an entry couples.

    Attributes
    ----------
    said : str
        What the entry is called in messages.
    sides : tuple of str
        Names of one or two surfaces.
    reach : float, optional
        Distance up to which they are coupled, m; as contact has it when left out.
    flat : (d,) array, optional
        Normal of the rigid flat of one surface.
    offset : float
        Of the flat along its normal, m.
    """

    said: str
    sides: tuple[str, ...]
    reach: float | None = None
    flat: Array | None = None
    offset: float = 0.0


def claim_of_tie(mesh: FiniteElementMesh, tie: Tie) -> Claim:
    """What a tie claims."""
    return Claim(tie.said, (tie.slave, tie.master), tolerance_of(mesh, tie))


def check_claims(
    mesh: FiniteElementMesh, interfaces: Sequence[Claim], ties: Iterable[Tie] = ()
) -> None:
    """Raise `InputError` where a tie bonds what is in contact, or two interfaces are of the same place.

    Parameters
    ----------
    mesh : FiniteElementMesh
    interfaces : sequence of Claim
        Their surfaces are known to the mesh.
    ties : iterable of Tie
    """
    for tie in ties:
        bond = claim_of_tie(mesh, tie)
        for one in interfaces:
            share = _shared(mesh, one, bond)
            if share > SLIVER:
                raise InputError(
                    f"{bond.said} bonds {tie.slave!r} to {tie.master!r} over {_percent(share)} of "
                    f"{one.said}, {' and '.join(map(repr, one.sides))}: what is tied can neither slide nor "
                    "open. Take the tie out, or let the interface be of surfaces that no tie bonds"
                )
    for one, other in combinations(interfaces, 2):
        share = _shared(mesh, one, other)
        if share > SLIVER:
            raise InputError(
                f"{one.said} and {other.said} are of the same surfaces over {_percent(share)} of the first: "
                "a place is in contact once. Leave one of them, or give each surfaces of its own"
            )


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share > 0.01 else "less than 1 %"


def _same_kind(one: Claim, other: Claim) -> bool:
    """Whether both are of two surfaces, or of flats that look the same way."""
    if one.flat is None or other.flat is None:
        return one.flat is other.flat
    sizes = float(np.linalg.norm(one.flat) * np.linalg.norm(other.flat))
    return float(one.flat @ other.flat) > (1 - SLIVER) * sizes


def _may_meet(mesh: FiniteElementMesh, one: Sequence[str], other: Sequence[str]) -> bool:
    """Whether each side of one has a face in common with another side of the other."""
    keys = [[_keys(mesh.surface(name)) for name in sides] for sides in (one, other)]
    ways = ((0, 1), (1, 0)) if len(one) > 1 else ((0,),)
    return any(
        all(np.isin(keys[0][k], keys[1][way[k]]).any() for k in range(len(way))) for way in ways
    )


def _keys(surface: Surface) -> Array:
    return np.asarray(16 * surface.elements + surface.faces)


def _shared(mesh: FiniteElementMesh, one: Claim, other: Claim) -> float:
    """Part of the area of one that the other has too."""
    if not (_same_kind(one, other) and _may_meet(mesh, one.sides, other.sides)):
        return 0.0
    mine, theirs = _places(mesh, one), _places(mesh, other)
    both = sum(min(area, theirs[place]) for place, area in mine.items() if place in theirs)
    return both / max(sum(mine.values()), 1e-300)


def _places(mesh: FiniteElementMesh, claim: Claim) -> dict[Place, float]:
    """Area on which each facet meets another one, or the flat."""
    out: dict[Place, float] = {}
    for place, area in _meetings(mesh, claim):
        out[place] = out.get(place, 0.0) + area
    return out


def _meetings(mesh: FiniteElementMesh, claim: Claim) -> Iterator[tuple[Place, float]]:
    sides = [facets_of(mesh, name) for name in claim.sides]
    reach = reach_of(sides, claim.reach)
    if claim.flat is not None:
        unit = claim.flat / np.linalg.norm(claim.flat)
        found = faces_of_flat(sides[0], unit, claim.offset, reach)
    else:
        # the finer side first, as pairs have it
        own, other = sorted(sides, key=lambda side: side.size())
        found = segments(own, other, reach)
    for _, part in found:
        mine, theirs = np.sort(part.slave_nodes), np.sort(part.master_nodes)
        for a, b, area in zip(mine, theirs, part.weight.sum(axis=1), strict=True):
            yield frozenset((tuple(map(int, a)), tuple(map(int, b)))), float(area)

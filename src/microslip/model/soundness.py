"""Whether matrices of another program can be what they are said to be, and the usual mistakes by name.

Signs of eigenvalues are counted without computing any: with ``A = L D L^T`` there are as many negative
ones as entries of D (Sylvester).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph as csgraph
import scipy.sparse.linalg as spla

from microslip.brief import Brief
from microslip.describe.matrices import MatricesJoint
from microslip.errors import Caution, InputError
from microslip.model.numbering import OUT_OF_PLANE, Numbering
from microslip.model.pair_soundness import check_pairs
from microslip.model.pair_table import Pairs
from microslip.model.readers.found import said
from microslip.model.structure import Structure
from microslip.numerics.factors import factorise
from microslip.typing import Array

ASYMMETRY = 1e-8
"""Of the largest entry, what K and M may differ from their transposes: more is not rounding."""

PENALTY = 1e7
"""A diagonal entry so many times the largest beside it, and the usual diagonal, is a constraint."""

STILL = 1e-9
"""Of the stiffness of single degrees of freedom, what a motion without stiffness has at most."""

FEWEST = 12
"""Degrees of freedom that modes can be computed of."""

MOST_MOTIONS = 24
"""Motions without stiffness that are looked for."""

RIGID = {2: 3, 3: 6}
"""Rigid motions of a body in the plane and in space."""

SLOWEST, FASTEST = 1e-2, 1e6
"""Lowest elastic frequencies that a joint may have, Hz: others are a matter of units."""

LONGER, SHORTER = 3.0, 0.02
"""The sum of the areas over the length of the interface may be between these."""


def check_matrices(
    stiffness: sp.csc_matrix, mass: sp.csc_matrix, numbering: Numbering | None, joint: MatricesJoint
) -> None:
    """Raise `InputError` where K or M cannot be those of a structure."""
    m = joint.matrices
    if stiffness.shape[0] < FEWEST:
        raise InputError(
            f"matrices.stiffness: {m.stiffness}: {stiffness.shape[0]} degrees of freedom; at least {FEWEST} "
            "are needed: microslip.prepare_joint takes smaller models"
        )
    for key, matrix, source in (("stiffness", stiffness, m.stiffness), ("mass", mass, m.mass)):
        where = f"matrices.{key}: {source}"
        if not np.isfinite(matrix.data).all():
            raise InputError(f"{where}: has entries that are not finite numbers")
        _check_symmetry(matrix, where, numbering)
        diagonal = matrix.diagonal()
        if (diagonal < 0).any():
            k = int(np.argmin(diagonal))
            raise InputError(
                f"{where}: the diagonal entry of {_dof(k, numbering)} is {diagonal[k]:.3g}: neither "
                "stiffness nor mass can be negative; is the sign, or the order of K and M, right?"
            )
        _check_penalties(matrix, where, numbering)
    bare = np.flatnonzero(stiffness.diagonal() <= 0)
    if len(bare):
        raise InputError(
            f"matrices.stiffness: {m.stiffness}: {_dof(int(bare[0]), numbering)} has no stiffness at all, as "
            f"{len(bare)} of {stiffness.shape[0]} have not: a node without elements, or a direction that its "
            "elements do not have; take it out of both matrices"
        )
    if not mass.diagonal().sum() > 0:
        raise InputError(f"matrices.mass: {m.mass}: is zero")
    _check_definite(stiffness, mass, joint)


def _dof(k: int, numbering: Numbering | None) -> str:
    """A degree of freedom in words, counted from 1 where nothing else is known."""
    return f"degree of freedom {k + 1}" if numbering is None else said(numbering.labels[k])


def _check_symmetry(matrix: sp.csc_matrix, where: str, numbering: Numbering | None) -> None:
    apart = abs(matrix - matrix.T).tocoo()
    largest = float(np.abs(matrix.data).max(initial=0.0))
    if not apart.nnz or apart.data.max() <= ASYMMETRY * largest:
        return
    k = int(np.argmax(apart.data))
    i, j = int(apart.row[k]), int(apart.col[k])
    raise InputError(
        f"{where}: is not symmetric: between {_dof(i, numbering)} and {_dof(j, numbering)} it is "
        f"{matrix[i, j]:.6g} one way and {matrix[j, i]:.6g} the other: friction, gyroscopic or follower "
        "terms, or half a matrix; give the symmetric matrix, or say matrices.stored"
    )


def _check_penalties(matrix: sp.csc_matrix, where: str, numbering: Numbering | None) -> None:
    diagonal = matrix.diagonal()
    rest = abs(matrix - sp.diags(diagonal)).max(axis=0)
    beside = np.asarray(rest.todense()).ravel() if sp.issparse(rest) else np.asarray(rest).ravel()
    usual = float(np.median(diagonal[diagonal > 0])) if (diagonal > 0).any() else 0.0
    huge = np.flatnonzero((diagonal > PENALTY * beside) & (diagonal > PENALTY * usual))
    if not len(huge):
        return
    k = int(huge[np.argmax(diagonal[huge])])
    raise InputError(
        f"{where}: the diagonal entry of {_dof(k, numbering)} is {diagonal[k]:.3g}, "
        f"{diagonal[k] / usual:.1g} times the usual one, as {len(huge)} are: a support by penalty; take "
        "rows and columns of what is held out of both matrices"
    )


def negative_directions(matrix: sp.csc_matrix) -> int:
    """How many eigenvalues of a symmetric regular matrix are negative.

    Examples
    --------
    >>> negative_directions(sp.csc_matrix(np.diag([2.0, -1.0, 3.0])))
    1
    """
    found = factorise(matrix).negative
    if found is not None:
        return found
    return 0 if matrix.shape[0] > 2000 else int((np.linalg.eigvalsh(matrix.toarray()) < 0).sum())


def _check_definite(stiffness: sp.csc_matrix, mass: sp.csc_matrix, joint: MatricesJoint) -> None:
    m = joint.matrices
    size = float(stiffness.diagonal().sum() / mass.diagonal().sum())
    heavy = mass + 1e-9 * sp.diags(np.full(mass.shape[0], mass.diagonal().mean()))
    if count := negative_directions(heavy.tocsc()):
        raise InputError(
            f"matrices.mass: {m.mass}: has {count} negative eigenvalues: no motion has a negative mass; is "
            "it the mass matrix, and whole?"
        )
    if count := negative_directions((stiffness + 1e-8 * size * heavy).tocsc()):
        raise InputError(
            f"matrices.stiffness: {m.stiffness}: has {count} negative eigenvalues, beyond rounding: a "
            "structure without load cannot release energy; is it whole, without a preload that buckles "
            "it, and in the order of the mass?"
        )


@dataclass(frozen=True, repr=False)
class ZeroModes(Brief):
    """Motions without stiffness, or with next to none.

    Attributes
    ----------
    shapes : (n, e) array
    names : tuple of str
        What each is, as far as it is known.
    most : int
        Largest number of them in one connected part.
    parts : int
        Connected parts.
    first : float
        Lowest natural frequency of the others, Hz.
    """

    shapes: Array
    names: tuple[str, ...]
    most: int
    parts: int
    first: float


def zero_modes(
    stiffness: sp.csc_matrix, mass: sp.csc_matrix, numbering: Numbering | None
) -> ZeroModes:
    """Motions without stiffness, by the connected part of the structure that moves.

    Of each part, translations and the turn are told apart where its directions and coordinates are known.
    """
    n = stiffness.shape[0]
    count, parts = csgraph.connected_components(stiffness, directed=False)
    size = float(stiffness.diagonal().sum() / mass.diagonal().sum())
    shift = 1e-9 * size
    wanted = min(MOST_MOTIONS, n - 2)
    values, shapes = _lowest(stiffness, mass, shift, wanted)
    weight = np.einsum("ij,i,ij->j", shapes, stiffness.diagonal(), shapes)
    still = np.abs(values) <= STILL * np.maximum(weight, 0.0)
    first = float(np.sqrt(max(values[~still].min(initial=np.inf), 0.0)) / (2 * np.pi))
    null = shapes[:, still]
    if not null.shape[1]:
        return ZeroModes(np.zeros((n, 0)), (), 0, count, first)
    names: list[str] = []
    most = 0
    largest = float(np.linalg.norm(null, axis=0).max())
    for part in range(count):
        own = null * (parts == part)[:, None]
        rank = np.linalg.matrix_rank(own, tol=1e-6 * largest)
        body = f"part {part + 1} of {count}" if count > 1 else "the structure"
        most = max(most, int(rank))
        names += _named(own, int(rank), parts == part, numbering, body)
    return ZeroModes(null, tuple(names), most, count, first)


def _lowest(
    stiffness: sp.csc_matrix, mass: sp.csc_matrix, shift: float, count: int
) -> tuple[Array, Array]:
    """Lowest eigenvalues, (rad/s)², and mass-normalised shapes."""
    n = stiffness.shape[0]
    solve = factorise(stiffness + shift * mass).solve
    operator = spla.LinearOperator((n, n), matvec=solve, dtype=float)
    start = np.sin(1.0 + np.arange(n) ** 1.5)
    values, shapes = spla.eigsh(
        stiffness, k=count, M=mass, sigma=-shift, OPinv=operator, which="LM", v0=start
    )
    order = np.argsort(values)
    return values[order], shapes[:, order]


def _named(
    null: Array, rank: int, inside: Array, numbering: Numbering | None, body: str
) -> list[str]:
    """Names of the motions of one part."""
    if not rank:
        return []
    if numbering is None:
        return [f"a motion of {body}"] * rank
    basis = np.linalg.svd(null, full_matrices=False)[0][:, :rank]
    axes = "xyz" if numbering.spatial else "xy"
    moves = [numbering.translation(axis) * inside for axis in axes]
    turns = [turn * inside for turn in numbering.rotations()]
    found = [
        f"translation along {axis} of {body}"
        for axis, move in zip(axes, moves, strict=True)
        if _shared(basis, [move])
    ]
    found += [f"translation of {body}"] * (_shared(basis, moves) - len(found))
    found += [f"rotation of {body}"] * (_shared(basis, [*moves, *turns]) - len(found))
    left = rank - len(found)
    if 0 < left <= len(axes) * (len(axes) - 1) // 2 - len(turns):
        return [*found, *[f"another motion of {body}, probably its rotation"] * left]
    return [*found, *[f"a mechanism of {body}"] * left]


def _shared(basis: Array, motions: list[Array]) -> int:
    """How many directions of the span of motions lie in that of an orthonormal basis.

    Their singular values are the cosines of the angles between the two.
    """
    sizes = [float(np.linalg.norm(motion)) for motion in motions]
    columns = [motion / size for motion, size in zip(motions, sizes, strict=True) if size > 0]
    if not columns:
        return 0
    own, size, _ = np.linalg.svd(np.column_stack(columns), full_matrices=False)
    cosines = np.linalg.svd(basis.T @ own[:, size > 1e-6 * size[0]], compute_uv=False)
    return int((cosines > 1 - 1e-6).sum())


def check_size_of_motions(motions: Array, source: str, dofs: int) -> None:
    """Raise `InputError` where motions that a file gives are not columns of the degrees of freedom."""
    rows, columns = motions.shape
    if rows == dofs:
        return
    hint = ": it is transposed" if columns == dofs else ""
    raise InputError(
        f"matrices.motions: {source} is {rows} by {columns}, and must have {dofs} rows{hint}"
    )


def check_motions(
    structure: Structure,
    modes: ZeroModes,
    numbering: Numbering | None,
    pairs: Pairs,
    joint: MatricesJoint,
) -> list[Caution]:
    """Raise `InputError` where motions without stiffness cannot be those of bodies; doubts are returned."""
    count = modes.parts
    found = modes.shapes.shape[1]
    source = joint.matrices.stiffness
    mechanisms = [name for name in modes.names if "mechanism" in name]
    relative, cautions = structure.interface.relative, []
    d = structure.interface.dimension
    if d == 2 and numbering is not None and np.isin(numbering.direction, OUT_OF_PLANE).any():
        cautions.append(_out_of_plane(numbering))
    where = "in space" if d == 3 or cautions else "in the plane"
    rigid = RIGID[3 if d == 3 or cautions else 2]
    if mechanisms or modes.most > rigid or found >= MOST_MOTIONS:
        many = f"{MOST_MOTIONS} or more" if found >= MOST_MOTIONS else f"{found}"
        raise InputError(
            f"matrices.stiffness: {source}: {many} motions have no stiffness, where {count} connected "
            f"{'part has' if count == 1 else 'parts have'} at most {rigid} rigid ones each "
            f"{where}: hinges, loose nodes, elements with too few integration points, hidden degrees of "
            "freedom (C3D8I of CalculiX), or a list of degrees of freedom in another order than K; there "
            f"are: {'; '.join(dict.fromkeys(modes.names)) or 'none'}"
        )
    check_pairs(relative, structure.stiffness, numbering, pairs, joint)
    return [
        *cautions,
        *_incomplete(modes, numbering, source),
        *_frequencies(modes, joint),
        *(_areas_in_space(pairs, joint) if d == 3 else _areas(pairs, joint)),
    ]


def _out_of_plane(numbering: Numbering) -> Caution:
    """That pairs in the plane are of a structure that moves out of it."""
    outside = int(np.isin(numbering.direction, OUT_OF_PLANE).sum())
    return Caution(
        "input",
        f"matrices.dofs: {outside} degrees of freedom out of the plane",
        "the pairs touch in the plane of x and y, and z is only carried along",
        "is the structure uniform over its width? Normals of pairs in space have a component nz",
    )


def _incomplete(modes: ZeroModes, numbering: Numbering | None, source: str) -> list[Caution]:
    """That a part can be moved along all axes without force and not be turned, as no body is held."""
    axes = "xyz" if numbering is not None and numbering.spatial else "xy"
    if numbering is None or numbering.coordinates(len(axes)) is None:
        return []
    turns = len(axes) * (len(axes) - 1) // 2
    bodies = dict.fromkeys(name.partition(" of ")[2] for name in modes.names)
    return [
        Caution(
            "input",
            f"matrices.stiffness: {source}",
            f"{body} moves along {', '.join(axes[:-1])} and {axes[-1]} without force, and does not turn",
            "a rotation is missing among the motions without stiffness: are all terms of K there, and are "
            "the coordinates of matrices.dofs those of its nodes?",
        )
        for body in bodies
        if {f"translation along {axis} of {body}" for axis in axes} <= set(modes.names)
        and modes.names.count(f"rotation of {body}") < turns
    ]


def _frequencies(modes: ZeroModes, joint: MatricesJoint) -> list[Caution]:
    """That the lowest elastic frequency is none of a joint."""
    if SLOWEST <= modes.first <= FASTEST:
        return []
    m = joint.matrices
    return [
        Caution(
            "input",
            f"matrices.length_unit = {m.length_unit}, matrices.force_unit = {m.force_unit}",
            f"the lowest elastic frequency is {modes.first:.3g} Hz",
            f"are the units right? With {m.force_unit} and {m.length_unit} the mass is in "
            f"{m.force_unit} s²/{m.length_unit}; tonnes go with N and mm",
        )
    ]


def _areas(pairs: Pairs, joint: MatricesJoint) -> list[Caution]:
    """That the areas are not those of the interface."""
    if pairs.count < 2 or joint.whole:
        return []
    length = float(np.ptp(pairs.position)) * pairs.count / (pairs.count - 1)
    ratio = float(pairs.area.sum()) / length
    if SHORTER <= ratio <= LONGER:
        return []
    return [
        Caution(
            "input",
            f"{joint.interface.pairs}: area",
            f"the areas over the width are {ratio:.3g} times as long as the positions reach",
            "are areas in length_unit², of the whole width, and is matrices.width right?",
        )
    ]


def _areas_in_space(pairs: Pairs, joint: MatricesJoint) -> list[Caution]:
    """The same of interfaces in space, over the square of their length: wide ones have at most that."""
    length = float(np.ptp(pairs.position))
    ratio = joint.width * float(pairs.area.sum()) / max(length, 1e-300) ** 2
    if pairs.count < 4 or SHORTER**2 <= ratio <= LONGER**2:
        return []
    return [
        Caution(
            "input",
            f"{joint.interface.pairs}: area",
            f"the areas are {ratio:.3g} times the square of the length that the positions reach",
            "are areas in length_unit²?",
        )
    ]

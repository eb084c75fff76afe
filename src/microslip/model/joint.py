"""The joint model: all that any analysis needs to know of a structure, and its reduction.

Free-interface modes (kept dynamic) plus the residual flexibility of everything truncated, seen at
the contact pairs and at the ports. This is the massless-boundary form of component mode synthesis
(Monjaraz-Tec, Gross & Krack, Computers & Structures 260 (2022) 106698):

    eta'' + c eta' + omega² eta + Psi^T r = G^T a
    v = Psi eta + V_res a - W_res r
    y = G^T eta + P_res a - V_res^T r

A port is a load vector ``p`` and, by reciprocity, the output ``y = p^T x``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from microslip.brief import Brief
from microslip.errors import ModelError
from microslip.model.bodies import BodyMotions
from microslip.model.interface_compliance import interface_compliance
from microslip.model.loose import held, loose_modes, separated
from microslip.model.modes import LinearModes, PartFactors, linear_modes, spectral_shift
from microslip.model.structure import Structure
from microslip.typing import Array, Indices

IDLE = 1e-12
"""Of the largest row of B: one that moves no more is held."""

OUTWEIGHS = 10.0
"""A mode is an unknown of statics where it is softer than all stiffer ones by this factor."""


@dataclass(frozen=True, repr=False)
class JointModel(Brief):
    """Reduced model of a joint with free contact pairs; per metre of width in 2D, SI units.

    With modal coordinates ``eta`` (k), port amplitudes ``a`` (p) and reactions ``r`` (d m):

        eta'' + (alpha + beta omega²) eta' + D eta' + omega² eta = port_modes^T a - mode_v^T r
        v = mode_v eta + port_v a - residual r          relative displacement of the pairs
        y = port_modes^T eta + port_port a - port_v^T r  output conjugate to each port

    Attributes
    ----------
    position, area : (m,) arrays
        Of the contact pairs, m.
    dimension : int
        Components per contact pair.
    omega : (k,) array
        Circular frequencies of the kept free-interface modes, rad/s.
    equilibrium_modes : int
        The first so many modes (rigid-body or nearly so) are unknowns in static equilibrium.
    mode_v : (d m, k) array
        Relative displacements of the modes.
    residual : (d m, d m) array
        Residual flexibility at the pairs, m/N.
    ports : tuple of str
        Names of the ports.
    port_modes : (k, p) array
        Ports seen by the modes.
    port_v : (d m, p) array
        Residual relative displacement per unit port load.
    port_port : (p, p) array
        Residual flexibility between ports.
    rayleigh : tuple of float
        alpha (1/s) and beta (s).
    image : (m,) int array, optional
        Where a half turn of the structure onto itself takes each pair; None where it has no such
        symmetry.
    bodies : BodyMotions, optional
        Rigid motions of the bodies; None where they are not known.
    supports : (k, k) array, optional
        Stiffness of the springs to the ground in the kept modes, ``Phi^T K_s Phi``, (rad/s)².
    damping : (k, k) array, optional
        D, symmetric: what the kept modes are damped by beyond alpha and beta, 1/s; couples them.
    """

    position: Array
    area: Array
    dimension: int
    omega: Array
    equilibrium_modes: int
    mode_v: Array
    residual: Array
    ports: tuple[str, ...]
    port_modes: Array
    port_v: Array
    port_port: Array
    rayleigh: tuple[float, float]
    image: Indices | None = None
    bodies: BodyMotions | None = None
    supports: Array | None = None
    damping: Array | None = None

    @property
    def pairs(self) -> int:
        """Number of contact pairs."""
        return len(self.position)

    @property
    def loose_motions(self) -> int:
        """How many of the first modes only keep a place and are unknowns in static equilibrium.

        Where bodies hang together by more than contact the joint as a whole may be free: that moves no pair,
        and is no unknown.
        """
        return min(loose_modes(self.omega), self.equilibrium_modes)

    @property
    def usual_omega(self) -> float:
        """Median circular frequency of the modes that are not nearly rigid, rad/s.

        Of all modes rigid ones may be the most: three free bodies have eighteen.
        """
        e = self.equilibrium_modes
        return float(np.median(self.omega[e:] if e < len(self.omega) else self.omega))

    def port(self, name: str) -> int:
        """Column of a port; raises `ModelError` naming the ports there are."""
        if name not in self.ports:
            raise ModelError(f"no port {name!r}; this model has {', '.join(self.ports)}")
        return self.ports.index(name)

    def amplitudes(self, loads: Mapping[str, float]) -> Array:
        """(p,) amplitudes of all ports from those of a few; raises `ModelError` as `port` does."""
        a = np.zeros(len(self.ports))
        for name, amplitude in loads.items():
            a[self.port(name)] += amplitude
        return a

    def with_modal_ports(self, shapes: Mapping[str, Array]) -> JointModel:
        """The model with more ports that act on the kept modes alone.

        Parameters
        ----------
        shapes : mapping of str to (k,) array
            Coordinates in the free-interface modes of mass-normalised shapes Phi: the ports are
            their inertia loads ``M Phi``, the outputs ``Phi^T M x``. Nothing of them is in the
            residual flexibility.
        """
        count = len(shapes)
        columns = np.column_stack([np.zeros((len(self.omega), 0)), *shapes.values()])
        return replace(
            self,
            ports=(*self.ports, *shapes),
            port_modes=np.hstack([self.port_modes, columns]),
            port_v=np.hstack([self.port_v, np.zeros((len(self.port_v), count))]),
            port_port=np.pad(self.port_port, ((0, count), (0, count))),
            bodies=None if self.bodies is None else self.bodies.with_modal_ports(columns),
        )

    def modal_damping(self) -> Array:
        """``alpha + beta omega²`` of each mode, 1/s."""
        alpha, beta = self.rayleigh
        return alpha + beta * self.omega**2

    def damping_matrix(self) -> Array:
        """``diag(alpha + beta omega²) + D`` of the kept modes, 1/s."""
        own = np.diag(self.modal_damping())
        return own if self.damping is None else own + self.damping

    def damping_beyond(self, shapes: Array) -> Array:
        """``shapes^T D shapes`` of columns (k, n) or one shape (k,), 1/s; zero without D."""
        if self.damping is None:
            return np.zeros(shapes.shape[1:] * 2)
        return np.asarray(shapes.T @ self.damping @ shapes)

    def truncated(self, modes: int, omega: float = 0.0) -> JointModel:
        """Keep fewer modes dynamic; the rest joins the residual flexibility and has its damping, by beta.

        Parameters
        ----------
        modes : int
            How many, the lowest.
        omega : float
            Circular frequency (rad/s) of the motion that the others follow with their inertia; 0 for none.
        """
        if not self.equilibrium_modes <= modes <= len(self.omega):
            raise ModelError(
                f"cannot keep {modes} modes: between {self.equilibrium_modes} and "
                f"{len(self.omega)} are possible"
            )
        cut = slice(modes, None)
        flexibility = 1 / (self.omega[cut] ** 2 - omega**2)
        v, g = self.mode_v[:, cut], self.port_modes[cut]
        return replace(
            self,
            omega=self.omega[:modes],
            mode_v=self.mode_v[:, :modes],
            residual=self.residual + (v * flexibility) @ v.T,
            port_modes=self.port_modes[:modes],
            port_v=self.port_v + (v * flexibility) @ g,
            port_port=self.port_port + (g.T * flexibility) @ g,
            bodies=None
            if self.bodies is None
            else replace(self.bodies, modes=self.bodies.modes[:modes]),
            supports=None if self.supports is None else self.supports[:modes, :modes],
            damping=None if self.damping is None else self.damping[:modes, :modes],
        )


def bonded_modes(
    model: JointModel, bonded: Indices, compliance: Array | None = None
) -> tuple[Array, Array]:
    """Modes of the joint model with components of v bonded.

    ``r = W_bb^-1 Psi_b eta`` adds the stiffness ``Psi_b^T W_bb^-1 Psi_b``. Compared with the same
    modes of the full structure they measure the error of the reduction.

    Parameters
    ----------
    model : JointModel
    bonded : (b,) int array
        Components of v.
    compliance : (d m,) array, optional
        Of an elastic contact, m/N: the bond is behind it.

    Returns
    -------
    omega : (k,) array
        Circular frequencies, rad/s, ascending.
    shapes : (k, k) array
        Columns, in the free-interface modes, mass-normalised.
    """
    psi, W = model.mode_v[bonded], model.residual[np.ix_(bonded, bonded)]
    if compliance is not None:
        W = W + np.diag(compliance[bonded])
    bond = psi.T @ np.linalg.solve(W, psi)
    values, shapes = np.linalg.eigh(np.diag(model.omega**2) + 0.5 * (bond + bond.T))
    return np.sqrt(np.maximum(values, 0.0)), shapes


class Reducer:
    """Reduction of a structure: one factorisation, any number of ports.

    Parameters
    ----------
    structure : Structure
    modes : int
        Number of free-interface modes kept dynamic.
    rayleigh : tuple of float
        alpha, beta.
    free : bool
        Whether bodies may be held by nothing at all, see `microslip.model.loose`.
    """

    def __init__(
        self,
        structure: Structure,
        modes: int,
        rayleigh: tuple[float, float],
        *,
        free: bool = False,
    ) -> None:
        if modes >= structure.dofs - 1:
            raise ModelError(f"cannot keep {modes} modes of {structure.dofs} degrees of freedom")
        self.structure = structure
        self.rayleigh = rayleigh
        self.damping: Array | None = None
        self._shift = spectral_shift(structure)
        self._shifted = (structure.stiffness + self._shift * structure.mass).tocsc()
        self._factors = PartFactors(self._shifted)
        none = np.array([], dtype=np.int64)
        self.modes: LinearModes = linear_modes(structure, none, modes, factors=self._factors)
        self.loose = 0
        if free:
            self.modes, self.loose = separated(self.modes, structure.stiffness, structure.interface)
        self._mass_modes = structure.mass @ self.modes.shapes
        self.equilibrium_modes = soft_modes(
            held(self.modes.omega, self.loose)[0],
            structure.interface.relative @ self.modes.shapes,
            self._truncated_flexibility(),
        )

    def _truncated_flexibility(self) -> float:
        """Mean flexibility of a pair's component that the truncated modes have, estimated with one load.

        For entries of z that are 1 or -1 at random the mean of ``z^T W z`` is the trace of W.
        """
        relative = self.structure.interface.relative
        z = np.where(np.sin(1.0 + np.arange(relative.shape[0]) ** 1.5) < 0, -1.0, 1.0)
        load = relative.T @ z
        elastic = load - self._mass_modes @ (self.modes.shapes.T @ load)
        return max(0.0, float(elastic @ self._factors.solve(elastic[:, None])[:, 0])) / len(z)

    def residual_response(self, loads: Array) -> Array:
        """Static response of the truncated modes to load vectors (columns)."""
        rigid = slice(0, self.equilibrium_modes)
        shapes, mass_shapes = self.modes.shapes, self._mass_modes
        elastic = loads - mass_shapes[:, rigid] @ (shapes[:, rigid].T @ loads)
        x = self._factors.solve(elastic)
        x -= shapes[:, rigid] @ (mass_shapes[:, rigid].T @ x)
        kept = slice(self.equilibrium_modes, None)
        weight = 1 / (self.modes.omega[kept] ** 2 + self._shift)
        return x - (shapes[:, kept] * weight) @ (shapes[:, kept].T @ loads)

    def _residual_flexibility(self) -> Array:
        """Relative displacement of the truncated modes under unit relative forces."""
        relative = self.structure.interface.relative.tocsr()
        rigid, kept = slice(0, self.equilibrium_modes), slice(self.equilibrium_modes, None)
        shapes = self.modes.shapes
        try:
            whole = interface_compliance(
                self._shifted,
                relative,
                shapes[:, rigid],
                self._mass_modes[:, rigid],
                self._factors.orders,
            )
        except ModelError:
            # an interface whose factors cannot be kept last: one solve per component
            return np.asarray(relative @ self.residual_response(relative.T.toarray()))
        mode_v = relative @ shapes[:, kept]
        return whole - (mode_v / (self.modes.omega[kept] ** 2 + self._shift)) @ mode_v.T

    def model(self, ports: Mapping[str, Array]) -> JointModel:
        """Joint model with the given ports (name to load vector)."""
        interface = self.structure.interface
        relative = interface.relative
        vectors = np.column_stack(list(ports.values()))
        x = self.residual_response(vectors)
        residual = with_idle_components(self._residual_flexibility(), relative)
        port_port = vectors.T @ x
        omega, springs = held(self.modes.omega, self.loose)
        supports = self.structure.supports
        if supports is not None:
            springs = springs + self.modes.shapes.T @ (supports @ self.modes.shapes)
        return JointModel(
            position=interface.position,
            area=interface.area,
            dimension=interface.dimension,
            omega=omega,
            equilibrium_modes=self.equilibrium_modes,
            mode_v=relative @ self.modes.shapes,
            residual=0.5 * (residual + residual.T),
            ports=tuple(ports),
            port_modes=self.modes.shapes.T @ vectors,
            port_v=relative @ x,
            port_port=0.5 * (port_port + port_port.T),
            rayleigh=self.rayleigh,
            damping=self.damping,
            image=interface.image,
            bodies=self._bodies(vectors),
            supports=None if supports is None and not self.loose else springs,
        )

    def _bodies(self, vectors: Array) -> BodyMotions | None:
        """The rigid motions of the structure with ports of the given load vectors."""
        motions = self.structure.motions
        if motions is None:
            return None
        return BodyMotions(
            v=self.structure.interface.relative @ motions,
            ports=vectors.T @ motions,
            modes=self._mass_modes.T @ motions,
        )

    def with_ports(self, model: JointModel, ports: Mapping[str, Array]) -> JointModel:
        """The same model with more ports, without solving for the interface again."""
        vectors = np.column_stack(list(ports.values()))
        old = np.column_stack([self.structure.loads[name] for name in model.ports])
        x = self.residual_response(vectors)
        mixed = old.T @ x
        port_port = vectors.T @ x
        return replace(
            model,
            ports=(*model.ports, *ports),
            port_modes=np.hstack([model.port_modes, self.modes.shapes.T @ vectors]),
            port_v=np.hstack([model.port_v, self.structure.interface.relative @ x]),
            port_port=np.block(
                [[model.port_port, mixed], [mixed.T, 0.5 * (port_port + port_port.T)]]
            ),
            bodies=None
            if model.bodies is None or self.structure.motions is None
            else model.bodies.with_ports(vectors.T @ self.structure.motions),
        )


def with_idle_components(residual: Array, relative: sp.csr_matrix) -> Array:
    """Flexibility of the pairs, with some for components that supports hold, as on planes of symmetry.

    Nothing is felt of their reactions, which are therefore not determined; with a flexibility of their own,
    the median of the others, they are zero.

    Examples
    --------
    >>> with_idle_components(np.diag([2.0, 0.0]), sp.csr_matrix([[1.0], [0.0]])).tolist()
    [[2.0, 0.0], [0.0, 2.0]]
    """
    size = np.asarray(abs(relative).sum(axis=1)).ravel()
    idle = np.flatnonzero(size <= IDLE * size.max(initial=0.0))
    if not len(idle):
        return residual
    own = residual.diagonal()
    out = residual.copy()
    out[idle, idle] += np.median(own[own > 0]) if (own > 0).any() else 1.0
    return out


def soft_modes(omega: Array, mode_v: Array, truncated: float = 0.0) -> int:
    """How many of the lowest modes are so soft that statics takes them as unknowns.

    Any mode may be taken so, it changes nothing but the conditioning: the flexibility at the pairs
    is the sum of ``phi phi^T / omega²`` over the modes, and one that outweighs `OUTWEIGHS` times
    all the stiffer ones together would drown them. Supports of any stiffness are served: the
    modes of a body on weak springs are taken, those of a body on stiff ones are like any other.

    Parameters
    ----------
    omega : (k,) array
        Ascending, rad/s.
    mode_v : (d m, k) array
        Relative displacements of the modes.
    truncated : float
        Flexibility that the modes beyond these have at a pair: stiffer than all of them, m/N.

    Examples
    --------
    >>> soft_modes(np.array([0.1, 100.0, 200.0]), np.ones((2, 3)))
    1
    >>> soft_modes(np.array([50.0, 100.0, 200.0]), np.ones((2, 3)))
    0
    """
    tiny = 1e-12 * omega[-1]
    share = (np.abs(mode_v).max(axis=0) / np.maximum(omega, tiny)) ** 2
    stiffer = share[::-1].cumsum()[::-1] - share + truncated
    soft = np.flatnonzero(share[:-1] > OUTWEIGHS * stiffer[:-1])
    return int(soft[-1]) + 1 if len(soft) else 0

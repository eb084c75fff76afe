"""What a run will cost before it is run: a rule fitted to a 2020s core, good to a factor of three.

Bolted joints in space at random (`benchmarks/population/meshes.py`) are met in the median; one in ten takes
ten times as long, where motions creep or many pairs slip at once.

One function per analysis, the column ``cost`` of `microslip.registry.ANALYSES`: seconds on one core,
and 0 where it is not asked for. What they share is the contact step, so many seconds per
squared contact pair.
"""

from __future__ import annotations

import math
import os
from functools import singledispatch

from microslip.describe.beam import first_frequency
from microslip.describe.joint import Joint
from microslip.describe.lap import LapJoint
from microslip.describe.matrices import MatricesJoint
from microslip.describe.mesh import MeshJoint
from microslip.describe.requests import CYCLES_EACH, MARCHED_EACH
from microslip.describe.saved_model import ModelJoint
from microslip.errors import InputError
from microslip.model.described_mesh import read_described_mesh
from microslip.model.imported import read_imported
from microslip.model.lap import geometry, mesh_control
from microslip.model.lap_mesh import lap_joint_meshes
from microslip.model.readers.files import read_matrix, read_table
from microslip.pipeline.excitation import prepare_histories
from microslip.pipeline.saved_model import read_saved
from microslip.registry import column

CONTACT_STEP = 8e-9
"""Seconds per squared contact pair and step of load or time, in the plane."""

SPATIAL_LOAD_STEP, SPATIAL_TIME_STEP = 2e-8, 7e-9
"""The same in space: steps of load, in which pairs go from stick to slip, and of time or of a mode's motion,
few of which change any. Medians of 39 bolted joints at random, 42 to 414 pairs."""

TIME_CYCLES = 31
"""Cycles of plain marching that raising the load, the search with its deviations and the stability of what it
finds are worth: median of eleven points of four joints, 22 to 61."""

FINER_CYCLES = 26
"""The same of seeking it on with eight times the steps: median of twelve points of the reference joint. Three
or four times as many where 16 and 32 times the steps are taken."""

SETTLING = 15
"""Cycles of a steady state that settles, on average, and of what is looked at where one does not."""

RESONANCES = 30
"""Cycles of plain marching that a table of resonances is worth: some sixteen motions, small loads first."""

SPATIAL_BASE, SPATIAL_GROWTH = 3.2e-6, 1.5
"""Seconds to reduce a mesh in space, and the power of its degrees of freedom that they go with: factors of
bodies (`benchmarks/scale.py`, 7,500 to 123,000 degrees of freedom)."""

BASE_BYTES = 2.5e8
"""Of memory whatever the joint."""

SPATIAL_BYTES = 2.6e4
"""Of memory per degree of freedom of a mesh in space, for its factors."""

SPATIAL_PAIR_BYTES = 10 * 8 * 3**2
"""Of memory per squared pair in space: ten dense matrices of its components."""


@singledispatch
def contact_pairs(joint: Joint) -> int:
    """Contact pairs of a described joint, read from its files where it has any."""
    raise NotImplementedError(f"no contact pairs are known of {type(joint).__name__}")


@contact_pairs.register
def _lap_pairs(joint: LapJoint) -> int:
    return joint.contact.pairs_used


@contact_pairs.register
def _listed_pairs(joint: MatricesJoint) -> int:
    return len(next(iter(read_table(joint.interface.pairs).values())))


@contact_pairs.register
def _mesh_pairs(joint: MeshJoint) -> int:
    return read_described_mesh(joint).pairs.count


@contact_pairs.register
def _saved_pairs(joint: ModelJoint) -> int:
    return read_saved(joint).model.pairs


@singledispatch
def is_spatial(joint: Joint) -> bool:
    """Whether contact pairs of a described joint have two tangential directions."""
    return False


@is_spatial.register
def _listed_is_spatial(joint: MatricesJoint) -> bool:
    return read_imported(joint).structure.interface.dimension == 3


@is_spatial.register
def _mesh_is_spatial(joint: MeshJoint) -> bool:
    return read_described_mesh(joint).structure.interface.dimension == 3


@is_spatial.register
def _saved_is_spatial(joint: ModelJoint) -> bool:
    return read_saved(joint).model.dimension == 3


@singledispatch
def rough_frequency(joint: Joint) -> float:
    """About the lowest natural frequency of a described joint, Hz: of a uniform beam, or of the structure
    without contact."""
    raise NotImplementedError(f"no frequency is known of {type(joint).__name__}")


@rough_frequency.register
def _beam_frequency(joint: LapJoint) -> float:
    return first_frequency(joint)


@rough_frequency.register
def _structure_frequency(joint: MatricesJoint) -> float:
    return read_imported(joint).first_frequency


@rough_frequency.register
def _mesh_frequency(joint: MeshJoint) -> float:
    return read_described_mesh(joint).first_frequency


@rough_frequency.register
def _saved_frequency(joint: ModelJoint) -> float:
    return read_saved(joint).principal().sliding_frequency


@singledispatch
def degrees_of_freedom(joint: Joint) -> int:
    """Degrees of freedom of a described joint, without those that supports hold."""
    raise NotImplementedError(f"no degrees of freedom are known of {type(joint).__name__}")


@degrees_of_freedom.register
def _matrix_size(joint: MatricesJoint) -> int:
    return int(read_matrix(joint.matrices.stiffness).matrix.shape[0])


@degrees_of_freedom.register
def _size_of_mesh(joint: MeshJoint) -> int:
    return read_described_mesh(joint).structure.dofs


@degrees_of_freedom.register
def _modes_of_saved(joint: ModelJoint) -> int:
    return len(read_saved(joint).model.omega)


@degrees_of_freedom.register
def _mesh_size(joint: LapJoint) -> int:
    meshes = lap_joint_meshes(geometry(joint), mesh_control(joint))
    held = sum(
        {"pinned": 1, "clamped": 2 * (2 * len(set(mesh.p[1])) - 1), "free": 0}[end]
        for mesh, end in zip(meshes, (joint.support.left, joint.support.right), strict=True)
    )
    return sum(2 * (mesh.p.shape[1] + mesh.facets.shape[1]) for mesh in meshes) - held


def memory(joint: Joint, dofs: int) -> float:
    """Bytes at the peak, while the model is reduced: five times its columns at all pairs, and a base.

    In space factors of the whole and ten matrices of the size of the flexibility.
    """
    pairs = contact_pairs(joint)
    if is_spatial(joint):
        return BASE_BYTES + SPATIAL_BYTES * dofs + SPATIAL_PAIR_BYTES * pairs**2
    return BASE_BYTES + 5 * 16 * dofs * pairs


def memory_of_machine() -> float:
    """Bytes that are installed; infinite where the system does not say."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (ValueError, OSError, AttributeError):
        return math.inf


def check_size(joint: Joint, dofs: int) -> None:
    """Refuse what the machine cannot hold, before anything is spent.

    Raises
    ------
    InputError
        Where the mesh has fewer degrees of freedom than modes are wanted, or more than there is
        memory for.
    """
    if joint.modes_kept >= dofs - 1:
        raise InputError(
            f"{joint.modes_key} = {joint.modes_kept}: there are only {dofs} degrees of freedom"
        )
    needed, there = memory(joint, dofs), memory_of_machine()
    if needed > there:
        raise InputError(
            f"{joint.pairs_key} = {contact_pairs(joint)}: needs about {needed / 1e9:.0f} GB of memory and "
            f"{total_seconds(joint, dofs) / 3600:.0f} h, and this machine has {there / 1e9:.0f} GB: "
            f"{_smaller(joint, dofs, there)}"
        )


def _smaller(joint: Joint, dofs: int, there: float) -> str:
    """What would fit into so much memory."""
    if not is_spatial(joint):
        return "take fewer contact pairs; 201 resolve most joints"
    left = there - BASE_BYTES - SPATIAL_BYTES * dofs
    if left < 0.25 * there:
        return (
            f"the factors of {dofs} degrees of freedom alone take {SPATIAL_BYTES * dofs / 1e9:.0f} GB; mesh "
            "the bodies coarser away from their interfaces, or have another program condense them and give "
            "its matrices"
        )
    return (
        f"{math.sqrt(left / SPATIAL_PAIR_BYTES):.0f} pairs would fit; mesh the interfaces coarser, or tie "
        "what of them cannot slip"
    )


def total_seconds(joint: Joint, dofs: int) -> float:
    """`base_seconds`, and the cost of every analysis that the joint asks for."""
    return sum((cost(joint) for _, cost in column("cost")), base_seconds(joint, dofs))


def base_seconds(joint: Joint, dofs: int) -> float:
    """To start, compile and write, and to reduce the model, per degree of freedom and pair; in space by the
    growth of its factors."""
    if is_spatial(joint):
        return 5.0 + SPATIAL_BASE * dofs**SPATIAL_GROWTH
    return 5.0 + 6e-7 * dofs * contact_pairs(joint)


def cycle_seconds(joint: Joint) -> float:
    """Quasi-static cycles: an amplitude takes five on average."""
    asked = joint.analysis.cycle
    if asked is None:
        return 0.0
    cycles = len(joint.drives) * len(joint.cycle_amplitudes()) * min(5, asked.max_cycles)
    return _cycle(joint, asked.steps) * cycles


def response_seconds(joint: Joint) -> float:
    """Responses of the reduced models, per frequency; the cycles that may check them or put them right."""
    asked = joint.analysis.response
    if asked is None or joint.load is None:
        return 0.0
    loads = len(joint.load.values)
    checks = asked.checks * SETTLING if "refined" in joint.variants else 0
    each = {
        "auto": asked.points * (2 * CYCLES_EACH + MARCHED_EACH),
        "corrected": asked.corrections * SETTLING,
    }
    cycles = 0 if joint.frictionless else loads * each.get(asked.method, checks)
    return 5e-5 * loads * len(joint.variants) * asked.count + _marched(joint, cycles * 150)


def refined_seconds(joint: Joint) -> float:
    """Table of the refined model: cycles with the motion prescribed, or in space resonances."""
    if "refined" not in joint.variants or joint.frictionless:
        return 0.0
    asked = joint.analysis.reduced
    cycles = asked.amplitudes * min(5, asked.max_cycles) + 100
    resonances = 150 * RESONANCES if is_spatial(joint) else 0
    return _marched(joint, max(asked.steps * cycles, resonances))


def backbone_seconds(joint: Joint) -> float:
    """Backbones: three cycles per amplitude, with the motion prescribed four times as many.

    By harmonic balance 6e-6 s per squared pair, harmonic and amplitude.
    """
    asked = joint.analysis.backbone
    if asked is None:
        return 0.0
    cycle = _cycle(joint, asked.steps)
    each = {
        "quasi_static": 3 * cycle,
        "prescribed": 12 * cycle,
        "harmonic": 6e-6 * contact_pairs(joint) ** 2 * asked.harmonics,
    }
    return len(asked.modes) * asked.count * sum(each[method] for method in asked.methods)


def harmonic_seconds(joint: Joint) -> float:
    """Harmonic balance: 60 points along the branch, each as dear as one asked for.

    3e-6 s per squared pair and harmonic; as much again for stability; adaptive ones four times as
    much.
    """
    asked = joint.analysis.harmonic
    if asked is None or joint.load is None:
        return 0.0
    point = 3e-6 * contact_pairs(joint) ** 2 * asked.branch_harmonics
    each = point * (4 if asked.harmonics == "adaptive" else 1) + point * asked.stability
    return len(joint.load.values) * (60 * point + len(asked.band()) * each)


def time_seconds(joint: Joint) -> float:
    """Steady states by time integration, from every start: `TIME_CYCLES` and `FINER_CYCLES` to each."""
    asked = joint.analysis.time
    if asked is None or joint.load is None:
        return 0.0
    points = len(joint.load.values) * len(asked.band())
    cycles = min(TIME_CYCLES, 10 + asked.max_cycles) + FINER_CYCLES * asked.step_refinement
    return _marched(joint, points * len(asked.starts) * asked.steps * cycles)


def history_seconds(joint: Joint) -> float:
    """Every step of all histories, at an estimate of the sliding frequency.

    Raises
    ------
    InputError
        Where a signal cannot be used.
    """
    signals = prepare_histories(
        joint.analysis.history, rough_frequency(joint), joint.driven.load.parsed
    )
    return _marched(joint, sum(len(signal.load) - 1 for signal in signals))


def _cycle(joint: Joint, steps: int) -> float:
    """So many steps of load."""
    return _steps(joint, steps, SPATIAL_LOAD_STEP)


def _marched(joint: Joint, steps: int) -> float:
    """So many steps of time, or of a mode's motion."""
    return _steps(joint, steps, SPATIAL_TIME_STEP)


def _steps(joint: Joint, steps: int, in_space: float) -> float:
    each = in_space if is_spatial(joint) else CONTACT_STEP
    return each * contact_pairs(joint) ** 2 * steps

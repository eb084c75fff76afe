"""A prepared joint in a file: model, contact law, preload and mode, as they are.

The file is a NumPy archive of arrays by name (``.npz``, nothing pickled), so that any program may read the
model out of it: with the names of `JointModel`,

    eta'' + (alpha + beta omega²) eta' + D eta' + omega² eta = port_modes^T a - mode_v^T r
    v = mode_v eta + port_v a - residual r

(D is ``damping``, where there is one: format 2). All that analyses take is stored, the prestress too, with
every bit: what a joint answers that is read again is what it answered before.
"""

from __future__ import annotations

import os
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint, flexibility_of
from microslip.analyses.prepared.joint_modes import JointMode
from microslip.analyses.prepared.prestress import Prestress
from microslip.analyses.prepared.saved_soundness import faults_of_entries, faults_of_joint
from microslip.contact.law import ContactLaw
from microslip.contact.solver import Solution
from microslip.errors import InputError
from microslip.model.bodies import BodyMotions
from microslip.model.joint import JointModel
from microslip.typing import Array
from microslip.version import __version__

FORMAT = "microslip joint model"
"""What the file says that it is."""

FORMAT_VERSION = 1
"""Of what stands in it."""

COUPLED_VERSION = 2
"""Where damping couples the modes, which programs that read the first would leave out."""

PER = {
    "width": "SI units, per metre of width: forces N/m, moments N m/m, energies J/m",
    "whole": "SI units, of the whole structure: N, N m, J",
}
"""What forces and energies may be of."""

SUFFIX = ".npz"


def save_model(joint: PreparedJoint, path: str | Path, *, per: str = "width") -> Path:
    """Write a prepared joint to a file that `load_model` reads.

    Parameters
    ----------
    joint : PreparedJoint
    path : path
        Ends with ``.npz``.
    per : {"width", "whole"}
        What its forces and energies are of; stated in the file, nothing is converted.

    Raises
    ------
    InputError
        Where the name ends otherwise, or nothing can be written there.

    Examples
    --------
    >>> import microslip, tempfile, os
    >>> joint = microslip.prepare(microslip.reference_joint(pairs=21))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     again = load_model(save_model(joint, os.path.join(folder, "joint.npz")))
    >>> bool(np.array_equal(again.model.residual, joint.model.residual))
    True
    """
    file = Path(path)
    if file.suffix.lower() != SUFFIX:
        raise InputError(f"{file}: a saved model is a file {SUFFIX}")
    entries: dict[str, Any] = {
        "format": np.array(FORMAT),
        "format_version": np.array(
            FORMAT_VERSION if joint.model.damping is None else COUPLED_VERSION
        ),
        "program_version": np.array(__version__),
        "units": np.array(PER[per]),
        "drive": np.array(joint.drive),
    }
    entries |= dict(_model_entries(joint.model))
    entries |= {"friction": joint.law.friction, "compliance": joint.law.compliance}
    held = joint.prestress
    entries |= {
        "preload_ports": np.array(list(held.preload)),
        "preload": np.array([float(a) for a in held.preload.values()]),
        "prestress_pressure": held.pressure,
        "prestress_touching": held.touching,
    }
    entries |= {f"prestress_{key}": np.asarray(getattr(held.solution, key)) for key in SOLUTION}
    if joint.mode is not None:
        entries |= dict(_mode_entries(joint.mode))
    beside = file.with_name(file.name + ".part")
    try:
        with open(beside, "wb") as stream:
            np.savez(stream, **entries)
        os.replace(beside, file)
    except OSError as error:
        raise InputError(f"{file}: cannot be written: {error.strerror or error}") from None
    finally:
        beside.unlink(missing_ok=True)
    return file


SOLUTION = tuple(field.name for field in fields(Solution))
OPTIONAL = ("image", "supports", "damping")
"""Arrays that a model may be without."""

BODIES = tuple(field.name for field in fields(BodyMotions))
MODE = tuple(
    field.name
    for field in fields(JointMode)
    if field.name not in ("load_on_sliding", "load_on_stuck")
)


def _model_entries(model: JointModel) -> Iterator[tuple[str, Array]]:
    """All that a model holds, by name."""
    for field in fields(JointModel):
        value = getattr(model, field.name)
        if field.name == "bodies":
            if value is not None:
                yield from ((f"bodies_{key}", getattr(value, key)) for key in BODIES)
        elif value is not None:
            yield field.name, np.asarray(value)


def _mode_entries(mode: JointMode) -> Iterator[tuple[str, Array]]:
    """All that a mode holds, by name."""
    yield from ((f"mode_{key}", np.asarray(getattr(mode, key))) for key in MODE)
    for state in ("sliding", "stuck"):
        loads: Mapping[str, float] = getattr(mode, f"load_on_{state}")
        yield f"mode_load_on_{state}_ports", np.array(list(loads))
        yield f"mode_load_on_{state}", np.array([float(a) for a in loads.values()])


def load_model(path: str | Path) -> PreparedJoint:
    """Read a prepared joint that `save_model` wrote.

    Raises
    ------
    InputError
        Where the file is another one, was written in a later format, is not whole, or holds what cannot
        be: numbers that are none, sizes that do not fit, signs, names of ports that are not there, a
        prestress that is not that of the model.
    """
    return _Saved(Path(path)).joint()


def units_of(path: str | Path) -> str:
    """Of `PER`: what the forces and energies of a saved model are of; raises as `load_model` does."""
    return _Saved(Path(path)).per()


def load_with_units(path: str | Path) -> tuple[PreparedJoint, str]:
    """A saved joint, and what its forces are of, from one reading; raises as `load_model` does."""
    saved = _Saved(Path(path))
    return saved.joint(), saved.per()


class _Saved:
    """The arrays of a file, by name."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            with np.load(path, allow_pickle=False) as found:
                self.arrays = {name: found[name] for name in found.files}
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
        except (ValueError, EOFError, AttributeError, TypeError, zipfile.BadZipFile):
            raise InputError(
                f"{path}: is no saved model, or not all of one; microslip export writes one"
            ) from None
        if str(self.arrays.get("format", "")) != FORMAT:
            there = ", ".join(list(self.arrays)[:5]) or "nothing"
            raise InputError(
                f"{path}: is no saved model, it holds {there}; microslip export writes one"
            )
        version = str(self["format_version"])
        if version not in map(str, (FORMAT_VERSION, COUPLED_VERSION)):
            raise InputError(
                f"{path}: is of format {version}, written by microslip {self['program_version']}; this is "
                f"{__version__} and reads formats {FORMAT_VERSION} and {COUPLED_VERSION}: write it again "
                "from its joint file"
            )

    def __getitem__(self, name: str) -> Any:
        if name not in self.arrays:
            raise InputError(f"{self.path}: is not whole, {name} is missing: write it again")
        return self.arrays[name]

    def __contains__(self, name: str) -> bool:
        return name in self.arrays

    def named(self, ports: str, values: str) -> dict[str, float]:
        """Values by the names of ports."""
        names, given = self[ports], self[values]
        if names.shape != given.shape:
            raise InputError(
                f"{self.path}: {values} is {given.shape}, and {ports} {names.shape}: write it again"
            )
        return dict(zip(map(str, names), map(float, given), strict=True))

    def per(self) -> str:
        """Of `PER`: what forces and energies are of."""
        said = str(self["units"])
        for per, units in PER.items():
            if said == units:
                return per
        raise InputError(f"{self.path}: is in units that are not known: {said!r}")

    def joint(self) -> PreparedJoint:
        """Everything put together again, sizes, signs and names checked."""
        self._refuse(faults_of_entries(self.arrays))
        self._check_scalars()
        model = self._model()
        law = ContactLaw(self["friction"], self["compliance"])
        self._check_shapes(model)
        solution = Solution(
            **{key: self[f"prestress_{key}"] for key in ("r", "v", "q", "status")},
            residual=float(self["prestress_residual"]),
            iterations=int(self["prestress_iterations"]),
        )
        start = Prestress(
            self.named("preload_ports", "preload"),
            solution,
            self["prestress_pressure"],
            self["prestress_touching"],
        )
        mode = self._mode() if "mode_number" in self else None
        with np.errstate(all="ignore"):  # what has no such flexibility is refused below
            flexibility = flexibility_of(model, law)
        joint = PreparedJoint(model, flexibility, start, law, str(self["drive"]), mode)
        self._refuse(faults_of_joint(joint))
        return joint

    def _refuse(self, faults: Iterator[str]) -> None:
        """Raise `InputError` with the first of some faults."""
        for fault in faults:
            raise InputError(
                f"{self.path}: {fault}; the file was changed or is not whole: write it again"
            )

    def _check_scalars(self) -> None:
        """That the numbers that sizes follow from are such."""
        known = {
            "dimension": (2, 3),
            "equilibrium_modes": range(np.size(self["omega"]) + 1),
            "drive": None,
            "prestress_residual": None,
            "prestress_iterations": None,
        }
        for name, allowed in known.items():
            if self[name].shape != () or (allowed is not None and int(self[name]) not in allowed):
                raise InputError(f"{self.path}: {name} cannot be {self[name]}: write it again")
        dimensions = {"ports": 1, "position": 1, "omega": 1, "rayleigh": 1}
        for name, there in dimensions.items():
            if self[name].ndim != there:
                raise InputError(
                    f"{self.path}: {name} is {self[name].shape}, and must be a list: write it again"
                )

    def _check_shapes(self, model: JointModel) -> None:
        """That arrays have the sizes that follow from the pairs, modes and ports."""
        m, n, p = model.pairs, model.dimension * model.pairs, len(model.ports)
        k = len(model.omega)
        shapes = {
            "rayleigh": (2,),
            "prestress_touching": (m,),
            **dict.fromkeys(("area", "friction", "prestress_pressure", "prestress_status"), (m,)),
            **dict.fromkeys(("compliance", "prestress_r", "prestress_v"), (n,)),
            "mode_v": (n, k),
            "residual": (n, n),
            "port_modes": (k, p),
            "port_v": (n, p),
            "port_port": (p, p),
            "prestress_q": (model.equilibrium_modes,),
        }
        may_be = {"image": (m,), "supports": (k, k), "damping": (k, k)}
        shapes |= {name: shape for name, shape in may_be.items() if name in self}
        for name, shape in shapes.items():
            if self[name].shape != shape:
                raise InputError(
                    f"{self.path}: {name} is {self[name].shape}, and must be {shape}: write it again"
                )

    def _model(self) -> JointModel:
        bodies = None
        if "bodies_v" in self:
            bodies = BodyMotions(**{key: self[f"bodies_{key}"] for key in BODIES})
        given = {
            field.name: self[field.name]
            for field in fields(JointModel)
            if field.name not in OPTIONAL and field.name != "bodies"
        }
        given |= {name: self[name] for name in OPTIONAL if name in self}
        given |= {
            "dimension": int(given["dimension"]),
            "equilibrium_modes": int(given["equilibrium_modes"]),
            "ports": tuple(str(name) for name in given["ports"]),
            "rayleigh": tuple(float(x) for x in given["rayleigh"]),
        }
        return JointModel(**given, bodies=bodies)

    def _mode(self) -> JointMode:
        given: dict[str, Any] = {key: self[f"mode_{key}"] for key in MODE}
        for key, value in given.items():
            if value.ndim == 0:
                given[key] = value.item()
        for state in ("sliding", "stuck"):
            name = f"mode_load_on_{state}"
            given[f"load_on_{state}"] = self.named(f"{name}_ports", name)
        return JointMode(**given)

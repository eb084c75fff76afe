"""A mesh from a file of any kind that is read."""

from __future__ import annotations

from pathlib import Path

from microslip.errors import InputError
from microslip.model.mesh.abaqus.inp import read_inp
from microslip.model.mesh.ansys.cdb import ENDING, read_cdb
from microslip.model.mesh.finite_elements import FiniteElementMesh
from microslip.model.mesh.foreign import ENDINGS, read_foreign


def read_mesh(path: Path, *, length: float = 1.0, force: float = 1.0) -> FiniteElementMesh:
    """Mesh of a file: ``.inp`` of Abaqus and CalculiX, ``.cdb`` of ANSYS, ``.msh`` of Gmsh, or of VTK.

    Parameters
    ----------
    path : Path
    length, force : float
        Units of the file in m and N; forces are in decks alone, where materials are.

    Raises
    ------
    InputError
        Where the ending is another, or the file cannot be understood.
    """
    ending = path.suffix.lower()
    if ending == ".inp":
        return read_inp(path, length=length, force=force)
    if ending == ENDING:
        return read_cdb(path, length=length, force=force)
    if ending in ENDINGS:
        return read_foreign(path, length=length)
    raise InputError(f"{path.name}: a mesh is a file .inp, {', '.join((*ENDINGS, ENDING))}")

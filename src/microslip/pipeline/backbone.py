"""Backbones of the modes that a joint file asks for, by every method."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from microslip.analyses.backbone.cycles import (
    CycleControl,
    prescribed_backbone,
    quasi_static_backbone,
)
from microslip.analyses.backbone.extended_motion import harmonic_backbone
from microslip.analyses.backbone.points import Backbone, amplitude_scale, geometric
from microslip.analyses.prepared.joint_modes import JointMode, joint_modes, pick_mode
from microslip.describe.requests import BackboneAnalysis
from microslip.errors import Caution, Failure, InputError, ModelError
from microslip.pipeline.outcome import Outcome, until_interrupted
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.progress import Progress
from microslip.typing import Array


def run_backbones(
    assembly: Assembly, done: Mapping[str, Outcome[Any]], progress: Progress
) -> Outcome[tuple[Backbone, ...]]:
    """Backbones by mode, then method, as asked for.

    Raises
    ------
    InputError
        Where the joint has no mode of some number.
    """
    settings = assembly.joint.analysis.backbone
    assert settings is not None
    found: list[Backbone] = []
    failures: list[Failure] = []
    cautions: list[Caution] = []
    modes = modes_asked_for(assembly, settings)
    with until_interrupted() as stop:
        for mode in modes:
            scale = amplitude_scale(assembly.prepared, mode)
            if not np.isfinite(scale):
                failures.append(_idle(mode))
                continue
            sizes = geometric(settings.smallest * scale, settings.largest * scale, settings.count)
            for method in settings.methods:
                backbone, missed = _follow(assembly, settings, mode, method, sizes, progress)
                found.append(backbone)
                if "largest" not in settings.model_fields_set:
                    missed, ended = split_end(backbone, sizes, missed)
                    cautions += ended
                failures += missed
    return Outcome(tuple(found), tuple(failures), stop.is_set(), cautions=tuple(cautions))


def split_end(
    backbone: Backbone, sizes: Array, missed: list[Failure]
) -> tuple[list[Failure], list[Caution]]:
    """Failures of a curve whose largest amplitude nobody asked for, and where it ends before that.

    Parameters
    ----------
    backbone : Backbone
    sizes : (n,) array
        Amplitudes, ascending.
    missed : list of Failure
        Those without an answer, in the same order.
    """
    reach = backbone.amplitude.max(initial=0.0) * (sizes[1] / sizes[0]) ** 0.5
    beyond = int((sizes > reach).sum())
    if backbone.method != "prescribed" or len(backbone.points) < 2 or not 0 < beyond <= len(missed):
        return missed, []
    last = backbone.amplitude[-1] / backbone.scale
    place = f"mode {backbone.mode.number}, {backbone.method}"
    reason = (
        f"the curve ends at {last:.3g} of the amplitude that opens the joint: beyond, "
        f"{missed[-beyond].reason}"
    )
    remedy = "try method harmonic, or give analysis.backbone.largest"
    return missed[:-beyond], [Caution("backbone", place, reason, remedy)]


def modes_asked_for(assembly: Assembly, settings: BackboneAnalysis) -> list[JointMode]:
    """The modes whose backbones are asked for.

    Raises
    ------
    InputError
        Where the joint has no mode of some number.
    """
    modes = joint_modes(assembly.model, assembly.prestress, assembly.prepared.law)
    try:
        return [pick_mode(modes, number) for number in settings.modes]
    except ModelError as error:
        raise InputError(f"analysis.backbone.modes = {list(settings.modes)}: {error}") from None


def _idle(mode: JointMode) -> Failure:
    return Failure(
        "backbone",
        f"mode {mode.number}",
        f"it does not move the interface; at every amplitude {mode.stuck_frequency:.6g} Hz with "
        "the damping of the material",
    )


def _follow(
    a: Assembly,
    settings: BackboneAnalysis,
    mode: JointMode,
    method: str,
    sizes: Array,
    progress: Progress,
) -> tuple[Backbone, list[Failure]]:
    """One backbone by one method, and what it failed at."""
    progress.start(f"backbone of mode {mode.number}, {method.replace('_', '-')}", len(sizes))
    if method == "harmonic":
        found = harmonic_backbone(
            a.prepared, mode, sizes, harmonics=settings.harmonics, advance=progress.advance
        )
    else:
        by_cycles = quasi_static_backbone if method == "quasi_static" else prescribed_backbone
        found = by_cycles(
            a.prepared,
            mode,
            sizes,
            control=CycleControl(settings.steps, settings.max_cycles),
            advance=progress.advance,
        )
    progress.finish()
    return found

"""What a run found, in short: plain JSON types, units in the names."""

from __future__ import annotations

from typing import Any

from microslip.pipeline.judge import Judgement, judge
from microslip.pipeline.run import Run
from microslip.registry import ANALYSES, resolved
from microslip.results.files import plain
from microslip.results.joint import model_summary, prestress_summary
from microslip.results.outputs import outputs_summary
from microslip.results.whole import whole_summary
from microslip.version import __version__


def summary(run: Run, judged: Judgement | None = None) -> dict[str, Any]:
    """What a run found, in plain JSON types; None where there is no number.

    Parameters
    ----------
    run : Run
    judged : Judgement, optional
        Of that run, where it is known; else it is judged here.

    Returns
    -------
    dict
        ``title``, ``version``, ``model``, ``prestress``, ``outputs``; the rows of every analysis
        under its keys, empty where it was not asked for: ``backbone``, ``cycles``, ``response``,
        ``response_band``, ``harmonic``, ``harmonic_folds``, ``time_domain``, ``history``;
        ``rho_scale`` where a load is given by rho; ``stress``, ``warnings``, ``failures``,
        ``interrupted``, ``timings_s``. Units are in the names; forces and energies are per metre of
        width, or those of the whole structure (`microslip.results.whole`). A cycle is listed only
        where the solver certified every step, so its ``unsolved_steps`` are 0; cycles that failed are
        among the ``failures``.
    """
    rows = {
        key: resolved(of)(run) if run.value(row.name) is not None else []
        for row in ANALYSES.values()
        for key, of in row.rows.items()
    }
    judged = judge(run) if judged is None else judged
    found: dict[str, Any] = plain(
        {
            "title": run.joint.title,
            "version": __version__,
            "model": model_summary(run),
            "prestress": prestress_summary(run),
            "outputs": outputs_summary(run),
            **rows,
            **({"rho_scale": run.rho_scale} if run.joint.says_rho else {}),
            "stress": _stress(judged),
            "warnings": [str(caution) for caution in judged.cautions],
            "failures": [str(failure) for failure in run.failures],
            "interrupted": run.interrupted,
            "timings_s": dict(run.timings),
        }
    )
    if run.joint.whole:
        found = whole_summary(found)
    return found


def _stress(judged: Judgement) -> dict[str, Any]:
    """What the beams bear, and what they could."""
    return {
        "largest_bending_stress_pa": judged.stress,
        "where": judged.where or None,
        "largest_deflection_m": judged.deflection,
        "bending_stress_per_modal_amplitude_pa": judged.stress_per_amplitude,
        "deflection_per_modal_amplitude_m": judged.deflection_per_amplitude,
        "elastic_limit_pa": judged.elastic_limit,
        "moment_at_elastic_limit_n": judged.elastic_moment,
    }

"""Results of a run as files in a folder: summary, dataset, figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from microslip.pipeline.judge import Judgement, judge
from microslip.pipeline.progress import NullProgress, Progress
from microslip.pipeline.run import Run
from microslip.results.dataset import dataset
from microslip.results.files import DATA, FIGURES, SUMMARY, write_dataset, write_summary
from microslip.results.store import STORE, RunStore
from microslip.results.summary import summary
from microslip.show.figures import figures_of, save_figures
from microslip.show.plots.style import USUAL_FORMATS


def write_results(
    run: Run,
    folder: str | Path,
    progress: Progress | None = None,
    formats: Sequence[str] = USUAL_FORMATS,
    *,
    found: Mapping[str, Any] | None = None,
    judged: Judgement | None = None,
    store: bool = True,
) -> list[Path]:
    """Write ``results.nc``, ``summary.json``, ``run.h5`` and ``figures/``.

    A file of the same name is replaced in one go: whoever reads sees the old or the new one.

    Parameters
    ----------
    run : Run
    folder : path
        Made where it does not exist.
    progress : Progress, optional
    formats : sequence of str
        Of the figures: any of ``png``, ``svg``, ``pdf``.
    found : mapping, optional
        `microslip.results.summary.summary` of the run, where it is known.
    judged : Judgement, optional
        Of the run, where it is known.
    store : bool
        Whether to write ``run.h5``; a run from the command line has written it on its way.

    Returns
    -------
    list of pathlib.Path
        What was written.
    """
    progress = progress or NullProgress()
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    drawn = len(figures_of(run)) if formats else 0
    progress.start("write results and figures", 2 + drawn)
    file = RunStore(place / STORE)
    if store:
        file.begin(run.joint)
        for name, outcome in run.outcomes.items():
            file.keep(name, outcome)
    file.finish(run)
    judged = judge(run) if judged is None else judged
    found = summary(run, judged) if found is None else found
    written = [write_summary(found, place / SUMMARY)]
    progress.advance()
    written.append(write_dataset(dataset(run), place / DATA))
    progress.advance()
    written.append(file.path)
    written += save_figures(run, place / FIGURES, progress, formats, judged)
    progress.finish()
    return written

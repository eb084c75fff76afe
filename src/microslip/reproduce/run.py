"""Draw figures one after another, each written as soon as it is done."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from microslip.errors import Failure, MicroslipError
from microslip.pipeline.progress import Progress
from microslip.reproduce.gallery import gallery, tables
from microslip.reproduce.plate import Plate
from microslip.reproduce.registry import FIGURES, chosen
from microslip.reproduce.settings import FULL, Settings
from microslip.reproduce.study import Study
from microslip.results.files import plain, replacing
from microslip.show.plots.style import save
from microslip.version import __version__

REPORT = "reproduction.json"
"""Name of the file with all numbers, trends and failures."""


@dataclass
class Reproduction:
    """What was reproduced.

    Attributes
    ----------
    report : dict
        As in ``reproduction.json``.
    written : list of Path
    interrupted : bool
    """

    report: dict[str, Any]
    written: list[Path] = field(default_factory=list)
    interrupted: bool = False


def reproduce(
    names: Sequence[str],
    folder: Path,
    settings: Settings = FULL,
    progress: Progress | None = None,
) -> Reproduction:
    """Reproduce figures into a folder.

    A figure that fails is recorded and the next begins; Ctrl-C keeps the figures done. After each
    one ``reproduction.json``, ``gallery.md`` and ``numbers.md`` hold what there is so far.

    Parameters
    ----------
    names : sequence of str
        Keys of `registry.FIGURES`, or ``all``.
    folder : Path
    settings : Settings
    progress : Progress, optional

    Raises
    ------
    InputError
        For an unknown name.
    """
    wanted = chosen(names)
    study = Study(settings, progress)
    result = Reproduction(_empty_report(settings))
    start = time.perf_counter()
    with threadpool_limits(1):
        try:
            for name in wanted:
                _one(name, study, folder, result)
                _write(result, study, folder, time.perf_counter() - start)
        except KeyboardInterrupt:
            result.interrupted = True
            result.report["interrupted"] = True
    _write(result, study, folder, time.perf_counter() - start)
    return result


def _empty_report(settings: Settings) -> dict[str, Any]:
    return {
        "microslip": __version__,
        "settings": asdict(settings),
        "calibration": {},
        "numbers": {},
        "trends": {},
        "figures": {},
        "failures": [],
        "interrupted": False,
        "timings": {},
    }


def _one(name: str, study: Study, folder: Path, result: Reproduction) -> None:
    """Draw one figure and enter it in the report; a failure is entered instead."""
    start = time.perf_counter()
    try:
        plate = FIGURES[name](study)
    except MicroslipError as error:
        study.failures.append(Failure(name, "", str(error)))
        return
    finally:
        study.progress.finish()
    result.written += save(plate.figure, folder / "figures", name)
    _enter(name, plate, result.report)
    result.report["timings"].setdefault("figures_s", {})[name] = time.perf_counter() - start


def _enter(name: str, plate: Plate, report: dict[str, Any]) -> None:
    for number in plate.numbers:
        report["numbers"][number.key] = {"figure": name, **number.row()}
    for trend in plate.trends:
        report["trends"][trend.key] = {"figure": name, **trend.row()}
    report["figures"][name] = {"caption": plate.caption, "data": plate.data}
    report["timings"].update(plate.seconds)


def _write(result: Reproduction, study: Study, folder: Path, seconds: float) -> None:
    report = result.report
    report["failures"] = [str(failure) for failure in study.failures]
    report["timings"]["analyses_s"] = dict(study.timings)
    report["timings"]["total_s"] = seconds
    if "rho_scale" in vars(study):
        report["calibration"] = {
            "rho_scale": study.rho_scale,
            "statement": "rho = C mu P L / M; C such that the consistent model with the "
            "mode-driven table has its greatest damping at the paper's rho = 2.4",
        }
    folder.mkdir(parents=True, exist_ok=True)
    found = plain(report)
    text = json.dumps(found, indent=1, ensure_ascii=False, allow_nan=False)
    for name, content in (
        (REPORT, text + "\n"),
        ("gallery.md", gallery(found)),
        ("numbers.md", tables(found)),
    ):
        path = folder / name
        with replacing(path) as temporary:
            temporary.write_text(content, encoding="utf-8")
        if path not in result.written:
            result.written.append(path)

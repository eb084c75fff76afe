"""Wrong joint files, and what the message to each must name.

A row is a change of a joint file that is right, and the words of the message: a change is the text of
a whole file, or a function from the right text to the wrong one.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass

RIGHT = """\
title = "Right"
[beams]
length = "251.5 mm"
thickness = "12.5 mm"
overlap_half_length = "37.5 mm"
[material]
youngs_modulus = "70 GPa"
poissons_ratio = 0.3
density = "2000 kg/m^3"
[contact]
friction = 0.25
pairs = 201
[clamp]
force = "1 MN/m"
half_length = "25 mm"
[support]
horizontal_spring = "1e5 N/m/m"
[damping]
beta = "0.73 us"
[load]
moment = "50 N*m/m"
[analysis.cycle]
[analysis.response]
"""

SINE = {"signal": '"sine"', "frequency": '"170 Hz"', "cycles": "3", "moment": '"50 N*m/m"'}
SWEEP = {
    "signal": '"swept_sine"',
    "from": '"170 Hz"',
    "to": '"180 Hz"',
    "duration": '"1 s"',
    "moment": '"50 N*m/m"',
}
STEPPED = {
    "signal": '"stepped_sine"',
    "frequencies": "[170, 175]",
    "cycles": "3",
    "moment": '"50 N*m/m"',
}
DECAY = {
    "signal": '"free_decay"',
    "start": '"mode"',
    "modal_amplitude": "1e-3",
    "duration": '"1 s"',
}
MEASURED = {"signal": '"measured"', "file": '"load.csv"'}
"""Histories that are right."""

Change = Callable[[str], str]


@dataclass(frozen=True)
class Wrong:
    """A wrong file: what is done to the right one, and what the message must name."""

    name: str
    change: Change
    says: tuple[str, ...]

    def text(self) -> str:
        return self.change(RIGHT)


def put(path: str, literal: str) -> Change:
    """Give a key a value, in a section that may not be there yet."""
    section, _, key = path.rpartition(".")

    def change(text: str) -> str:
        line = f"{key} = {literal}"
        if not section:
            return f"{line}\n" + re.sub(rf"(?m)^{key} = .*\n", "", text)
        head, mark, rest = text.partition(f"[{section}]\n")
        if not mark:
            return f"{text}[{section}]\n{line}\n"
        body, bracket, tail = rest.partition("\n[")
        kept = re.sub(rf"(?m)^{key} = .*\n?", "", body + "\n").rstrip("\n")
        return f"{head}{mark}{line}\n{kept}{bracket}{tail}"

    return change


def puts(**pairs: str) -> Change:
    """Several keys, dots written as two underscores."""

    def change(text: str) -> str:
        for path, literal in pairs.items():
            text = put(path.replace("__", "."), literal)(text)
        return text

    return change


def without(path: str) -> Change:
    """Leave out a key of a section, or ``[section]``."""

    def change(text: str) -> str:
        if path.startswith("["):
            head, _, rest = text.partition(f"{path}\n")
            following = re.search(r"(?m)^\[", rest)
            return head + (rest[following.start() :] if following else "")
        section, _, key = path.rpartition(".")
        head, mark, rest = text.partition(f"[{section}]\n")
        return head + mark + re.sub(rf"(?m)^{key} = .*\n", "", rest, count=1)

    return change


def swap(old: str, new: str) -> Change:
    """Replace a piece of text that is there once."""

    def change(text: str) -> str:
        assert text.count(old) == 1, old
        return text.replace(old, new)

    return change


def more(added: str) -> Change:
    """Add lines at the end."""
    return lambda text: text + added


def whole(text: str) -> Change:
    """The file is this text."""
    return lambda right: text


def history(entry: dict[str, str], **changed: str | None) -> Change:
    """A history with other keys; None takes one away. ``from_`` is from."""
    pairs = {**entry, **{k.rstrip("_"): v for k, v in changed.items()}}
    lines = "".join(f"{k} = {v}\n" for k, v in pairs.items() if v is not None)
    return more(f"[[analysis.history]]\n{lines}")


def keyed(path: str, literal: str, *says: str) -> Wrong:
    """A wrong value of a key: the message names the key, the value and `says`."""
    value = json.dumps(tomllib.loads(f"x = {literal}")["x"], ensure_ascii=False, default=str)
    return Wrong(f"{path} = {literal[:40]}", put(path, literal), (f"{path} = {value}", *says))


LENGTH, STRESS = 'a length, for example "12.5 mm"', 'a modulus of elasticity, for example "70 GPa"'
FINITE = "must be a finite number"
FORCE = 'a force per metre of width, for example "1 MN/m"'
MOMENT = 'a moment per metre of width, for example "150 N*m/m"'
TIME = 'a time, for example "0.73 us"'
FREQUENCY = 'a frequency in cycles per second, for example "165 Hz"'
PLAIN = "a plain number, for example 0.25"
QUOTES = "quotation marks"
WHOLE = "must be a whole number"
SECTION = "must be a section"
ELSE = "measures something else"

LENGTHS = ("beams.length", "beams.thickness", "beams.overlap_half_length", "clamp.half_length")

WRONG: list[Wrong] = [
    # a quantity of the wrong kind
    *(keyed(key, '"12 kg"', ELSE, LENGTH) for key in LENGTHS),
    *(keyed(key, "true", LENGTH) for key in LENGTHS),
    *(keyed(key, "0", "greater than 0") for key in LENGTHS),
    *(keyed(key, '"-3 mm"', "greater than 0") for key in LENGTHS),
    *(keyed(key, '"12.5 parsnip"', "'parsnip' is not a known unit", LENGTH) for key in LENGTHS),
    keyed("beams.length", '"251,5 mm"', "decimal point, not a comma"),
    keyed("beams.length", '"mm"', "not a number with a unit", LENGTH),
    keyed("beams.length", '""', "not a number with a unit", LENGTH),
    keyed("beams.length", "[0.25]", LENGTH),
    keyed("beams.length", '"1e999 m"', FINITE),
    keyed("beams.thickness", "nan", FINITE),
    keyed("beams.thickness", "inf", FINITE),
    keyed("beams.thickness", '"-inf m"', FINITE),
    keyed("beams.thickness", "1979-05-27", LENGTH),
    keyed("beams.thickness", '"12.5 mm^2"', ELSE, LENGTH),
    keyed("material.youngs_modulus", '"70 GHz"', ELSE, STRESS),
    keyed("material.youngs_modulus", '"70 gpa"', "not a known unit", STRESS),
    keyed("material.youngs_modulus", '"-70 GPa"', "greater than 0"),
    keyed("material.youngs_modulus", "false", STRESS),
    keyed("material.youngs_modulus", '"steel"', "not a number with a unit", STRESS),
    keyed("material.poissons_ratio", "0.5", "less than 0.5"),
    keyed("material.poissons_ratio", "-1", "greater than -1"),
    keyed("material.poissons_ratio", '"0.3 mm"', ELSE, PLAIN),
    keyed("material.poissons_ratio", "nan", FINITE),
    keyed("material.density", '"2000 kg"', ELSE, "a density"),
    keyed("material.density", '"2 g/cm"', ELSE, "a density"),
    keyed("material.density", "0", "greater than 0"),
    keyed("material.density", "inf", FINITE),
    keyed("material.plane", '"flat"', "'strain' or 'stress'"),
    keyed("material.plane", '"Strain"', "'strain' or 'stress'"),
    keyed("material.plane", "1", "'strain' or 'stress'"),
    keyed("material.yield_stress", '"250 mm"', ELSE, "a stress"),
    keyed("material.yield_stress", "0", "greater than 0"),
    keyed("contact.friction", '"0.25 rad"', "a unit of angle", PLAIN),
    keyed("contact.friction", '"0,25"', "decimal point, not a comma"),
    keyed("contact.friction", "-0.1", "greater than or equal to 0"),
    keyed("contact.friction", "2.1", "less than or equal to 2"),
    keyed("contact.friction", "nan", FINITE),
    keyed("contact.friction", '"a lot"', "not a number", PLAIN),
    keyed("contact.pairs", "201.5", WHOLE),
    keyed("contact.pairs", '"201"', WHOLE),
    keyed("contact.pairs", "true", WHOLE),
    keyed("contact.pairs", "3", "greater than or equal to 5"),
    keyed("contact.pairs", "5003", "less than or equal to 5001"),
    keyed("contact.pairs", "-201", "greater than or equal to 5"),
    keyed("contact.pairs", "[201]", WHOLE),
    keyed("contact.law", '"rigid"', "'exact' or 'elastic'"),
    keyed("contact.tangential_stiffness", '"1e13 Pa/m"', 'only for law = "elastic"'),
    keyed("contact.normal_stiffness", '"1e13 Pa/m"', 'only for law = "elastic"'),
    Wrong(
        "elastic without its stiffness",
        put("contact.law", '"elastic"'),
        ("contact.tangential_stiffness", 'law = "elastic" needs it', "Pa/m"),
    ),
    Wrong(
        "a stiffness per length for one per area",
        puts(contact__law='"elastic"', contact__tangential_stiffness='"1e13 N/m"'),
        ("contact.tangential_stiffness", ELSE, "a stiffness per area"),
    ),
    keyed("clamp.force", '"1 MN"', ELSE, FORCE),
    keyed("clamp.force", '"100 kN/m^2"', ELSE, FORCE),
    keyed("clamp.force", "0", "greater than 0"),
    keyed("clamp.force", "-1e6", "greater than 0"),
    keyed("clamp.force", "inf", FINITE),
    keyed("clamp.force", '"1 MN/m per bolt"', "not a known unit", FORCE),
    keyed("clamp.half_length", '"38 mm"', "must lie on the overlap", "0.0375 m"),
    keyed("support.horizontal_spring", '"1e5 Pa"', "not per metre of width", "N/m/m"),
    keyed("support.horizontal_spring", '"1e5 N/m"', ELSE, "N/m/m"),
    keyed("support.horizontal_spring", "-1", "greater than or equal to 0"),
    keyed("support.horizontal_spring", "inf", FINITE),
    keyed("support.horizontal_spring", '"rigid"', "not a number with a unit"),
    keyed("damping.beta", '"0.73 Hz"', ELSE, TIME),
    keyed("damping.beta", '"0.73 um"', ELSE, TIME),
    keyed("damping.beta", "-1e-6", "greater than or equal to 0"),
    keyed("damping.beta", "nan", FINITE),
    keyed("damping.alpha", '"1 s"', ELSE, "a rate"),
    keyed("damping.alpha", "-1", "greater than or equal to 0"),
    keyed("mesh.overlap_growth", "0.9", "greater than or equal to 1"),
    keyed("mesh.overlap_growth", "3.1", "less than or equal to 3"),
    keyed("mesh.max_layer", "0", "greater than 0.005"),
    keyed("mesh.max_layer", '"1 mm"', ELSE, PLAIN),
    keyed("mesh.rest_size", "11", "less than or equal to 10"),
    keyed("mesh.modes", "3", "greater than or equal to 4"),
    keyed("mesh.modes", "60.0", WHOLE),
    keyed("title", "3", 'must be text in quotation marks, "..."'),
    keyed("title", "[]", 'must be text in quotation marks, "..."'),
    Wrong(
        "a very long title",
        put("title", '"' + "x" * 201 + '"'),
        ("title", "at most 200 characters"),
    ),
    # loads
    keyed("load.moment", '"50 N"', "'N' is not per metre of width", MOMENT),
    keyed("load.moment", '"50 N*m"', ELSE, MOMENT),
    keyed("load.moment", '"50 kN/m"', ELSE, MOMENT),
    keyed("load.moment", "0", "greater than 0"),
    keyed("load.moment", "-50", "greater than 0"),
    keyed("load.moment", "[]", "one value or a list of 1 to 1000"),
    Wrong(
        "one of several moments", put("load.moment", "[50, nan]"), ("load.moment[1] = NaN", FINITE)
    ),
    Wrong(
        "one of several moments of no unit",
        put("load.moment", '["50 N*m/m", "60 N"]'),
        ('load.moment[1] = "60 N"', "not per metre of width"),
    ),
    keyed("load.moment", '"40 kN*m/m"', "opens the joint", "3.75e+04 N*m/m"),
    Wrong("no load", without("[load]"), ("load", "missing", "analysis.response", "[load]")),
    Wrong("an empty load", without("load.moment"), ("[load]", "exactly one of moment", "none")),
    Wrong(
        "two loads",
        put("load.rho", "2.4"),
        ("[load]", "exactly one of", "found moment and rho"),
    ),
    Wrong(
        "the rho of greatest damping",
        put("load.greatest_damping_at", "2.4"),
        ("load.greatest_damping_at is not a known key", "rho_scale"),
    ),
    keyed("load.rho_scale", "1", "only belongs to load.rho"),
    Wrong(
        "a ratio that opens the joint",
        swap('moment = "50 N*m/m"', "moment_over_clamp_force_length = 0.2"),
        ("load.moment_over_clamp_force_length", "opens the joint", "0.1491"),
    ),
    Wrong(
        "a ratio with a unit",
        swap('moment = "50 N*m/m"', 'moment_over_clamp_force_length = "0.2 m"'),
        ("load.moment_over_clamp_force_length", ELSE, PLAIN),
    ),
    Wrong("negative rho", swap('moment = "50 N*m/m"', "rho = -1"), ("load.rho", "or equal to 0")),
    Wrong(
        "rho that opens the joint",
        swap('moment = "50 N*m/m"', "rho = 0.1\nrho_scale = 1"),
        ("load.rho", "opens the joint"),
    ),
    Wrong(
        "rho without friction",
        lambda t: put("contact.friction", "0")(t).replace('moment = "50 N*m/m"', "rho = 2"),
        ("load.rho", "without contact.friction"),
    ),
    # cycles, response, reduced
    keyed("analysis.cycle.drives", "[]", "one value or a list of 1 to 1000"),
    keyed("analysis.cycle.drives", '["moment", "moment"]', "names one thing twice"),
    Wrong(
        "an unknown drive",
        put("analysis.cycle.drives", '["force"]'),
        ("analysis.cycle.drives[0]", "'moment' or 'mode'"),
    ),
    keyed("analysis.cycle.smallest", "0", "greater than 0"),
    keyed("analysis.cycle.smallest", "0.5", "must be below the largest amplitude"),
    keyed("analysis.cycle.largest", "1e-6", "must be above smallest"),
    keyed("analysis.cycle.largest", "0.5", "opens the joint"),
    keyed("analysis.cycle.count", "1", "greater than or equal to 2"),
    keyed("analysis.cycle.count", "25.0", WHOLE),
    keyed("analysis.cycle.steps", "10", "greater than or equal to 20"),
    keyed("analysis.cycle.max_cycles", "1", "greater than or equal to 2"),
    keyed("analysis.cycle.closure", "0.5", "less than 0.1"),
    keyed("analysis.cycle.closure", "0", "greater than 0"),
    Wrong(
        "amplitudes in two ways",
        puts(analysis__cycle__moment_over_clamp_force_length="[1e-3]", analysis__cycle__count="5"),
        ("analysis.cycle.moment_over_clamp_force_length", "remove count"),
    ),
    keyed("analysis.response.from", '"190 s"', ELSE, FREQUENCY),
    keyed("analysis.response.from", '"1000 rpm"', "a unit of angular frequency", FREQUENCY),
    keyed("analysis.response.from", "0", "greater than 0"),
    keyed("analysis.response.to", "inf", FINITE),
    Wrong(
        "a band that runs down",
        puts(analysis__response__from='"190 Hz"', analysis__response__to='"165 Hz"'),
        ('analysis.response.to = "165 Hz"', "must be above analysis.response.from, 190 Hz"),
    ),
    keyed("analysis.response.count", "1", "greater than or equal to 2"),
    Wrong(
        "an unknown variant",
        put("analysis.response.variants", '["exact"]'),
        ('analysis.response.variants[0] = "exact"', "'printed', 'consistent' or 'refined'"),
    ),
    keyed("analysis.response.variants", "[]", "one value or a list of 1 to 1000"),
    keyed("analysis.response.variants", '["refined", "refined"]', "names one thing twice"),
    keyed("analysis.response.tolerance", "1", "less than 0.1"),
    keyed("analysis.response.max_iterations", "0", "greater than or equal to 1"),
    keyed("analysis.reduced.amplitudes", "2", "greater than or equal to 4"),
    keyed("analysis.reduced.steps", "59", "greater than or equal to 60"),
    keyed("analysis.reduced.upper_modes", "-1", "greater than or equal to 0"),
    Wrong(
        "variants in two places",
        puts(analysis__response__variants='["refined"]', analysis__reduced__variant='"refined"'),
        ("analysis.reduced.variant", "remove one of the two"),
    ),
    Wrong(
        "variants of no response",
        lambda t: put("analysis.reduced.variant", '"refined"')(without("[analysis.response]")(t)),
        ("analysis.reduced.variant", "add a section [analysis.response]"),
    ),
    # backbones
    Wrong(
        "mode 0",
        put("analysis.backbone.modes", "0"),
        ("analysis.backbone.modes = 0", "or equal to 1"),
    ),
    keyed("analysis.backbone.modes", "[]", "one value or a list of 1 to 1000"),
    keyed("analysis.backbone.modes", "[1, 1]", "names one thing twice"),
    Wrong(
        "an unknown method",
        put("analysis.backbone.methods", '"modal"'),
        ("analysis.backbone.methods", "'quasi_static', 'prescribed' or 'harmonic'"),
    ),
    keyed("analysis.backbone.steps", "30", "a multiple of 4"),
    keyed("analysis.backbone.largest", "1", "less than 1"),
    keyed("analysis.backbone.largest", "1e-6", "must be above analysis.backbone.smallest"),
    keyed("analysis.backbone.harmonics", "51", "less than or equal to 50"),
    keyed("analysis.backbone.count", "1", "greater than or equal to 2"),
    # harmonic balance
    Wrong(
        "harmonic balance nowhere",
        more("[analysis.harmonic]\n"),
        ("analysis.harmonic.frequencies", "give a list of frequencies, or from, to and count"),
    ),
    keyed("analysis.harmonic.frequencies", '"170 Hz"', "give two or more"),
    keyed("analysis.harmonic.frequencies", "[]", "one value or a list of 1 to 1000"),
    Wrong(
        "a negative frequency",
        put("analysis.harmonic.frequencies", "[170, -1]"),
        ("analysis.harmonic.frequencies[1] = -1", "greater than 0"),
    ),
    Wrong(
        "frequencies in two ways",
        puts(analysis__harmonic__frequencies="[170, 180]", analysis__harmonic__count="3"),
        ("analysis.harmonic.frequencies", "remove from, to and count"),
    ),
    Wrong(
        "a third of a band",
        put("analysis.harmonic.from", "170"),
        ("analysis.harmonic.frequencies", "or from, to and count"),
    ),
    *(
        Wrong(
            f"harmonic {name} = {literal}",
            puts(
                **{
                    "analysis__harmonic__frequencies": "[170, 180]",
                    f"analysis__harmonic__{name}": literal,
                }
            ),
            (f"analysis.harmonic.{name} = {literal}", *says),
        )
        for name, literal, *says in [
            ("harmonics", "0", "from 1 to 101", "adaptive"),
            ("harmonics", '"many"', "from 1 to 101", "adaptive"),
            ("harmonics", "true", "from 1 to 101", "adaptive"),
            ("tolerance", "0.1", 'only for harmonics = "adaptive"'),
            ("most", "9", 'only for harmonics = "adaptive"'),
            ("samples", "16", "do not resolve 5 harmonics"),
            ("samples", "8", "greater than or equal to 16"),
            ("stability", "1", "true or false"),
            ("stability", '"yes"', "true or false"),
        ]
    ),
    Wrong(
        "harmonic balance without a load",
        lambda t: put("analysis.harmonic.frequencies", "[170, 180]")(
            without("[load]")(without("[analysis.response]")(t))
        ),
        ("load", "missing", "analysis.harmonic needs it"),
    ),
    # time
    Wrong("time nowhere", more("[analysis.time]\n"), ("analysis.time.frequencies", "give a list")),
    Wrong(
        "time from a response that is none",
        lambda t: more('[analysis.time]\nfrequencies = 170\nstarts = "reduced"\n')(
            without("[analysis.response]")(t)
        ),
        ("analysis.time.starts", "add a section [analysis.response]"),
    ),
    *(
        Wrong(
            f"time {name} = {literal}",
            puts(**{"analysis__time__frequencies": "170", f"analysis__time__{name}": literal}),
            (f"analysis.time.{name} = {literal}", *says),
        )
        for name, literal, *says in [
            ("steps", "10", "greater than or equal to 20"),
            ("steps", "150.5", WHOLE),
            ("positions", '"50 mm"', "lies off the overlap"),
            ("positions", "[]", "one value or a list"),
            ("positions", '"1 Hz"', ELSE, LENGTH),
            ("max_cycles", "1", "greater than or equal to 2"),
            ("tolerance", "0.2", "less than 0.1"),
            ("search", '"quick"', "'accelerated' or 'marched'"),
        ]
    ),
    # histories
    Wrong(
        "a history without a signal", history({}), ("analysis.history[0].signal is missing", "sine")
    ),
    Wrong(
        "an unknown signal",
        history(SINE, signal='"noise"'),
        ('analysis.history[0].signal = "noise"', "must be one of sine, stepped_sine"),
    ),
    Wrong("a history that is a number", put("analysis.history", "3"), ("[[analysis.history]]",)),
    Wrong(
        "two histories of one name",
        lambda t: history(SINE)(history(SINE)(t)),
        ("analysis.history[1].name", "two histories are called 'sine'"),
    ),
    *(
        Wrong(
            f"{entry['signal']} {name} = {value}",
            history(entry, **{name: value}),
            (f"analysis.history[0].{name.rstrip('_')}", *says),
        )
        for entry, name, value, *says in [
            (SINE, "frequency", None, "is missing", FREQUENCY),
            (SINE, "frequency", '"170 mm"', ELSE, FREQUENCY),
            (SINE, "frequency", "0", "greater than 0"),
            (SINE, "cycles", "0", "greater than 0"),
            (SINE, "cycles", "1e7", "less than or equal to 1000000"),
            (SINE, "cycles", None, "is missing", PLAIN),
            (SINE, "moment", '"50 N"', "not per metre of width"),
            (SINE, "moment", '"50 kN*m/m"', "opens the joint"),
            (SINE, "steps", "10", "greater than or equal to 20"),
            (SINE, "time_step", '"1 ms"', "steps per cycle", "at least 20"),
            (SINE, "time_step", '"0 s"', "greater than 0"),
            (SINE, "name", '"my sine"', "a letter followed by letters, digits, - and _"),
            (SINE, "name", '""', "a letter followed by"),
            (SINE, "drive", '"force"', "'moment' or 'mode'"),
            (SINE, "positions", '"1 m"', "lies off the overlap"),
            (SINE, "field_samples", "-1", "greater than or equal to 0"),
            (SINE, "field_to", '"0 s"', "greater than 0"),
            (SINE, "duration", '"1 s"', "is not a known key"),
            (SINE, "frequnecy", "1", "is not a known key", "'frequency'"),
            (STEPPED, "cycles", None, "is missing"),
            (STEPPED, "frequencies", None, "or from, to and count"),
            (STEPPED, "frequencies", '["170 Hz", "x"]', "not a number with a unit"),
            (SWEEP, "from_", None, "is missing", FREQUENCY),
            (SWEEP, "to", '"180 m"', ELSE, FREQUENCY),
            (SWEEP, "duration", '"2 m"', ELSE, TIME),
            (SWEEP, "duration", "-1", "greater than 0"),
            (SWEEP, "sweep", '"square"', "'linear' or 'log'"),
            (DECAY, "start", '"rest"', "'mode', 'static' or 'steady'"),
            (DECAY, "modal_amplitude", None, 'start = "mode" needs it'),
            (DECAY, "frequency", '"170 Hz"', 'has no meaning for start = "mode"'),
            (DECAY, "moment", '"50 N*m/m"', 'has no meaning for start = "mode"'),
            (DECAY, "duration", None, "is missing", TIME),
            (MEASURED, "file", '"none.csv"', "no such file"),
            (MEASURED, "file", "3", "name of a file"),
            (MEASURED, "file", '""', "name of a file"),
            (MEASURED, "file", '"."', "is a folder"),
            (MEASURED, "file", None, "is missing"),
            (MEASURED, "dataset", "1", "universal files", "columns"),
            (MEASURED, "column", '""', "at least 1 character"),
            (MEASURED, "scale", '"2 mm"', ELSE, PLAIN),
            (MEASURED, "moment", '"50 N*m/m"', "is not a known key"),
        ]
    ),
    Wrong(
        "a history with two loads",
        history(SINE, rho="2"),
        ("analysis.history[0]", "exactly one of", "moment and rho"),
    ),
    Wrong(
        "a history without load",
        history(SINE, moment=None),
        ("analysis.history[0]", "exactly one of"),
    ),
    Wrong(
        "the step in two ways",
        history(SINE, steps="100", time_step='"30 us"'),
        ("analysis.history[0].time_step", "remove steps"),
    ),
    Wrong(
        "samples that end before they begin",
        history(SINE, field_from='"2 s"', field_to='"1 s"'),
        ("analysis.history[0].field_to", "must be after field_from"),
    ),
    Wrong(
        "rho of a history that opens the joint",
        history(SINE, moment=None, rho="0.001"),
        ("analysis.history[0].rho", "opens the joint"),
    ),
    Wrong(
        "a decay from a steady state by steps of time",
        history(
            DECAY,
            start='"steady"',
            modal_amplitude=None,
            frequency="170",
            moment="50",
            time_step='"30 us"',
        ),
        ("analysis.history[0].time_step", "give steps"),
    ),
    Wrong(
        "a column of a universal file",
        history(MEASURED, file='"load.uff"', column='"moment"'),
        ("analysis.history[0].column", "is for CSV files"),
    ),
    # keys and sections
    *(
        Wrong(
            f"{path} misspelt",
            put(path, "1"),
            (f"{path} is not a known key", *says),
        )
        for path, *says in [
            ("contact.fricton", "'friction'"),
            ("beams.lenght", "'length'"),
            ("beams.width", "length, thickness, overlap_half_length"),
            ("clamp.friction", "belongs in [contact]"),
            ("material.E", "youngs_modulus"),
            ("damping.betta", "'beta'"),
            ("mesh.pairs", "belongs in [contact]"),
            ("load.moments", "'moment'"),
            ("load.M", "moment"),
            ("support.spring", "horizontal_spring"),
            ("analysis.response.form", "'from'"),
            ("analysis.cycle.step", "'steps'"),
            ("analysis.backbone.mode", "'modes'"),
            ("analysis.reduced.variants", "'variant'"),
            ("titel", "'title'"),
            ("bems", "'beams'"),
        ]
    ),
    Wrong(
        "a misspelt section",
        swap("[clamp]", "[clam]"),
        ("clam is not", "'clamp'", "[clamp] is missing"),
    ),
    Wrong(
        "an unknown analysis",
        more("[analysis.modal]\n"),
        ("analysis.modal is not a known key", "in [analysis]"),
    ),
    Wrong(
        "a misspelt analysis",
        more("[analysis.harmonics]\n"),
        ("analysis.harmonics is not a known key", "'harmonic'"),
    ),
    *(
        Wrong(
            f"no [{name}]", without(f"[{name}]"), (f"[{name}] is missing: a section with {keys}",)
        )
        for name, keys in [
            ("beams", "length, thickness, overlap_half_length"),
            ("material", "youngs_modulus, poissons_ratio, density"),
            ("contact", "friction"),
            ("clamp", "force, half_length"),
        ]
    ),
    *(
        Wrong(f"no {path}", without(path), (f"{path} is missing: expected {advice}",))
        for path, advice in [
            *((key, LENGTH) for key in LENGTHS),
            ("material.youngs_modulus", STRESS),
            ("material.poissons_ratio", PLAIN),
            ("material.density", "a density"),
            ("contact.friction", PLAIN),
            ("clamp.force", FORCE),
        ]
    ),
    Wrong(
        "a section that is a number",
        lambda t: put("clamp", "3")(without("[clamp]")(t)),
        ("clamp = 3", SECTION),
    ),
    Wrong("a section that is a list", swap("[support]", "[[support]]"), ("support", SECTION)),
    Wrong(
        "analyses as text",
        lambda t: 'analysis = "cycle"\n' + t.partition("[analysis")[0],
        ("analysis =", SECTION),
    ),
    Wrong(
        "an analysis as true",
        lambda t: t.partition("[analysis")[0] + "[analysis]\ncycle = true\n",
        ("analysis.cycle = true", SECTION),
    ),
    Wrong("an empty file", whole(""), ("[beams] is missing", "[clamp] is missing")),
    Wrong("notes alone", whole("# nothing\n"), ("[beams] is missing",)),
    # numbers that do not fit together
    keyed("beams.overlap_half_length", '"130 mm"', "at most half of beams.length"),
    Wrong(
        "a beam like a hair",
        puts(beams__thickness='"1 um"'),
        ("beams.thickness", "elements long", "beams.length"),
    ),
    Wrong(
        "a beam of no thickness at all",
        puts(beams__thickness="5e-324"),
        ("too large or too small to compute with",),
    ),
    # what cannot be
    keyed("damping.beta", '"1 s"', "damping ratio of the first bending mode is", "0.73 us"),
    keyed("damping.alpha", '"1e6 1/s"', "damping ratio of the first bending mode is"),
    Wrong(
        "a modulus of 70 Pa",
        put("material.youngs_modulus", '"70 Pa"'),
        ("clamp.force", "material.youngs_modulus = 70 Pa", "100 MPa"),
    ),
    Wrong(
        "a modulus of 70",
        put("material.youngs_modulus", "70"),
        ("material.youngs_modulus = 70 Pa", "a number without one is SI"),
    ),
    Wrong(
        "a clamp of a micrometre",
        put("clamp.half_length", '"1 um"'),
        ("clamp.force", "clamp.half_length = 1 µm", "pairs across the clamp is"),
    ),
    keyed("support.horizontal_spring", '"1e15 N/m/m"', "material.youngs_modulus"),
    keyed("clamp.force", '"1 TN/m"', "over material.youngs_modulus is"),
    keyed("material.yield_stress", '"250 GPa"', "over material.youngs_modulus is"),
    # text that is no TOML
    *(
        Wrong(f"TOML: {text.strip()[:30]!r}", change, ("not valid TOML", *says))
        for text, change, *says in [
            (t, swap('length = "251.5 mm"', t), "line 3", *s)
            for t, *s in [
                ("length = 251.5 mm", "more than one thing on the line", QUOTES),
                ("length = = 3", "value is missing", "length = = 3"),
                ("length =", "value is missing"),
                ("length", "must be followed by ="),
                ("length: 3", "must be followed by ="),
                ('length = "251.5 mm', "a quotation mark is missing"),
                ("length = 0,2515", "decimal point"),
                ("length = .25", "value is missing, or is none"),
                ("length = 251.5mm", QUOTES),
                ('length = "C:\\data"', "must be written twice"),
                ("= 3", "a key, = and its value"),
                ("length = ‘25 mm’", QUOTES),
                ("length = True", QUOTES),
                ("length = 1\x00", "more than one thing"),
                ("[bems", "stands in brackets"),
            ]
        ]
    ),
    Wrong(
        "a key twice", swap('length = "251.5 mm"', "length = 1\nlength = 1"), ("line 4", "twice")
    ),
    Wrong("a section twice", more("[beams]\n"), ("[beams]", "there twice")),
    Wrong("a list that is not closed", more("[mesh]\nmodes = [1, 2\n"), ("] is missing",)),
    Wrong("a section in braces", more("[mesh]\nx = {a = 1\n"), ("} is missing",)),
    Wrong("a number of 5000 digits", put("contact.pairs", "1" * 5000), ("too many digits",)),
    Wrong("brackets without end", put("contact.pairs", "[" * 5000), ("too many brackets",)),
]


def ported(port: str, load: str, support: str = 'left = "clamped"\nright = "free"\n') -> Change:
    """A named port that drives the joint, at ends that are held in another way."""

    def change(text: str) -> str:
        text = text.replace('moment = "50 N*m/m"\n', load).replace(
            "[support]\n", f"[support]\n{support}"
        )
        return f"{text}[[port]]\n{port}"

    return change


TIP = 'name = "tip"\nkind = "force"\nat = "right"\n'
ON_TIP = 'port = "tip"\nforce = 10\n'
BASE = 'name = "tip"\nkind = "base"\n'
FREE, PINNED = 'left = "free"\nright = "free"\n', ""

WRONG += [
    Wrong(
        "a port that there is not",
        ported(TIP, 'port = "top"\nforce = 10\n'),
        ('load.port = "top"', "no [[port]]", "tip"),
    ),
    Wrong("a port where there are none", put("load.port", '"tip"'), ("load.port", "none")),
    Wrong(
        "a moment on a force",
        ported(TIP, 'port = "tip"\nmoment = 10\n'),
        ("load.moment = 10", "'tip' is a force: give force"),
    ),
    Wrong(
        "a force on a base",
        ported(BASE, ON_TIP),
        ("load.force = 10", "motion of a base: give acceleration"),
    ),
    Wrong(
        "rho on a moment at one end",
        ported('name = "tip"\nkind = "moment"\nat = "right"\n', 'port = "tip"\nrho = 2.4\n'),
        ("load.rho = 2.4", "give moment"),
    ),
    Wrong("a force without a port", swap("moment = ", "force = 10 #"), ("load.force", "load.port")),
    Wrong(
        "two amplitudes of a port", ported(TIP, ON_TIP + "moment = 10\n"), ("[load]", "exactly one")
    ),
    Wrong(
        "a force in newtons", ported(TIP, 'port = "tip"\nforce = "10 N"\n'), ("load.force", FORCE)
    ),
    Wrong(
        "an acceleration in metres",
        ported(BASE, 'port = "tip"\nacceleration = "1 m"\n'),
        ("load.acceleration", "an acceleration, for example"),
    ),
    Wrong(
        "a force nowhere",
        ported('name = "tip"\n', ON_TIP),
        ("port[0].at", '"left", "right" or "both"'),
    ),
    Wrong("a base at an end", ported(BASE + 'at = "left"\n', ON_TIP), ("port[0].at", "remove it")),
    Wrong(
        "a moment along x",
        ported('name = "tip"\nkind = "moment"\ndirection = "x"\n', ON_TIP),
        ("port[0].direction", "remove it"),
    ),
    Wrong(
        "a port called moment",
        ported(TIP.replace("tip", "moment"), ON_TIP),
        ("port[0].name", "another"),
    ),
    Wrong("a port called 1", ported(TIP.replace("tip", "1"), ON_TIP), ("port[0].name", "a letter")),
    Wrong(
        "two ports of a name",
        ported(f"{TIP}[[port]]\n{TIP}", ON_TIP),
        ("port[1].name", "two ports"),
    ),
    Wrong(
        "a port of another kind",
        ported(TIP.replace("force", "torque"), ON_TIP),
        ("port[0].kind", "moment"),
    ),
    Wrong(
        "a force on a clamped end",
        ported(TIP.replace("right", "left"), ON_TIP),
        ("[[port]]", "left end is clamped", "support.left"),
    ),
    Wrong(
        "a shear force on a pinned end",
        ported(TIP, ON_TIP, PINNED),
        ("[[port]]", "right end is pinned", "support.right"),
    ),
    Wrong(
        "a force on a free joint",
        ported(TIP, ON_TIP, FREE),
        ("[[port]]", "nothing holds the joint", "clamp an end"),
    ),
    Wrong(
        "a base that holds nothing",
        ported(BASE, 'port = "tip"\nacceleration = 1\n', FREE),
        ("[[port]]", "both ends are free"),
    ),
    Wrong(
        "a moment at one end of a free joint",
        ported('name = "tip"\nkind = "moment"\nat = "left"\n', 'port = "tip"\nmoment = 1\n', FREE),
        ("[[port]]", "nothing holds the joint against a moment at left"),
    ),
    Wrong(
        "cycles driven by moments under a force",
        lambda text: put("analysis.cycle.drives", '["moment"]')(ported(TIP, ON_TIP)(text)),
        ("analysis.cycle.drives", 'write "load"'),
    ),
    Wrong(
        "cycles over P L under a force",
        lambda text: put("analysis.cycle.moment_over_clamp_force_length", "[1e-3]")(
            ported(TIP, ON_TIP)(text)
        ),
        ("analysis.cycle.moment_over_clamp_force_length", "give force"),
    ),
    Wrong(
        "cycles listed twice",
        lambda text: put("analysis.cycle.moment", "[1.0]")(
            put("analysis.cycle.moment_over_clamp_force_length", "[1e-3]")(text)
        ),
        ("analysis.cycle.moment", "already"),
    ),
    Wrong(
        "a history of moments under a force",
        lambda text: ported(TIP, ON_TIP)(text) + history(SINE)(""),
        ("analysis.history[0].moment", "give force"),
    ),
]


@dataclass(frozen=True)
class WrongSignal:
    """A wrong file of a measured load, and what the message must name."""

    name: str
    file: str
    content: bytes
    says: tuple[str, ...]
    keys: str = ""


def csv(name: str, text: str | bytes, *says: str, keys: str = "") -> WrongSignal:
    """A wrong CSV file."""
    content = text if isinstance(text, bytes) else text.encode()
    return WrongSignal(name, "load.csv", content, says, keys)


def uff(name: str, text: str | bytes, *says: str, keys: str = "") -> WrongSignal:
    """A wrong universal file."""
    content = text if isinstance(text, bytes) else text.encode()
    return WrongSignal(name, "load.uff", content, says, keys)


HEAD = "time [s], moment [N*m/m]\n"
ROWS = "0, 0\n0.001, 1\n0.002, 0\n"

WRONG_SIGNALS: list[WrongSignal] = [
    csv("empty", "", "is empty"),
    csv("blank lines", "\n\n", "is empty"),
    csv("header alone", HEAD, "has 0 rows of data, at least 2"),
    csv("one row", HEAD + "0, 0\n", "has 1 rows of data, at least 2"),
    csv("no units", "time, moment\n" + ROWS, "line 1", "does not say its unit", "time [s]"),
    csv("no header", ROWS, "line 1", "does not say its unit"),
    csv("force for moment", "time [s], moment [N]\n" + ROWS, "moment", "not per metre of width"),
    csv("moment without width", "time [s], M [N*m]\n" + ROWS, "line 1, M", ELSE, MOMENT),
    csv("time in metres", "time [m], moment [N*m/m]\n" + ROWS, "line 1, time", ELSE, TIME),
    csv("unknown unit", "time [s], moment [kgf*furlong*x]\n" + ROWS, "not a known unit"),
    csv("one column", "time [s]\n0\n1\n", "line 1", "two or more"),
    csv("semicolons", (HEAD + ROWS).replace(",", ";"), "line 1", "two or more"),
    csv("three columns", "time [s], a [N*m/m], b [N*m/m]\n0, 0, 0\n", "choose the column", "a, b"),
    csv("no such column", HEAD + ROWS, "no column 'force'", "moment", keys='column = "force"\n'),
    csv("a short row", HEAD + "0, 0\n0.001\n", "line 3", "1 columns instead of two"),
    csv("words", HEAD + "0, 0\n0.001, much\n", "line 3", "time 0.001", "is not a number"),
    csv(
        "a comma as decimal point", HEAD + "0, 0\n0,001, 1\n", "line 3", "3 columns instead of two"
    ),
    csv("not finite", HEAD + "0, 0\n0.001, nan\n0.002, 1\n", "line 3", "is not finite"),
    csv("time stands still", HEAD + "0, 0\n0, 1\n0.1, 0\n", "line 3", "does not come after"),
    csv("time runs back", HEAD + "0, 0\n1, 1\n0.5, 0\n", "line 4", "sort the rows"),
    csv("a gap", HEAD + ROWS + "9, 0\n", "line 5", "a gap of"),
    csv("shorter than a step", HEAD + "0, 0\n1e-9, 1\n", "shorter than one step"),
    csv("endless", HEAD + "0, 0\n1e9, 1\n2e9, 0\n", "at most 5,000,000 are possible"),
    csv("binary", b"\xff\xfe\x00time", "is not a CSV text file in UTF-8"),
    csv("other encoding", "time [s], moment [N·m/m]\n".encode("latin-1"), "CSV text file in UTF-8"),
    csv("a unit of something else", HEAD + ROWS, ELSE, keys='unit = "mm"\n'),
    uff("empty", "", "has no dataset 58"),
    uff("text", "hello\nworld\n", "has no dataset 58"),
    uff("cut off", "    -1\n    58\nblow\n", "has no dataset 58"),
    uff("binary", bytes(range(256)), "has no dataset 58"),
    uff("broken", "    -1\n    58\nblow\n    -1\n", "universal file that can be read", "58"),
    uff("another dataset", "    -1\n   151\nmodel\n    -1\n", "has no dataset 58", "151"),
]

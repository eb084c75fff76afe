"""Load signals: phases against quadrature, and every way a file can be wrong."""

from __future__ import annotations

import numpy as np
import pytest
import pyuff
from scipy.integrate import quad

from microslip.analyses.time.signals import harmonic, read_signal, silence, stepped_sine, swept_sine
from microslip.describe.units import LINE_FORCE
from microslip.errors import InputError


def test_harmonic_samples():
    time, load = harmonic(3.0, 50.0, 2.0, 1e-4)
    assert len(time) == 401
    assert time[-1] == pytest.approx(0.04)
    assert load == pytest.approx(3 * np.sin(100 * np.pi * time), abs=1e-12)


def test_silence():
    time, load = silence(0.3, 0.1)
    assert time == pytest.approx([0, 0.1, 0.2, 0.3])
    assert not load.any()


@pytest.mark.parametrize("steps", [3, 7, 49, 150, 997])
def test_whole_cycles_end_on_the_last_sample(steps):
    """1/(f n) is not a binary fraction: the last step must not be lost to rounding."""
    for frequency in (0.3, 174.6, 1234.5):
        time, load = harmonic(1.0, frequency, 10, 1 / (frequency * steps))
        assert len(time) == 10 * steps + 1
        assert abs(load[-1]) < 1e-9


@pytest.mark.parametrize(("law", "exponent"), [("linear", 0), ("log", 1)])
@pytest.mark.parametrize(("start", "stop"), [(10.0, 40.0), (40.0, 10.0), (25.0, 25.0)])
def test_swept_phase_is_the_integral_of_its_frequency(law, exponent, start, stop):
    duration = 2.0

    def frequency(t):
        if exponent:
            return start * (stop / start) ** (t / duration)
        return start + (stop - start) * t / duration

    time, load = swept_sine(1.5, start, stop, duration, 1e-3, law)
    for k in range(0, len(time), 97):
        turns = quad(frequency, 0, time[k], epsabs=1e-12, limit=200)[0]
        assert load[k] == pytest.approx(1.5 * np.sin(2 * np.pi * turns), abs=1e-8)


def test_up_and_down_sweeps_mirror_in_time():
    """The phase still to run of an upward sweep is the phase run of the downward one."""
    turns = 0.5 * (10 + 40) * 2.0
    _, up = swept_sine(1.0, 10, 40, 2.0, 1e-3)
    _, down = swept_sine(1.0, 40, 10, 2.0, 1e-3)
    assert turns == round(turns)
    assert down == pytest.approx(-up[::-1], abs=1e-9)


def test_stepped_sine_dwells_without_a_jump():
    frequencies = [10.0, 20.0, 5.0]
    time, load = stepped_sine(2.0, frequencies, 3, 1e-4)
    assert time[-1] == pytest.approx(3 * (1 / 10 + 1 / 20 + 1 / 5), abs=1e-4)
    assert np.abs(np.diff(load)).max() <= 2.0 * 2 * np.pi * 20 * 1e-4 * (1 + 1e-9)
    begin = 0.0
    for f in frequencies:
        inside = (time >= begin) & (time <= begin + 3 / f)
        assert load[inside] == pytest.approx(
            2 * np.sin(2 * np.pi * f * (time[inside] - begin)), abs=1e-9
        )
        begin += 3 / f


def test_one_step_of_a_stepped_sine_is_a_harmonic():
    assert stepped_sine(1.0, [17.0], 5, 1e-3)[1] == pytest.approx(
        harmonic(1.0, 17.0, 5, 1e-3)[1], abs=1e-9
    )


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: harmonic(1.0, 0.0, 1, 0.1), "frequency is 0"),
        (lambda: harmonic(1.0, 1.0, -1, 0.1), "cycles is -1"),
        (lambda: harmonic(1.0, 1.0, 1, np.nan), "dt is nan"),
        (lambda: stepped_sine(1.0, [], 1, 0.1), "at least one"),
        (lambda: stepped_sine(1.0, [1.0, -2.0], 1, 0.1), "frequency is -2"),
        (lambda: stepped_sine(1.0, [1.0, np.inf], 1, 0.1), "finite"),
        (lambda: swept_sine(1.0, 1.0, 2.0, 0.0, 0.1), "duration is 0"),
        (lambda: swept_sine(1.0, 1.0, 2.0, 1.0, 0.1, "cubic"), "'linear' or 'log'"),
        (lambda: silence(-1.0, 0.1), "duration is -1"),
        (lambda: silence(1e9, 1e-5), r"1e\+14 steps of 1e-05 s; at most 5,000,000"),
    ],
)
def test_senseless_signals_are_refused(call, message):
    with pytest.raises(InputError, match=message):
        call()


def write(folder, text):
    path = folder / "load.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_reads_units_and_resamples(tmp_path):
    """Milliseconds and kN m/m; a straight line stays one whatever the step."""
    rows = "\n".join(f"{5 + t}, {2 * t}" for t in (0, 1, 2.5, 3, 4, 7))
    path = write(tmp_path, "time [ms], moment [kN*m/m]\n" + rows + "\n")
    time, load = read_signal(path, 2e-4)
    assert len(time) == 36
    assert time[[0, -1]] == pytest.approx([0, 7e-3])
    assert load == pytest.approx(2000 * 1e3 * time, rel=1e-12)


def test_linear_interpolation_between_samples(tmp_path):
    path = write(tmp_path, "time [s], moment [N*m/m]\n0,0\n1,10\n\n2,-10\n3,0\n")
    assert read_signal(path, 0.5)[1] == pytest.approx([0, 5, 10, 0, -10, -5, 0])


def test_reads_another_kind_and_a_byte_order_mark(tmp_path):
    path = write(tmp_path, "\ufefftime [s],force [kN/m]\n0,1\n1,2\n")
    assert read_signal(path, 1.0, LINE_FORCE)[1] == pytest.approx([1000, 2000])


HEADER = "time [s], moment [N*m/m]\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        (HEADER, "0 rows"),
        (HEADER + "0,1\n", "1 rows"),
        (HEADER + "0,1\n1,nan\n2,0\n", r"line 3 \(time 1\): 'nan' is not finite"),
        (HEADER + "0,1\n1,2\ninf,0\n", "line 4: 'inf' is not finite"),
        (HEADER + "0,1\n1,x\n", r"line 3 \(time 1\): 'x' is not a number"),
        (HEADER + "0,1\n1,\n", r"line 3 \(time 1\): '' is not a number"),
        (HEADER + "0,1\n1,2,3\n", "line 3: has 3 columns"),
        (HEADER + "0,1\n1,2\n1,3\n", "line 4: time 1 s does not come after 1 s"),
        (HEADER + "0,1\n2,2\n1,3\n", "line 4: time 1 s does not come after 2 s"),
        (HEADER + "0,1\n1,2\n2,3\n3,1\n14,1\n15,1\n", "line 6: a gap of 11 s after 3 s"),
        ("0,1\n1,2\n2,3\n", "does not say its unit"),
        ("time, moment\n0,1\n1,2\n", "'time' does not say its unit"),
        ("time [s]\n0\n1\n", "1 columns"),
        ("time [s], moment [Pa]\n0,1\n1,2\n", "'Pa' measures something else"),
        ("time [m], moment [N*m/m]\n0,1\n1,2\n", "'m' measures something else"),
        ("time [s], moment [furlongs]\n0,1\n1,2\n", "furlongs"),
        (HEADER + "0,1\n0.01,2\n", "shorter than one step"),
    ],
)
def test_bad_files_are_refused(tmp_path, text, message):
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=message) as error:
        read_signal(path, 0.1)
    assert str(path) in str(error.value)


def test_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"nowhere\.csv: cannot be read"):
        read_signal(tmp_path / "nowhere.csv", 0.1)


def test_binary_file_is_refused(tmp_path):
    path = tmp_path / "load.csv"
    path.write_bytes(bytes(range(128, 256)))
    with pytest.raises(InputError, match="not a CSV text file"):
        read_signal(path, 0.1)


def test_ten_median_intervals_are_no_gap(tmp_path):
    path = write(tmp_path, HEADER + "0,1\n1,2\n2,3\n12,1\n13,1\n")
    assert len(read_signal(path, 1.0)[0]) == 14


def test_chosen_column_of_several(tmp_path):
    """Columns that are not asked for may hold anything."""
    path = write(tmp_path, "time [s],left [N*m/m],note,right [kN*m/m]\n0,1,a,3\n1,2,,4\n")
    assert read_signal(path, 1.0, column="right")[1] == pytest.approx([3000, 4000])
    assert read_signal(path, 1.0, column="left")[1] == pytest.approx([1, 2])
    assert read_signal(path, 1.0, column="left", unit="kN*m/m")[1] == pytest.approx([1000, 2000])
    with pytest.raises(InputError, match="choose the column: one of left, note, right"):
        read_signal(path, 1.0)
    with pytest.raises(InputError, match="no column 'top'; there are left, note, right"):
        read_signal(path, 1.0, column="top")
    with pytest.raises(InputError, match="'note' does not say its unit"):
        read_signal(path, 1.0, column="note")


# -- universal files ---------------------------------------------------------------------------

TIME = 0.002 * np.arange(60)
LOAD = 40 * np.sin(2 * np.pi * 9 * TIME) + 3


def function(x=TIME, data=LOAD, **change):
    """A dataset 58 as pyuff writes it."""
    places = {"rsp_node": 1, "rsp_dir": 1, "ref_node": 1, "ref_dir": 1}
    time = {"func_type": 1, "abscissa_spacing": 1, "abscissa_spec_data_type": 17}
    unit = {"ordinate_axis_units_lab": "N*m/m", "orddenom_spec_data_type": 0}
    return {"type": 58, **places, **time, **unit, "x": x, "data": data, **change}


def universal(folder, *sets, name="load.uff"):
    path = folder / name
    pyuff.UFF(str(path)).write_sets(list(sets))
    return path


@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("offset", [0.0, 3.0])
def test_universal_file_is_read_back(tmp_path, binary, offset):
    path = universal(tmp_path, function(x=TIME + offset, binary=binary))
    time, load = read_signal(path, 0.002)
    assert time == pytest.approx(TIME, abs=1e-9)
    assert load == pytest.approx(LOAD, rel=1e-9)


def test_universal_file_written_by_hand(tmp_path):
    """Single precision text, laid out by the published format (6E13.5 after eleven records)."""
    values = [0.0, 1.0, -2.0, 3.5, -4.25, 5.0, 6.0]
    numbers = "".join(f"{v:13.5E}" for v in values)
    header = [
        "    -1",
        "    58",
        *["NONE"] * 5,
        f"{1:5d}{0:10d}{1:5d}{0:10d} {'NONE':10s}{1:10d}{3:4d} {'NONE':10s}{1:10d}{3:4d}",
        f"{2:10d}{len(values):10d}{1:10d}{0:13.5E}{0.5:13.5E}{0:13.5E}",
        f"{17:10d}{0:5d}{0:5d}{0:5d} {'Time':20s} {'s':20s}",
        f"{9:10d}{0:5d}{0:5d}{0:5d} {'Moment':20s} {'kN*m/m':20s}",
        *[f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'NONE':20s}"] * 2,
    ]
    path = tmp_path / "load.unv"
    text = "\n".join([*header, numbers[:78], numbers[78:], "    -1", ""])
    path.write_text(text)
    time, load = read_signal(path, 0.5)
    assert time == pytest.approx(0.5 * np.arange(7))
    assert load == pytest.approx(1000 * np.array(values))


def test_unit_of_the_user_outranks_the_file(tmp_path):
    path = universal(tmp_path, function(ordinate_axis_units_lab="NONE"))
    assert read_signal(path, 0.002, unit="kN*m/m")[1] == pytest.approx(1000 * LOAD, rel=1e-9)


def test_chosen_dataset_of_several(tmp_path):
    path = universal(tmp_path, function(), function(data=2 * LOAD))
    assert read_signal(path, 0.002, dataset=2)[1] == pytest.approx(2 * LOAD, rel=1e-9)
    with pytest.raises(InputError, match=r"has 2 datasets 58; say which one"):
        read_signal(path, 0.002)
    with pytest.raises(InputError, match=r"no dataset 58 number 3, only 2"):
        read_signal(path, 0.002, dataset=3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"data": LOAD * (1 + 1j)}, "complex values"),
        ({"abscissa_spacing": 0}, "unevenly spaced samples"),
        ({"func_type": 4}, "type 4, not a time response"),
        ({"abscissa_spec_data_type": 18}, "type 18, not time"),
        ({"ordinate_axis_units_lab": "NONE"}, "does not say the unit"),
        ({"ordinate_axis_units_lab": "kg"}, "'kg' measures something else"),
        ({"ordinate_axis_units_lab": "zz"}, "'zz' is not a known unit"),
    ],
)
def test_universal_files_that_are_no_load_in_time(tmp_path, change, message):
    path = universal(tmp_path, function(**change))
    with pytest.raises(InputError, match=message) as error:
        read_signal(path, 0.002)
    assert str(path) in str(error.value)
    assert "dataset 58 number 1" in str(error.value)


def test_sample_that_is_not_a_number_is_named(tmp_path):
    """pyuff replaces nan when it writes, so the text is changed behind its back."""
    path = universal(tmp_path, function(data=np.r_[LOAD[:7], 123.0, LOAD[8:]]))
    text = path.read_text()
    number = next(word for word in text.split() if "1.23000" in word)
    path.write_text(text.replace(number, "nan".rjust(len(number))))
    with pytest.raises(InputError, match=r"sample 8 \(time 0\.014 s\): is not finite"):
        read_signal(path, 0.002)


def test_truncated_universal_file(tmp_path):
    path = universal(tmp_path, function())
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*lines[:-5], lines[-1]]))
    with pytest.raises(InputError, match="values where its header says 60"):
        read_signal(path, 0.002)


def test_universal_file_without_functions(tmp_path):
    factors = {"length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 0.0}
    path = universal(tmp_path, {"type": 164, "units_code": 1, "temp_mode": 1, **factors})
    with pytest.raises(InputError, match=r"no dataset 58 .* holds 164"):
        read_signal(path, 0.1)
    path.write_bytes(b"not a universal file")
    with pytest.raises(InputError, match="no dataset 58"):
        read_signal(path, 0.1)
    with pytest.raises(InputError, match=r"nowhere\.uff: cannot be read"):
        read_signal(tmp_path / "nowhere.uff", 0.1)

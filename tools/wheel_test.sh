#!/usr/bin/env bash
# Build the wheel, install it into an empty environment, and use it as someone would who has nothing else.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
place="$(mktemp -d)"
trap 'rm -rf "$place"' EXIT
unset PYTHONPATH

"${PYTHON:-python3}" -m venv "$place/build"
"$place/build/bin/python" -m pip install --quiet --disable-pip-version-check build
git -C "$root" ls-files -z | tar -C "$root" --null -T - -cf - | tar -C "$place" --one-top-level=source -xf -
"$place/build/bin/python" -m build --outdir "$place/dist" "$place/source" > "$place/build.log" 2>&1 ||
    { cat "$place/build.log"; exit 1; }
ls "$place/dist"

"${PYTHON:-python3}" -m venv "$place/empty"
"$place/empty/bin/python" -m pip install --quiet --disable-pip-version-check "$place"/dist/*.whl
"$place/empty/bin/python" -m pip check

mkdir "$place/elsewhere" && cd "$place/elsewhere"
PATH="$place/empty/bin:$PATH"
microslip --version
microslip --help > /dev/null
microslip new lap my.toml
python -m microslip check my.toml
cat > tiny.toml <<'TOML'
[beams]
length = "220 mm"
thickness = "8 mm"
overlap_half_length = "30 mm"
[material]
youngs_modulus = "210 GPa"
poissons_ratio = 0.3
density = "7850 kg/m^3"
[contact]
friction = 0.2
pairs = 21
[clamp]
force = "800 kN/m"
half_length = "18 mm"
[load]
moment = "50 N*m/m"
[analysis.cycle]
count = 5
TOML
microslip run tiny.toml --format png
microslip show tiny-output > /dev/null
python -c 'import microslip; from pathlib import Path
place = Path(microslip.__file__).parent
assert "site-packages" in place.parts, place
assert (place / "py.typed").is_file()
assert microslip.load_results("tiny-output").summary["failures"] == []'
echo "the wheel works by itself"

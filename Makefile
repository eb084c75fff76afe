# Needs Python 3.11 or newer and make; everything else is installed into .venv.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Bytecode is made of what is imported, not of every package.
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile
# Also where the variable is set: without bytecode every start compiles all that is imported, for seconds.
export PYTHONDONTWRITEBYTECODE :=
SERIAL := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1

.PHONY: installed demo test test-oldest validate lint docs docs-check pictures wheel-test population bench bench-calculix clean

# All packages that the other targets need.
installed: $(VENV)/installed-all

demo: $(VENV)/installed
	$(BIN)/microslip run examples/lap_joint.toml --out demo-output --force

test: $(VENV)/installed-test
	$(SERIAL) $(BIN)/python -m pytest -n 2 --dist loadfile

# The oldest versions that pyproject.toml allows, in an environment of their own.
test-oldest:
	mkdir -p build && $(PYTHON) tools/oldest.py > build/oldest.txt
	$(PYTHON) -m venv $(VENV)-oldest
	$(VENV)-oldest/bin/python -m pip install --quiet --disable-pip-version-check -c build/oldest.txt -e . pytest hypothesis
	NUMBA_CACHE_DIR=$(abspath $(VENV))-oldest/numba $(VENV)-oldest/bin/python -m pytest tests/describe tests/model tests/results tests/cli

validate: $(VENV)/installed-test
	$(SERIAL) $(BIN)/python -m pytest -m validate -n 2 --dist loadfile --durations=5 --findings=docs/validation.md

lint: $(VENV)/installed-lint
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo --no-cache
	$(BIN)/python tools/house.py

# Sphinx shares the pages out in their order: by sixteen, tutorials, which compute, are in several shares, and
# what every share costs by itself does not count yet.
docs: $(VENV)/installed-docs
	$(SERIAL) $(BIN)/sphinx-build -j 16 -W --keep-going -b html docs docs/_build/html

# Opens every page in Chromium without a network; needs one (Debian: chromium).
docs-check: docs $(VENV)/installed-pages
	$(BIN)/python docs/_scripts/check_pages.py docs/_build/html

# Draws those pictures of the documentation again that are older than what they show.
pictures: $(VENV)/installed
	$(BIN)/python tools/pictures.py

# Built, installed into an empty environment, and run outside the source tree.
wheel-test:
	PYTHON=$(PYTHON) tools/wheel_test.sh

# A hundred random lap joints with defaults only; writes the page of the documentation.
population: $(VENV)/installed
	$(SERIAL) $(BIN)/python benchmarks/population/run.py --page docs/population.md

bench: $(VENV)/installed
	$(SERIAL) $(BIN)/python benchmarks/run.py

# Needs the program ccx (Debian: calculix-ccx); says so and stops where it is absent.
bench-calculix: $(VENV)/installed
	$(SERIAL) $(BIN)/python benchmarks/calculix/ccx_compare.py
	$(SERIAL) $(BIN)/python benchmarks/calculix/half_lap_beam.py

clean:
	rm -rf demo-output population-output docs/_build docs/api/generated docs/input-reference.md build dist .pytest_cache .hypothesis .mypy_cache .ruff_cache
	find src tests benchmarks docs -name __pycache__ -type d -prune -exec rm -rf {} +

# One stamp per set of packages: installed once, and again when pyproject.toml changes.
$(VENV)/created:
	$(PYTHON) -c 'import sys; sys.exit(None if sys.version_info >= (3, 11) else "microslip needs Python 3.11 or newer; this is " + sys.version.split()[0] + " (choose another with make PYTHON=...)")'
	$(PYTHON) -m venv $(VENV)
	touch $@

$(VENV)/installed: pyproject.toml | $(VENV)/created
	$(PIP) -e .
	$(BIN)/python -m microslip.pipeline.compile
	touch $@

$(VENV)/installed-%: pyproject.toml $(VENV)/installed | $(VENV)/created
	$(PIP) -e '.[$*]'
	touch $@

# At once: each call of pip makes and resolves the package anew. What opens pages only where there is a browser.
EXTRAS := $(strip test lint docs $(if $(shell command -v chromium),pages))
COMMA := ,
$(VENV)/installed-all: pyproject.toml | $(VENV)/created
	$(PIP) -e '.[$(subst $() ,$(COMMA),$(EXTRAS))]'
	$(BIN)/python -m microslip.pipeline.compile
	touch $(VENV)/installed $(addprefix $(VENV)/installed-,$(EXTRAS)) $@

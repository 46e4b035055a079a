# Two commands on a fresh machine: `make demo` and `make test`. Both set up .venv first, `make demo`
# with what users need alone.
# `make peers` is for tests/benchmarks alone.

VENV := .venv
BIN := $(VENV)/bin
MADE := $(VENV)/pyvenv.cfg
RUNS := $(VENV)/.runs
INSTALLED := $(VENV)/.installed
PIP_INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt
PYENV_VERSIONS := $(or $(PYENV_ROOT),$(HOME)/.pyenv)/versions
# pyenv's command `python3.12` fails where that version is not selected
SUPPORTED := import sys, ensurepip; sys.exit(not (3, 12) <= sys.version_info[:2] <= (3, 13))

# `make test ALSO=slow` adds the slow tests to the same session, as .ci/run does
SELECTED := $(if $(filter slow,$(ALSO)),,not slow and )not minutes and not hardware and not benchmark
# tests that must keep time have the computer for themselves, the others share its processors
ALONE := (punctual or alone)
ALONE_IN = $(shell grep -rlE 'mark\.(punctual|alone)' tests --include='test_*.py')
SHARED := -n logical --maxprocesses 4 --dist worksteal

PEERS := .venv-peers
PEER_PYTHON := 3.12
$(PEERS)/elfi/.installed: PEER_PYTHON := 3.9
PEER_SUPPORTED = import sys, ensurepip; sys.exit("%d.%d" % sys.version_info[:2] != "$(PEER_PYTHON)")

.DELETE_ON_ERROR:

.PHONY: setup demo dist browser test test-long docs physics against paper lint peers clean

setup: $(INSTALLED)

$(MADE): pyproject.toml constraints.txt
	@python=; \
	for candidate in $(PYTHON) python3.12 "$(PYENV_VERSIONS)"/3.12.*/bin/python \
		python3.13 "$(PYENV_VERSIONS)"/3.13.*/bin/python python3 python; do \
		if "$$candidate" -c "$(SUPPORTED)" >/dev/null 2>&1; then python=$$candidate; break; fi; \
	done; \
	if [ -z "$$python" ]; then \
		echo "make: no Python 3.12 or 3.13 found; install one, or name it: make PYTHON=/path/to/python" >&2; \
		exit 1; \
	fi; \
	echo "Setting up $(VENV) with $$("$$python" --version)"; \
	"$$python" -m venv --clear $(VENV)

$(RUNS): $(MADE)
	$(PIP_INSTALL) -e .
	@touch $@

$(INSTALLED): $(MADE)
	$(PIP_INSTALL) -e '.[dev]'
	@touch $(RUNS) $@

demo: $(RUNS)
	$(BIN)/bolfi-liquids demo --out runs/demo

# for the report page's test
browser: setup
	@command -v chromium chromium-browser google-chrome >/dev/null \
	|| { command -v apt-get >/dev/null && apt-get update -qq && apt-get install -y -qq chromium; } \
	|| $(BIN)/playwright install --with-deps chromium

test: setup
	$(BIN)/pytest $(SHARED) --durations 20 -m "$(SELECTED) and not $(ALONE)"
	$(BIN)/pytest --durations 20 -m "$(SELECTED) and $(ALONE)" $(ALONE_IN)

test-long: setup
	$(BIN)/pytest -m minutes -o faulthandler_timeout=0

# the site, docs/_build/html/index.html; `make docs NOTEBOOKS=1` executes the notebooks
docs: setup
	NOTEBOOKS=$(NOTEBOOKS) $(BIN)/sphinx-build -W --keep-going --quiet -c docs \
		-d docs/_build/doctrees . docs/_build/html

# cases of the fluid with their tables, or those whose names hold CASE; figures lie in RESULTS
physics: setup
	RESULTS=$(or $(RESULTS),runs/physics) $(BIN)/pytest -s -m "slow or minutes" \
		-o faulthandler_timeout=0 $(if $(CASE),-k "$(CASE)") tests/physics/test_physics.py

# stirs and pours of the reference in the directory REFERENCE; CELL is the width of pours' cells [mm]
against: setup
	@test -n "$(REFERENCE)" || { echo "make: name a directory of stirs or pours:" \
		"make against REFERENCE=tests/data/stirring_reference" >&2; exit 1; }
	REFERENCE="$(REFERENCE)" CELL="$(CELL)" RESULTS=$(or $(RESULTS),runs/against) $(BIN)/pytest -s \
		-m benchmark -o faulthandler_timeout=0 $(if $(CASE),-k "$(CASE)") \
		tests/benchmarks/against/test_against.py

# sdist and wheel, tried outside the clone
dist: setup
	.ci/dist

lint: setup
	$(BIN)/ruff check
	$(BIN)/ruff format --check

# `make paper FIGURES="inclination posterior" QUICK=1`: some figures, of fewer liquids
paper: $(RUNS)
	$(BIN)/python -m tests.benchmarks.paper $(FIGURES) $(if $(QUICK),--quick)

# Peers cannot all be installed beside us, nor beside each other: each has its own environment.
peers: $(foreach peer,elfi sbi pyvbmc surmise,$(PEERS)/$(peer)/.installed)

$(PEERS)/%/.installed: tests/benchmarks/peers/%.txt
	@python=; \
	for candidate in $(PEERS_PYTHON) python$(PEER_PYTHON) \
		"$(PYENV_VERSIONS)"/$(PEER_PYTHON).*/bin/python; do \
		if "$$candidate" -c '$(PEER_SUPPORTED)' >/dev/null 2>&1; then python=$$candidate; break; fi; \
	done; \
	if [ -z "$$python" ]; then \
		echo "make: $* needs Python $(PEER_PYTHON), found neither on the path nor with pyenv;" \
			"install it, or name it: make peers PEERS_PYTHON=/path/to/python" >&2; \
		exit 1; \
	fi; \
	echo "Setting up $(PEERS)/$* with $$("$$python" --version)"; \
	"$$python" -m venv --clear $(PEERS)/$*
	$(PEERS)/$*/bin/python -m pip install --quiet --disable-pip-version-check --use-pep517 -r $<
	@touch $@

clean:
	rm -rf $(VENV) $(PEERS) build dist docs/_build *.egg-info .pytest_cache .ruff_cache

# make reproduce: the experiments of the paper, out/index.html
# make test:      all tests
# make docs:      the documentation, out/docs/index.html
# make stress:    the long ones
#
# Everything is installed into .venv, in the versions of constraints.txt. What was installed is remembered in
# .venv/.installed-*; only a change of pyproject.toml or constraints.txt installs again. `make test-lowest` has an
# environment of its own, .venv-lowest, with the oldest versions that pyproject.toml allows.

VENV := .venv
PY := $(VENV)/bin/python
LOWEST := .venv-lowest
# What meets every library where its versions differ.
LOWEST_TESTS := $(addprefix tests/test_,compiler_zig.py documents.py front.py frozen.py gain_condition.py integrators.py mujoco.py \
                  scene.py sweep.py symbolic.py tune.py)
WORKERS ?= 2

export MPLBACKEND := Agg
# One thread per process: the matrices are small, and the workers use the cores already.
export OPENBLAS_NUM_THREADS := 1
# Modules are compiled where they are first imported, and never those that nothing imports (--no-compile below).
export PYTHONDONTWRITEBYTECODE :=

.PHONY: help reproduce docs test test-lowest stress lint clean
.NOTPARALLEL:
.DELETE_ON_ERROR:

help:
	@echo "make reproduce   run every experiment of the paper and write out/index.html"
	@echo "make docs        build the documentation, out/docs/index.html (npm fetches MathJax; DOCS=--short is quicker)"
	@echo "make test        run all tests (WORKERS=$(WORKERS) at a time)"
	@echo "make test-lowest run those that depend on libraries with the oldest versions allowed"
	@echo "make stress      run the long versions of tests, and print what they found (docs/reliability.md)"
	@echo "make lint        check style (ruff) and types (mypy)"
	@echo "make clean       remove out/, built packages and caches; .venv stays"
	@echo "PYTHON=...       the Python 3.11 or newer that .venv is made with"

reproduce: $(VENV)/.installed-core
	@$(PY) scripts/reproduce.py

docs: $(VENV)/.installed-docs
	@$(PY) scripts/build_docs.py $(DOCS)

test: $(VENV)/.installed-test
	@$(PY) -m pytest -q -n $(WORKERS) --dist loadfile

test-lowest: $(LOWEST)/.installed-lowest
	@$(LOWEST)/bin/python -m pytest -q -n $(WORKERS) --dist loadfile $(LOWEST_TESTS)

stress: $(VENV)/.installed-test
	@$(PY) -m pytest -q -n $(WORKERS) -m stress tests/stress

lint: $(VENV)/.installed-dev
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy

clean:
	rm -rf out build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -path "./$(VENV)*" -prune -o -name __pycache__ -type d -prune -exec rm -rf {} +

$(VENV)/.installed-core: WHAT := .[compiled,mujoco]
$(VENV)/.installed-test: WHAT := .[test,notebooks,compiled,compiler,mujoco,sweep,tune,xacro,data,rerun]
$(VENV)/.installed-docs: WHAT := .[docs,notebooks,compiled,compiler,mujoco,sweep,tune,xacro,data,rerun]
$(VENV)/.installed-dev:  WHAT := .[dev]
$(LOWEST)/.installed-lowest: WHAT := .[test,compiled,compiler,mujoco,sweep,tune,data]

$(VENV)/.installed-%: $(VENV)/.made pyproject.toml constraints.txt
	$(call install,$(VENV),$(WHAT),constraints.txt)

$(LOWEST)/.installed-%: $(LOWEST)/.made pyproject.toml constraints-lowest.txt
	$(call install,$(LOWEST),$(WHAT),constraints-lowest.txt)

# $(call install,ENVIRONMENT,WHAT,VERSIONS)
define install
	@echo "Installing $(2) into $(1): once, a minute or two."
	@$(1)/bin/python -m pip install -qq --disable-pip-version-check --no-compile -c $(3) -e '$(2)'
	@touch $@
endef

# PYTHON, or the first of these that runs and is new enough; then it must be able to make an environment.
$(VENV)/.made $(LOWEST)/.made:
	@for python in $(or $(PYTHON),python3.11 python3); do \
	    if "$$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then \
	        found=$$python; break; \
	    fi; \
	done; \
	if [ -z "$$found" ]; then \
	    echo "synctrl needs Python 3.11 or newer; $(or $(PYTHON),python3.11 and python3) found: $$($(or $(PYTHON),python3) --version 2>&1)." \
	         "Name another one: make PYTHON=/path/to/python3.11 ..." >&2; exit 1; \
	fi; \
	if ! "$$found" -c 'import ensurepip, venv' 2>/dev/null; then \
	    echo "$$found cannot make a virtual environment: its modules venv and ensurepip are missing" \
	         "(on Debian: apt-get install python3-venv)." >&2; exit 1; \
	fi; \
	echo "Making $(@D) with $$("$$found" --version)."; \
	"$$found" -m venv $(@D)
	@touch $@

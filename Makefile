# Two commands for a fresh machine: `make demo` and `make test`. Both set everything up, and do it only once.

PYTHONS ?= python3 python3.13 python3.12 python3.11
VENV := .venv
BIN := $(VENV)/bin
RUNTIME := $(VENV)/.sprag-runtime
DEV := $(VENV)/.sprag-dev
SOURCES := pyproject.toml constraints.txt
# Of what is installed, most is never imported: a module is compiled when it is imported for the first time.
PIP := $(BIN)/python -m pip --disable-pip-version-check --no-input --quiet --quiet install --no-compile -c constraints.txt

# The tests start many processes: compiling all modules anew in each would be a third of their time.
unexport PYTHONDONTWRITEBYTECODE

CHECKS := ruff imports reference catalogues collect
SIDE_BY_SIDE = $(MAKE) --no-print-directory --jobs 2 $(if $(filter output-sync,$(.FEATURES)),--output-sync)

.PHONY: help demo test check kernels bounds serve docs dist clean mypy $(CHECKS)

help:
	@echo "make demo [EXIT=1]   set up, run the example study over HTTP, show its curve, then serve (or stop)"
	@echo "make test            set up and run every check and test"
	@echo "make bounds          run quick tests with the lowest and the highest versions of libraries"
	@echo "make serve           set up and run the service"
	@echo "make docs            build the documentation as a site, which the service shows"
	@echo "make dist            build a release in dist/: its sources, and the wheel of them"
	@echo "make clean           remove the environment and what was built"

demo: $(RUNTIME)
	@$(BIN)/sprag demo $(if $(filter-out 0 no false,$(EXIT)),--exit)

serve: $(RUNTIME)
	@$(BIN)/sprag serve

docs: $(DEV)
	$(BIN)/python -m docs.site

# The wheel is built from the packed sources, so that it has nothing that they lack. Old builds would be packed as well. The
# constraints are the versions with which a release was tested.
dist: docs
	rm -rf build dist *.egg-info/SOURCES.txt
	$(BIN)/python -c 'from setuptools.build_meta import build_sdist; build_sdist("dist")' >/dev/null
	$(BIN)/python -m pip --disable-pip-version-check --quiet wheel --no-deps --no-build-isolation --wheel-dir dist dist/*.tar.gz
	cp constraints.txt dist/
	@ls dist

# The tests of one file share processes and servers, so they stay together, as do some files (TOGETHER in tests/conftest.py).
# Many wait for processes of the program, so that three run side by side even on two cores. mypy takes longer than the other
# checks together, and one core: the tests have the other one meanwhile. What it has found is told after them.
test: $(DEV)
	@$(SIDE_BY_SIDE) kernels $(CHECKS)
	@$(BIN)/mypy >$(VENV)/types 2>&1 & types=$$!; \
	$(BIN)/python -m pytest --numprocesses 3 --dist loadfile --no-loadscope-reorder; tests=$$?; \
	wait $$types || { cat $(VENV)/types; exit 1; }; exit $$tests

check: $(DEV)
	@$(SIDE_BY_SIDE) mypy $(CHECKS)

ruff: $(DEV)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

mypy: $(DEV)
	$(BIN)/mypy

imports: $(DEV)
	$(BIN)/lint-imports

reference: $(DEV)
	$(BIN)/python -m docs.reference --check

catalogues: $(DEV)
	$(BIN)/python -m docs.catalogues --check

# Every file of tests can be imported. The processes that run them find them compiled, which each of them did anew.
collect: $(DEV)
	$(BIN)/python -m pytest --collect-only --quiet --quiet >$(VENV)/collected || (cat $(VENV)/collected; exit 1)

# Processes that begin side by side would each compile them.
kernels: $(DEV)
	$(BIN)/python -m tests.kernels

# No part of `make test`: it installs everything twice.
bounds: $(DEV)
	$(BIN)/python -m benchmarks.bounds lowest
	$(BIN)/python -m benchmarks.bounds highest

# The first Python in PYTHONS that is new enough makes the environment; a broken environment is made anew. The pip that
# Python brings takes twice as long to install the rest.
define MAKE_ENVIRONMENT
if ! $(BIN)/python -m pip --version >/dev/null 2>&1; then \
  for candidate in $(PYTHONS); do \
    if $$candidate -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then python=$$candidate; break; fi; \
  done; \
  if [ -z "$$python" ]; then \
    echo "Sprag needs Python 3.11 or newer, and none of these is: $(PYTHONS)." >&2; exit 1; \
  fi; \
  if ! $$python -c 'import venv, ensurepip' 2>/dev/null; then \
    echo "$$python has no venv module; on Debian and Ubuntu the package python3-venv brings it." >&2; exit 1; \
  fi; \
  echo "Making the environment $(VENV) ..."; \
  $$python -m venv --clear $(VENV) || exit 1; \
  $(PIP) --upgrade pip || exit 1; \
fi
endef

$(RUNTIME): $(SOURCES)
	@$(MAKE_ENVIRONMENT)
	@echo "Installing Sprag (a minute or so, this once) ..."
	@$(PIP) -e '.[server]'
	@touch $@

$(DEV): $(SOURCES)
	@$(MAKE_ENVIRONMENT)
	@echo "Installing Sprag and its tools (a minute or so, this once) ..."
	@$(PIP) -e '.[dev]'
	@touch $(RUNTIME) $@

clean:
	rm -rf $(VENV) build dist demo service/http/web/site *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache

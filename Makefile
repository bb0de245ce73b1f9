# make demo    set up, run the main job, say where its report is
# make test    set up, then lint, types, import rules and every test: what CI runs
# make quick   the tests of less than a second, in under a minute: for while one works
# make bench   all that `hierarchy bench` measures, then other packages
# make stress  a resolver on a million generated problems, every answer certified; half an hour
# make reproduce  the studies and timings behind the documents, written into the pages
# make docs    build the documentation, any warning an error, and say where it is
# make dist    build the wheels, with compiled kernels and without, and the source archive, in dist/
# make clean   remove what the targets above made
#
# PYTHON=/path/to/python3 chooses the interpreter; otherwise the first suitable one is taken.

SHELL      := /bin/bash
PYTHON     ?=
CANDIDATES := $(PYTHON) $(if $(PYTHON),,python3.11 python3.12 python3.13 python3)
BIN        := .venv/bin

# Small matrices: threads of the linear algebra library only wait for each other.
export OPENBLAS_NUM_THREADS := 1

# Without compiled modules each of the hundreds of processes of a test would compile them again.
unexport PYTHONDONTWRITEBYTECODE

# What kernels need is installed first: those of the solvers, then of robots. The rest follows while
# they are compiled.
MAKEFLAGS  += --jobs=3
ARRAYS     := .venv/arrays
SMALL      := .venv/scenarios
INSTALLED  := .venv/installed
PIP        := env PYTHONWARNINGS=ignore $(BIN)/python -m pip install --quiet --no-compile \
              --disable-pip-version-check --progress-bar off --constraint constraints.txt

.DELETE_ON_ERROR:
.PHONY: demo test quick bench stress reproduce docs dist clean set-up kernels others-o robots-o solvers-o

demo: kernels
	@rm -rf runs/demo
	@$(BIN)/hierarchy compare ellipse --out runs/demo

test: set-up
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo
	$(BIN)/pytest -n auto --maxprocesses 4 --dist worksteal

quick: set-up
	$(BIN)/pytest -n auto --maxprocesses 4 --dist worksteal -m "not slow"

bench: set-up
	@$(BIN)/hierarchy bench
	@$(BIN)/hierarchy bench peers

COUNT    ?= 1000000
RESOLVER ?= hcod

stress: set-up
	@$(BIN)/hierarchy bench stress --count $(COUNT) --resolver $(RESOLVER)

reproduce: set-up
	@$(BIN)/hierarchy reproduce

docs: $(INSTALLED)
	@$(BIN)/python -m sphinx -E -W --keep-going -q -b html docs build/docs
	@echo "Documentation: build/docs/index.html"

# A wheel for any machine, and those with kernels: machine code for x86-64-v3, which refers to no
# system library but libm, and LLVM code of which other processors make theirs.
PLATFORM := --config-setting=--build-option=--plat-name=manylinux_2_17_

# The time in all archives, so that the same sources make the same files.
dist: export SOURCE_DATE_EPOCH ?= $(shell git log -1 --format=%ct 2>/dev/null || echo 1577836800)
dist: set-up
	@rm -rf dist build
	@$(BIN)/python -m build --no-isolation --outdir dist
	@if [ -e hierarchy/jit/objects/solvers.kernels ] && [ "$$(uname -sm)" = "Linux x86_64" ]; then \
	  for machine in x86_64 aarch64; do \
	    $(BIN)/python -m build --no-isolation --wheel --outdir dist $(PLATFORM)$$machine; done; fi
	@cd dist && tar xzf *.tar.gz && rm *.tar.gz && for archive in */; do \
	  tar --sort=name --mtime=@$$SOURCE_DATE_EPOCH --owner=0 --group=0 --numeric-owner -c $$archive \
	  | gzip -n9 > $${archive%/}.tar.gz && rm -r $$archive; done

clean:
	rm -rf .venv build dist runs hierarchy/jit/objects *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache

set-up: kernels $(INSTALLED)

# Kernels are compiled again when their sources have changed; without them each process compiles what
# it calls, so that a failure stops nothing.
kernels: solvers-o others-o robots-o

solvers-o others-o: $(ARRAYS)
	-@$(BIN)/python -m scenarios.ahead $(@:-o=)

robots-o: $(SMALL)
	-@$(BIN)/python -m scenarios.ahead robots

# One set-up for all targets, repeated only when what is to be installed has changed.
$(INSTALLED): $(SMALL)
	@$(PIP) --editable '.[dev]'
	@echo "Installed $$($(BIN)/python -m pip list --disable-pip-version-check --format freeze | wc -l) packages into .venv."
	@touch $@

$(SMALL): $(ARRAYS)
	@$(PIP) --editable '.[scenarios,qp]'
	@touch $@

$(ARRAYS): pyproject.toml constraints.txt
	@if [ -L .venv ]; then \
	  echo ".venv is a link, and what it points to would be emptied; remove the link: rm .venv" >&2; \
	  exit 1; \
	fi; \
	python=; \
	for candidate in $(CANDIDATES); do \
	  if "$$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; \
	  then python=$$candidate; break; fi; \
	done; \
	if [ -z "$$python" ]; then \
	  echo "task-hierarchy needs Python 3.11 or newer; tried: $(CANDIDATES)." >&2; \
	  echo "Debian and Ubuntu: apt install python3 python3-venv. Or: make PYTHON=/path/to/python3" >&2; \
	  exit 1; \
	fi; \
	if ! "$$python" -c 'import venv, ensurepip' 2>/dev/null; then \
	  version=$$("$$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])'); \
	  echo "$$python cannot make a virtual environment: its venv or ensurepip module is missing." >&2; \
	  echo "Debian and Ubuntu: apt install python$$version-venv" >&2; \
	  exit 1; \
	fi; \
	echo "Setting up .venv with $$("$$python" --version) (once; downloads about 250 MB) ..."; \
	"$$python" -m venv --clear .venv
	-@$(PIP) --upgrade pip  # the pip of Python 3.11 takes twice the time
	@$(PIP) numba scipy
	@touch $@

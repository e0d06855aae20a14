# Needs only make and Python 3.11 or newer; everything else goes into .venv.
#
#   make demo          render a first picture
#   make test          lint, then all tests, on the installed program
#   make lint          style, types, import directions
#   make bench         the speed table of this machine
#   make portability   the same pictures on every OpenCL implementation (installs those that are missing)

SHELL := /bin/sh
VENV := .venv
BIN := $(VENV)/bin
# The tests run in a folder that holds links to them but no `clfractal`: they find the installed one.
STAGE := build/stage
# A worker for each core; compiling a kernel keeps one busy for seconds. Idle workers take tests of others.
PARALLEL := -n auto --dist worksteal
STAGED := tests benchmarks docs scenes README.md CHANGELOG.md pyproject.toml Makefile

PYTHON := $(shell for python in python3.13 python3.12 python3.11 python3 python; do \
	$$python -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1 && echo $$python && break; done)
SOURCES := $(shell find clfractal kernels scenes -type f ! -name '*.pyc') pyproject.toml README.md LICENSE

.PHONY: demo test lint bench portability install clean

demo: $(VENV)/.installed
	@mkdir -p out
	@$(BIN)/clfractal render scenes/mandelbulb.yaml -o out/bulb.exr -o out/bulb.png
	@echo out/bulb.exr
	@echo out/bulb.png

install: $(VENV)/.installed

test: lint $(VENV)/.tested-with $(STAGE)/.linked
	cd $(STAGE) && CLFRACTAL_EXPECT_INSTALLED=1 $(CURDIR)/$(BIN)/python -P -m pytest $(PARALLEL) $(ARGUMENTS)

lint: $(VENV)/.tested-with
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy --strict
	$(BIN)/lint-imports

bench: $(VENV)/.installed
	$(BIN)/clfractal bench

portability: $(VENV)/.tested-with $(STAGE)/.linked
	cd $(STAGE) && $(CURDIR)/$(BIN)/python -m tests.portability $(ARGUMENTS)

# A system without ensurepip (Debian's python3 without python3-venv) may still have pip.
$(VENV)/bin/python:
	@test -n "$(PYTHON)" || { echo "clfractal needs Python 3.11 or newer on the PATH" >&2; exit 2; }
	$(PYTHON) -m venv $(VENV) || { $(PYTHON) -m venv --clear --without-pip $(VENV) \
		&& $(PYTHON) -m pip --python $(VENV)/bin/python install --quiet pip; }

$(VENV)/.installed: $(SOURCES) | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check .
	@touch $@

$(VENV)/.tested-with: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check '.[test]'
	@touch $@

$(STAGE)/.linked: Makefile
	@rm -rf $(STAGE) && mkdir -p $(STAGE)
	@for name in $(STAGED); do ln -s $(CURDIR)/$$name $(STAGE)/$$name; done
	@touch $@

clean:
	rm -rf $(VENV) build out .mypy_cache .ruff_cache .pytest_cache .import_linter_cache

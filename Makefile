# Needs only make and Python 3.11 or newer; everything else goes into .venv, what `make lint` needs into .venv-lint.
#
#   make demo          render a first picture
#   make test          all tests, on the installed program
#   make lint          style, types, import directions, what nothing uses: with exact versions of tools, so that it says the same everywhere
#   make view          the window (needs a display)
#   make window        tests of the window, on a screen of their own (needs Xvfb, xdotool, openbox and Mesa)
#   make cluster       tests of the cluster, with schedulers and workers that are killed (ARGUMENTS="-k film")
#   make kills         200 workers killed at random, some fifteen minutes; no pixel may differ (ARGUMENTS="--kills 20 --seed 7")
#   make soak          ten minutes of random events for the window, from a seed
#   make locks         which versions the dependencies resolve to on Linux, macOS and Windows (tests/platforms/locks)
#   make lowest        render (on a cluster too), animate, voxelize, mesh and view once with the lowest versions of libraries that pyproject.toml allows
#   make bench         the speed table of this machine
#   make truth         how near pictures are to the set, by brute force (ARGUMENTS="--formula mandelbulb")
#   make peers         silhouettes and depths beside the installed Mandelbulber 2, for its examples (ARGUMENTS="--sample 20")
#   make jacobians     automatic Jacobians of all formulas made of its texts, beside differences with 60 digits
#   make mutate        60 small mistakes in copies of the program, and whether a test notices (ARGUMENTS="--seed 7 --sample 20")
#   make gpu-check     what all kernels need on GPUs of NVIDIA and AMD, without one (needs clang-16 and libclc-16)
#   make portability   the same pictures on every OpenCL implementation (installs those that are missing)
#
# Another Python: `make test PYTHON=python3.12 VENV=.venv-3.12`. An environment keeps the Python that it was made with.

SHELL := /bin/sh
# Python keeps what it compiles: pytest takes half a minute to read all tests anew, in each of its processes.
export PYTHONDONTWRITEBYTECODE :=
VENV := .venv
BIN := $(abspath $(VENV))/bin
LINT := .venv-lint
LOWEST := .venv-lowest
# The tests run in a folder that holds links to them but no `clfractal`: they find the installed one.
STAGE := build/stage
# A worker for each core; compiling a kernel keeps one busy for seconds. Idle workers take tests of others.
PARALLEL := -n auto --dist worksteal
STAGED := tests benchmarks docs scenes README.md CHANGELOG.md pyproject.toml Makefile

# A version manager may answer for a Python that it does not have: only one that really runs is taken.
PYTHON := $(shell for python in python3.14 python3.13 python3.12 python3.11 python3 python; do \
	$$python -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1 && echo $$python && break; done)
# Versions that are low enough to be the lowest have no wheels for the newest Python.
OLDEST := $(shell for python in python3.11 python3.12 python3.13 python3.14 python3 python; do \
	$$python -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1 && echo $$python && break; done)
SOURCES := $(shell find clfractal kernels scenes -type f ! -name '*.pyc') pyproject.toml README.md LICENSE docs/clfractal.1

.PHONY: demo view test light combinations window cluster kills soak lint locks lowest bench truth peers jacobians mutate gpu-check portability install clean

demo: $(VENV)/.installed
	@mkdir -p out
	@$(BIN)/clfractal render scenes/mandelbulb.yaml -o out/bulb.exr -o out/bulb.png
	@echo out/bulb.exr
	@echo out/bulb.png

view: $(VENV)/.viewer
	@$(BIN)/clfractal view scenes/mandelbulb.yaml

install: $(VENV)/.installed

test: $(VENV)/.tested-with $(STAGE)/.linked
	cd $(STAGE) && CLFRACTAL_EXPECT_INSTALLED=1 $(BIN)/python -P -m pytest --ignore=tests/window --ignore=tests/cluster -m "not combination and not light" $(PARALLEL) $(ARGUMENTS)

# Light along paths: furnaces, closed forms, Mitsuba 3 beside it. Its truth is in statistics, which take samples.
light: $(VENV)/.tested-with $(STAGE)/.linked
	cd $(STAGE) && CLFRACTAL_EXPECT_INSTALLED=1 $(BIN)/python -P -m pytest tests/render tests/elements -m "light and not combination" $(PARALLEL) $(ARGUMENTS)

# Every formula, number type, lane count, normal and picture that the usual tests show by examples.
combinations: $(VENV)/.tested-with $(STAGE)/.linked
	cd $(STAGE) && CLFRACTAL_EXPECT_INSTALLED=1 $(BIN)/python -P -m pytest --ignore=tests/window --ignore=tests/cluster -m combination $(PARALLEL) $(ARGUMENTS)

# A window waits for its user, and for a while in which nothing changes: two at a time, each file on screens of its own. Where
# seconds count it has the cores to itself (`quiet`). A screen, a window manager and a hand on the mouse are programs
# of their own, so what fails is tried once more before it counts.
WINDOWS = $(BIN)/python -P -m pytest tests/window
window: $(VENV)/.tested-with $(STAGE)/.linked
	cd $(STAGE) && export CLFRACTAL_EXPECT_INSTALLED=1 && status=0 && { \
		$(WINDOWS) -m "not quiet" -n 2 --dist loadfile $(ARGUMENTS) || test $$? = 5 || status=1; \
		$(WINDOWS) -m quiet $(ARGUMENTS) || test $$? = 5 || status=1; } \
		&& { test $$status = 0 || { echo "once more, what has failed:"; $(WINDOWS) --last-failed $(ARGUMENTS); }; }

# Real processes that share the cores: one test at a time.
cluster: $(VENV)/.cluster $(STAGE)/.linked
	cd $(STAGE) && CLFRACTAL_EXPECT_INSTALLED=1 $(BIN)/python -P -m pytest tests/cluster $(ARGUMENTS)

kills: $(VENV)/.cluster $(STAGE)/.linked
	cd $(STAGE) && $(BIN)/python -m tests.cluster.kills $(ARGUMENTS)

soak: $(VENV)/.tested-with $(STAGE)/.linked
	cd $(STAGE) && $(BIN)/python -P -m tests.window.soak $(or $(ARGUMENTS),--minutes 10)

lint: $(LINT)/.installed
	$(LINT)/bin/ruff check .
	$(LINT)/bin/ruff format --check .
	$(LINT)/bin/mypy --strict
	$(LINT)/bin/mypy --strict --platform win32 clfractal
	$(LINT)/bin/mypy --strict --platform darwin clfractal
	$(LINT)/bin/lint-imports
	$(LINT)/bin/vulture

locks: $(LOWEST)/bin/python
	$(LOWEST)/bin/python -m pip install --quiet --disable-pip-version-check 'uv>=0.5'
	$(LOWEST)/bin/python -m tests.platforms.systems $(LOWEST)/bin/uv

# The pictures and files are made in a folder outside the checkout, so that the installed program is what runs.
lowest: $(LOWEST)/.installed
	@rm -rf build/lowest && mkdir -p build/lowest
	cd build/lowest && program=$(abspath $(LOWEST))/bin/clfractal && scene=$(CURDIR)/scenes/mandelbulb.yaml \
		&& $$program --version && $$program check $$scene >checked.yaml \
		&& $$program render checked.yaml --size 96x54 --samples 1 -o bulb.exr -o bulb.png \
		&& $$program render bulb.exr -o again.png -o again.jpg -o again.webp \
		&& $$program render again.webp -o once-more.png && $$program probe again.jpg 48,27 \
		&& $$program animate $$scene --set 'animation={frames: 2}' --size 96x54 --samples 1 -o film.mp4 && test -s film.mp4 \
		&& $$program render $$scene --size 96x54 --samples 1 --cluster local:1 -o far.png && test -s far.png \
		&& $$program voxelize $$scene --resolution 32 -o bulb.nrrd \
		&& $$program mesh bulb.nrrd -o bulb.ply && $$program mesh $$scene --resolution 32 -o bulb.glb \
		&& test -s bulb.exr -a -s bulb.png -a -s once-more.png -a -s again.jpg -a -s bulb.nrrd -a -s bulb.ply -a -s bulb.glb \
		&& if command -v xvfb-run >/dev/null; then xvfb-run -a $$program view $$scene --size 640x360 --shot view.png \
		&& test -s view.png; fi

bench: $(VENV)/.installed
	$(BIN)/clfractal bench

truth: $(VENV)/.installed
	$(BIN)/python -m benchmarks.truth $(ARGUMENTS)

# What was measured is kept in build/peers.json, and not measured again.
peers: $(VENV)/.installed
	$(BIN)/python -m benchmarks.peers $(ARGUMENTS)

jacobians: $(VENV)/.installed
	$(BIN)/python -m benchmarks.peers.jacobians $(ARGUMENTS)

# Copies of the checkout are changed, so it is the checkout that is tested and not what is installed.
mutate: $(VENV)/.mutates-with
	PYTHONPATH=$(CURDIR) $(BIN)/python -P -m tests.mutants $(ARGUMENTS)

# Run in the checkout, whose record and page it may write.
gpu-check: $(VENV)/.gpu-compilers
	PYTHONPATH=$(CURDIR) $(BIN)/python -P -m tests.gpu $(ARGUMENTS)

portability: $(VENV)/.tested-with $(STAGE)/.linked
	cd $(STAGE) && $(BIN)/python -m tests.portability $(ARGUMENTS)

# An environment $(1) of the Python $(2). A system without ensurepip (Debian's python3 without python3-venv) may still
# have pip.
define environment
	@test -n "$(2)" || { echo "clfractal needs Python 3.11 or newer on the PATH" >&2; exit 2; }
	$(2) -m venv $(1) || { $(2) -m venv --clear --without-pip $(1) \
		&& $(2) -m pip --python $(1)/bin/python install --quiet pip; }
endef

$(VENV)/bin/python:
	$(call environment,$(VENV),$(PYTHON))

$(LINT)/bin/python:
	$(call environment,$(LINT),$(PYTHON))

$(LOWEST)/bin/python:
	$(call environment,$(LOWEST),$(OLDEST))

$(VENV)/.installed: $(SOURCES) | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check .
	@touch $@

$(VENV)/.viewer: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check '.[viewer]'
	@touch $@

$(VENV)/.tested-with: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check '.[test]'
	@touch $@

$(VENV)/.cluster: $(VENV)/.tested-with
	$(BIN)/python -m pip install --quiet --disable-pip-version-check '.[cluster]'
	@touch $@

$(VENV)/.mutates-with: $(VENV)/.tested-with
	$(BIN)/python -m pip install --quiet --disable-pip-version-check '.[mutate]'
	@touch $@

$(VENV)/.gpu-compilers: requirements-gpu.txt $(VENV)/.tested-with
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps -r requirements-gpu.txt
	@touch $@

$(LINT)/.installed: requirements-lint.txt | $(LINT)/bin/python
	$(LINT)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps -r requirements-lint.txt
	@touch $@

# pip has no way to ask for the lowest versions; uv has. What the program depends on comes before the program itself, and
# only as wheels: a version without one for this Python cannot be meant.
$(LOWEST)/.installed: $(SOURCES) | $(LOWEST)/bin/python
	$(LOWEST)/bin/python -m pip install --quiet --disable-pip-version-check 'uv>=0.5'
	$(LOWEST)/bin/uv pip compile --quiet --python $(LOWEST)/bin/python --resolution lowest-direct \
		--only-binary :all: --extra mesh --extra viewer --extra film --extra cluster --output-file $(LOWEST)/versions.txt pyproject.toml
	$(LOWEST)/bin/uv pip install --quiet --python $(LOWEST)/bin/python --only-binary :all: \
		--requirement $(LOWEST)/versions.txt
	$(LOWEST)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps .
	@touch $@

$(STAGE)/.linked: Makefile
	@rm -rf $(STAGE) && mkdir -p $(STAGE)
	@for name in $(STAGED); do ln -s $(CURDIR)/$$name $(STAGE)/$$name; done
	@touch $@

clean:
	rm -rf $(VENV) .venv .venv-* build out .mypy_cache .ruff_cache .pytest_cache .import_linter_cache

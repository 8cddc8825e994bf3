# Everything a newcomer or a build machine types. `make` alone lists it.
.DEFAULT_GOAL := help
.PHONY: help teleop demo test test-all test-versions check format docs bench bench-peers clients pictures gallery wheel clean

VENV := .venv
PY := $(VENV)/bin/python
PYTEST := $(PY) -m pytest
CLIENTS := $(notdir $(basename $(wildcard examples/clients/*.py)))
FAST := -m "not slow and not sweep and not browser and not peer"
export PYTHON

help: ## list the commands
	@awk -F ':.*## ' '/^[a-z-]+:.*## /{printf "  make %-14s %s\n", $$1, $$2}' Makefile

teleop: $(VENV)/.installed ## move a humanoid's hands in a web page (ARGS="--robots Panda")
	@$(PY) -m wbc_suite.cli teleop $(ARGS)

demo: $(VENV)/.installed ## the same without a browser: prints figures, writes pictures
	@$(PY) -m wbc_suite.cli demo $(ARGS)

test: $(VENV)/.installed-dev ## run the test suite
	$(PYTEST) -n auto --durations=20 -m "not sweep" $(ARGS)

test-all: $(VENV)/.installed-dev ## run every case, also of sweeps: about an hour
	$(PYTEST) -n auto --durations=20 $(ARGS)

test-versions: $(VENV)/.installed-dev ## fast tests with the lowest and the newest packages, and without JIT
	.ci/test-versions $(ARGS)

check: $(VENV)/.installed-dev ## format, lint, types, import direction, fast tests
	$(PY) -m ruff format --check .
	$(PY) -m ruff check .
	$(PY) -m pyright
	$(PYTEST) -q tests/test_imports.py
	$(PYTEST) -n auto $(FAST) $(ARGS)

format: $(VENV)/.installed-dev ## let ruff format and mend what it can
	$(PY) -m ruff format .
	$(PY) -m ruff check --fix .

docs: $(VENV)/.installed-dev ## build the documentation into artifacts/site, offline
	@NO_MKDOCS_2_WARNING=1 $(PY) -m mkdocs build --quiet
	@echo "Open artifacts/site/index.html"

bench: $(VENV)/.installed-dev ## run every benchmark: docs/benchmarks.md, artifacts/benchmarks (ARGS=--quick)
	$(PY) docs/write_benchmarks.py $(ARGS)

# Peers get environments of their own where they ask for other versions than ours.
bench-peers: $(VENV)/.installed-peers .venv-placo/.installed .venv-pybullet/.installed .venv-drake/.installed .venv-usd/.installed .venv-robosuite/.installed .venv-robosuite-demos/.installed .venv-cluster/.installed .venv-clients/.installed .venv-accelerators/.installed ## install what benchmarks and tests compare or work with

$(VENV)/.installed-peers: $(VENV)/.installed-dev
	$(PY) -m pip install --disable-pip-version-check --group peers
	@touch $@

.venv-%/.installed: benchmarks/peers/%.txt | $(VENV)/.python
	@test -x .venv-$*/bin/python || $(PY) -m venv --upgrade-deps .venv-$*
	.venv-$*/bin/python -m pip install --disable-pip-version-check -r $<
	test ! -f $(<:.txt=-no-deps.txt) || .venv-$*/bin/python -m pip install \
	  --disable-pip-version-check --no-deps -r $(<:.txt=-no-deps.txt)
	@touch $@

.venv-client-%/.installed: examples/clients/%.txt | $(VENV)/.python
	@test -x .venv-client-$*/bin/python || $(PY) -m venv --upgrade-deps .venv-client-$*
	.venv-client-$*/bin/python -m pip install --disable-pip-version-check -e . -r $<
	@touch $@

clients: $(CLIENTS:%=client-%) ## run the examples of examples/clients, each in an environment of its own

$(CLIENTS:%=client-%): client-%: .venv-client-%/.installed
	.venv-client-$*/bin/python examples/clients/$*.py

pictures: $(VENV)/.installed-dev ## draw the pictures and the film of the README and of walking anew (needs Chromium)
	$(PY) docs/draw_pictures.py
	$(PY) docs/draw_walking.py
	$(PY) docs/draw_teleop.py
	$(PY) docs/draw_film.py
	$(PY) docs/draw_saturation.py

gallery: $(VENV)/.installed ## draw every robot, gripper and base for the README, and every benchmark
	$(PY) docs/draw_gallery.py $(ARGS)
	$(PY) docs/draw_benchmarks.py $(ARGS)

wheel: $(VENV)/.installed ## build the wheel into dist/
	@rm -rf dist
	$(PY) -m pip wheel --quiet --no-deps --wheel-dir dist .

clean: ## remove what was built here
	rm -rf $(VENV) .venv-* dist build artifacts

# The environment is made anew when its Python is gone or too old, and completed
# when pyproject.toml is newer than the stamp, which is written last.
$(VENV)/.python: .ci/find-python
	@python=$$(.ci/find-python) || exit 1; \
	if $(PY) -c 'import sys, pip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then :; \
	else echo "Making $(VENV) with $$python"; "$$python" -m venv --clear $(VENV); fi
	@$(PY) -m pip install --quiet --disable-pip-version-check --upgrade "pip>=26.2.2" "setuptools>=78.1.1"
	@touch $@

$(VENV)/.installed: $(VENV)/.python pyproject.toml
	@echo "Installing wbc-suite into $(VENV): a minute or two and 1 GB of disk"
	@$(PY) -m pip install --disable-pip-version-check --editable .
	@touch $@

$(VENV)/.installed-dev: $(VENV)/.python pyproject.toml
	@echo "Installing wbc-suite and its tools into $(VENV): two minutes and 1.3 GB of disk"
	@$(PY) -m pip install --disable-pip-version-check --editable . --group dev
	@touch $(VENV)/.installed $@

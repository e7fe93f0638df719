# Needs only make and Python 3.11 (pybullet ships a wheel for it; see README for other versions).
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
TOOLS := $(VENV)/.tools

.PHONY: help run test test-slow check mutants docs wheel bench check-speed parity frozen clean
AGAINST ?= HEAD

help:
	@echo "make run    install, drive 20 deliveries with each of two stacks, print who earns more, write a page"
	@echo "make test   run the quick tests"
	@echo "make test-slow  run the tests that take some seconds each"
	@echo "make check  lint, types and import rules"
	@echo "make mutants  plant 200 small faults in each package and count those that the tests notice (hours)"
	@echo "make docs   build the documentation into site/"
	@echo "make wheel  build a wheel with compiled kernels into dist/"
	@echo "make bench  measure components, deliveries and where a simulated second goes"
	@echo "make check-speed AGAINST=HEAD  is the working tree slower than a commit, and are its rows the same?"
	@echo "make parity compare with recorded results of Nav2's own C++, case by case"
	@echo "make frozen drive what results/baseline lacks of the published rows in the default world"

$(READY): pyproject.toml constraints.txt
	@test -n "$(PYTHON)" || { echo "Python 3.11 or newer is needed: set PYTHON=/path/to/python3.11"; exit 1; }
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "Python 3.11 or newer is needed; $(PYTHON) is older: set PYTHON=/path/to/python3.11"; exit 1; }
	"$(PYTHON)" -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e .
	@touch $@

$(TOOLS): $(READY)
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@

run: $(READY)
	@$(BIN)/navbench run --stack nav2-gps-ekf --stack evasive-gps-ekf --episodes 20 --page

test: $(TOOLS)
	$(BIN)/pytest -m "not slow" -n auto --dist loadscope --no-loadscope-reorder

test-slow: $(TOOLS)
	$(BIN)/pytest -m slow -n auto --dist loadscope --no-loadscope-reorder

check: $(TOOLS)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

mutants: $(TOOLS)
	$(BIN)/python -m tools.mutants navstack
	$(BIN)/python -m tools.mutants harness/economics harness/world harness/statistics harness/storage harness/tuning

docs: $(TOOLS)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

wheel: $(TOOLS)
	$(BIN)/pip wheel --quiet --no-deps --no-build-isolation --wheel-dir dist .

bench: $(TOOLS)
	$(BIN)/python -m tools.bench

check-speed: $(TOOLS)
	$(BIN)/python -m tools.check_speed --against $(AGAINST) --rows 20

parity: $(TOOLS)
	$(BIN)/python -m tools.parity

frozen: $(TOOLS)
	$(BIN)/python -m tools.frozen_world

clean:
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache

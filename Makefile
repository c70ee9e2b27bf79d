# Everything runs in a virtual environment of its own; only Python and gcc have to be there.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
PIP := $(BIN)/python -m pip --disable-pip-version-check

.PHONY: demo test lint format benchmarks clean

$(READY): pyproject.toml constraints.txt
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(PIP) install --quiet --upgrade -c constraints.txt pip setuptools
	$(PIP) install --quiet -c constraints.txt torch
	$(PIP) install --quiet -c constraints.txt -e '.[hdf5,sweep,cluster,export,test]'
	touch $(READY)

## Train on one leg of a real thermal cycle, judge on another, and say which page to open.
demo: $(READY)
	$(BIN)/fogml demo --out demo-results

## The whole test suite.
test: $(READY)
	$(BIN)/python -m pytest -n 2 --dist loadfile

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(READY)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

## Accuracy, speed and memory beside other ways; writes experiments/benchmarks/results.* and scale.md
benchmarks: $(READY)
	$(BIN)/python -m experiments.benchmarks

clean:
	rm -rf $(VENV) build dist *.egg-info demo-results

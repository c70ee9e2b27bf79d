# Everything runs in a virtual environment of its own; only Python and gcc have to be there.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
# All that the tests use but 'dataflash': its package unpacks to 93 MB, most of the time of an installation.
EXTRAS := xlsx,tdms,mdf,ulog,ros,mcap,miniseed,sweep,cluster,export,test
# Two workers share two cores: threads of their own would wait for each other. What tests start is compiled once.
TESTED := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 PYTHONDONTWRITEBYTECODE=
INSTALL := $(BIN)/python -m pip --disable-pip-version-check install --quiet -c constraints.txt

.PHONY: demo test oldest newest docs lint format benchmarks clean

$(READY): pyproject.toml constraints.txt
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(INSTALL) --upgrade pip setuptools
	$(INSTALL) torch
	$(INSTALL) -e '.[$(EXTRAS)]'
	touch $(READY)

$(VENV)/.docs: $(READY)
	$(INSTALL) -e '.[docs]'
	touch $@

## Train on one leg of a real thermal cycle, judge on another, and say which page to open.
demo: $(READY)
	$(BIN)/fogml demo --out demo-results

## The whole test suite.
test: $(READY)
	$(TESTED) $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder

## The suite with the oldest versions that pyproject.toml allows, and with the newest there are; each in a virtual
## environment of its own. PYTHON=python3.13 takes another Python.
oldest newest:
	test -x .venv-$@/bin/python || $(PYTHON) -m venv .venv-$@
	if [ $@ = oldest ]; then $(PYTHON) .ci/oldest.py > .venv-$@/constraints.txt; else : > .venv-$@/constraints.txt; fi
	.venv-$@/bin/python -m pip install --quiet --upgrade -c .venv-$@/constraints.txt -e '.[readers,export,sweep,cluster,test]'
	$(TESTED) .venv-$@/bin/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder

## The documentation as a site and as a zip, warnings as errors; both work without a network.
docs: $(VENV)/.docs
	$(BIN)/python -m sphinx -W --keep-going -q -j auto -d docs/_build/doctrees docs docs/_build/fogml-docs
	cd docs/_build && ../../$(BIN)/python -m zipfile -c fogml-docs.zip fogml-docs
	@echo "Open docs/_build/fogml-docs/index.html in a browser; docs/_build/fogml-docs.zip holds the same."

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
	rm -rf $(VENV) .venv-oldest .venv-newest build dist *.egg-info demo-results docs/_build

# make demo: set up and run the main job on the packaged data, ending in reports/demo/report.pdf
# make test: set up and run the tests
# make lint: style (ruff) and types (mypy); no error is let through
# make versions: the wheel with lowest and newest dependencies under Python 3.11 and 3.13 (a quarter of an hour)
# make docs: set up and build the documentation into build/docs; a warning is an error
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
export OPENBLAS_NUM_THREADS := 1
export MPLBACKEND := Agg

.PHONY: demo test docs lint versions clean

demo: $(VENV)/demo
	$(BIN)/backdrive-bayes demo
	cp reports/demo/reducer-1/figures/loop-2.png reports/demo/loop.png

test: $(VENV)/test
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder

docs: $(VENV)/test
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs build/docs

lint: $(VENV)/test
	$(BIN)/python -m pip install --quiet ruff mypy pandas-stubs scipy-stubs
	$(BIN)/ruff check .
	$(BIN)/mypy

versions: $(VENV)/test
	$(BIN)/python studies/versions.py --out reports/versions

define set_up
	$(PYTHON) -c 'import sys; assert sys.version_info >= (3, 11), "Python 3.11 or newer is needed: make PYTHON=python3.11"'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable '.[$(1)]'
	touch $@
endef

$(VENV)/demo: pyproject.toml
	$(call set_up,demo)

$(VENV)/test: pyproject.toml
	$(call set_up,test)

clean:
	rm -rf $(VENV) build *.egg-info

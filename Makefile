# Every target makes the environment it needs; nothing is done twice.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: demo test test-slow check lint types imports bench pictures clean

demo: $(READY)
	$(BIN)/sdt demo --out analysis/demo

test: $(READY)
	$(BIN)/python -m pytest -n 2 --dist loadgroup -m "not slow" --ignore=tests/bench

test-slow: $(READY)
	$(BIN)/python -m pytest -m slow

check: lint types imports test

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(READY)
	$(BIN)/mypy

imports: $(READY)
	$(BIN)/lint-imports

bench: $(READY)
	$(BIN)/python -m pytest tests/bench --benchmark-enable --benchmark-only -q --jaxtyping-packages= -p no:xdist

pictures: demo
	PYTHONPATH=tests/e2e $(BIN)/python tests/e2e/take_pictures.py analysis/demo/model/follow-0

$(READY): pyproject.toml constraints.txt
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable ".[dev]"
	touch $@

clean:
	rm -rf $(VENV) .mypy_cache .pytest_cache .ruff_cache .import_linter_cache *.egg-info

# Each target makes .venv from requirements.lock first, if it is not there or older than the lock.
PYTHON ?= $(shell for p in python3.11 python3.12 python3; do \
	$$p -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 12))' 2>/dev/null \
	&& echo $$p && break; done)
VENV := .venv
BIN := $(VENV)/bin
# One numerics thread a process: several processes share the cores.
export OPENBLAS_NUM_THREADS := 1

.PHONY: demo serve test check bench reproduce blind browser clean

demo: $(VENV)/installed
	$(BIN)/robocal demo

serve: $(VENV)/installed
	$(BIN)/robocal serve

test: $(VENV)/installed browser
	$(BIN)/python -m pytest

check: $(VENV)/installed browser
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache
	$(BIN)/python -m pytest

bench: $(VENV)/installed
	$(BIN)/python -m tests.benchmarks

# The published experiments again, our figures beside the printed ones.
reproduce: $(VENV)/installed
	$(BIN)/robocal reproduce

# Hides effects in emulated campaigns and counts what diagnosis finds; BLIND="--trials 20 --kind one".
blind: $(VENV)/installed
	$(BIN)/python -m tests.blind $(BLIND)

$(VENV)/installed: requirements.lock pyproject.toml
	@test -n "$(PYTHON)" || { echo "robocal needs CPython 3.11 or 3.12; install one of them"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps -e .
	@touch $@

# The page's tests drive Debian's Chromium; installed where that is allowed, else said in one line.
browser:
	@command -v chromium >/dev/null 2>&1 \
	|| { [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1 \
	     && { apt-get update -qq && apt-get install -qq -y chromium >/dev/null; } 2>/dev/null; } \
	|| echo "the page's tests are skipped: install chromium (apt-get install chromium)"

clean:
	rm -rf $(VENV) build *.egg-info .mypy_cache .ruff_cache .pytest_cache

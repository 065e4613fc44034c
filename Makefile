# Each target makes .venv from requirements.lock first, if it is not there or older than the lock.
PYTHON ?= $(shell for p in python3.11 python3.12 python3; do \
	$$p -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 12))' 2>/dev/null \
	&& echo $$p && break; done)
VENV := .venv
BIN := $(VENV)/bin
# One numerics thread a process: several processes share the cores.
export OPENBLAS_NUM_THREADS := 1

.PHONY: demo serve test pictures check bench reproduce blind cells cuts faults stops soak browser clean

demo: $(VENV)/installed
	$(BIN)/robocal demo

serve: $(VENV)/installed
	$(BIN)/robocal serve

test: $(VENV)/installed browser
	$(BIN)/python -m pytest -n 3 --dist loadfile

# The pictures of README, taken by the tests of the pages.
pictures: $(VENV)/installed browser
	ROBOCAL_SCREENSHOTS=1 $(BIN)/python -m pytest tests/acceptance -k page

check: $(VENV)/installed browser
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache
	$(BIN)/python -m pytest -n 3 --dist loadfile

bench: $(VENV)/installed
	$(BIN)/python -m tests.benchmarks

# The published experiments again, our figures beside the printed ones.
reproduce: $(VENV)/installed
	$(BIN)/robocal reproduce

# Hides effects in emulated campaigns and counts what diagnosis finds; BLIND="--trials 20 --kind one".
blind: $(VENV)/installed
	$(BIN)/python -m tests.blind $(BLIND)

# 300 campaigns on 20 emulated cells, workers killed on the way; CELLS="--campaigns 30 --cells 4".
cells: $(VENV)/installed
	$(BIN)/python -m tests.studies.many_cells $(CELLS)

# kill -9 of everything, 50 times during one campaign; CUTS="--cuts 5".
cuts: $(VENV)/installed
	$(BIN)/python -m tests.studies.power_cuts $(CUTS)

# Every fault of every device in the middle of a campaign; FAULTS="--device geocom --fault silence".
faults: $(VENV)/installed
	$(BIN)/python -m tests.studies.faults $(FAULTS)

# A day of campaigns in compressed time, then a look for what was left; SOAK="--hours 2".
soak: $(VENV)/installed
	$(BIN)/python -m tests.studies.soak $(SOAK)

# How soon the arm stands still after every loss of control; STOPS="--moments 20 --speed 30".
stops: $(VENV)/installed
	$(BIN)/python -m tests.studies.stops $(STOPS)

$(VENV)/installed: requirements.lock pyproject.toml
	@test -n "$(PYTHON)" || { echo "robocal needs CPython 3.11 or 3.12; install one of them"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps -e .
	@touch $@

# The page's tests drive Debian's Chromium, PDF needs Pango, and the guide curl and jq; installed where
# that is allowed, else said in one line.
browser:
	@{ command -v chromium >/dev/null 2>&1 && ldconfig -p | grep -q libpangoft2 \
	   && command -v curl >/dev/null 2>&1 && command -v jq >/dev/null 2>&1; } \
	|| { [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1 \
	     && { apt-get update -qq && apt-get install -qq -y chromium libpangoft2-1.0-0 curl jq >/dev/null; } 2>/dev/null; } \
	|| echo "tests of the page, of PDF or of the guide are skipped: apt-get install chromium libpangoft2-1.0-0 curl jq"

clean:
	rm -rf $(VENV) build *.egg-info .mypy_cache .ruff_cache .pytest_cache

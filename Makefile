# make demo: see it work. make test: everything that a change must pass. Both set themselves up in .venv, from a bare
# checkout; they need python3 (3.11 or later), python3-venv and make.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/.installed
TESTS  := $(VENV)/.tests
NODE   := tests/clients/node/node_modules
PIP    := $(BIN)/pip install --quiet --disable-pip-version-check

.PHONY: demo test check pytest test-vm bench soak accuracy accuracy-docs long judge golden golden-update config install uninstall clean

# More options: make demo DEMO="--scenario pinch --to 192.168.0.7:3333"
demo: $(STAMP)
	@$(BIN)/touchd demo $(DEMO)

test: check pytest

check: $(TESTS)
	$(BIN)/ruff check touchd tests
	$(BIN)/ruff format --check touchd tests
	$(BIN)/mypy
	$(BIN)/lint-imports

pytest: $(TESTS) $(NODE)
	$(BIN)/python -m pytest --numprocesses 2 --dist loadfile --durations 20

# The service in a Debian of its own, as root, in two minutes, the first time in three. They share one machine, in this
# order; by their names a plain pytest run leaves them alone.
test-vm: $(TESTS)
	$(BIN)/python -m pytest $(addprefix tests/vm/,check_service.py check_sandbox.py check_removal.py)

bench: $(STAMP)
	$(BIN)/touchd bench

# The touch methods on simulated scenes; for a quick look: make accuracy ACCURACY="--scenes taps --seeds 1"
accuracy: $(STAMP)
	$(BIN)/touchd bench accuracy $(ACCURACY)

# All scenes but the long ones with five seeds, which takes more than an hour, and then the tables and pictures of docs/accuracy.md from them. A run that was
# broken off goes on; empty .cache/accuracy after a change of the code.
accuracy-docs: $(STAMP)
	$(BIN)/touchd bench accuracy --jobs 2 --heights 750,1500 --seeds 301-305 --keep .cache/accuracy --json > .cache/accuracy.json
	$(BIN)/python -m touchd.lab.report docs .cache/accuracy.json

# The scenes of ten minutes, with one seed: a quarter of an hour. One of them: make long LONG="--scenes held --heights 750"
long: $(STAMP)
	$(BIN)/touchd bench accuracy --jobs 2 --scenes drift-long,held --methods fingertip --heights 750,1500 --seeds 101 $(LONG)

# Teaches touchd's judge of fingertips and its beliefs anew, which takes five hours; a run that was broken off goes on.
judge: $(STAMP)
	$(BIN)/python -m touchd.lab.learn judge beliefs more --keep .cache/learn

# make golden RECORDING=FOLDER turns a recording into a test; FOLDER/golden.yaml names camera, place, what must happen.
golden: $(TESTS)
	PYTHONPATH=tests $(BIN)/python -m golden.make $(RECORDING)
golden-update: $(TESTS)
	PYTHONPATH=tests $(BIN)/python -m golden.make --update

# 24 h of frames through the daemon in half an hour. A shorter day: make soak SOAK="--minutes 60 --sample-minutes 10"
soak: $(TESTS)
	PYTHONPATH=tests $(BIN)/python -m soak $(SOAK)

# Writes config/touchd.yaml and config/touchd.schema.json anew from the schema in the code.
config: $(STAMP)
	$(BIN)/python -m touchd.config.document config

# As root. Both take PREFIX (/opt/touchd) and DESTDIR, install takes PYTHON (/usr/bin/python3 unless it is given).
install uninstall: export PYTHON := $(if $(filter file,$(origin PYTHON)),/usr/bin/python3,$(PYTHON))
install uninstall: export PREFIX := $(or $(PREFIX),/opt/touchd)
install uninstall: export DESTDIR := $(DESTDIR)
install:
	@systemd/install.sh
uninstall:
	@systemd/uninstall.sh

$(STAMP): pyproject.toml
	@command -v $(PYTHON) >/dev/null || { echo "make: $(PYTHON) is missing: apt-get install python3 python3-venv" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "make: $$($(PYTHON) --version) is too old, touchd needs Python 3.11 or later: name one with make PYTHON=python3.11" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo "make: this Python cannot make virtual environments: apt-get install python3-venv" >&2; exit 1; }
	$(PYTHON) -m venv --clear $(VENV)
	$(PIP) --editable .
	@touch $@

$(TESTS): $(STAMP)
	$(PIP) --editable '.[test]'
	@touch $@

# Without npm the tests of its TUIO client are skipped, and say what to install.
$(NODE): tests/clients/node/package-lock.json
	@if command -v npm >/dev/null; then cd $(dir $(NODE)) && npm ci --silent --no-fund --no-audit && touch node_modules; fi

clean:
	rm -rf $(VENV) $(NODE) .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache dist build

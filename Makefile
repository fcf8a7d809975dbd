# Needs make and Python 3.11 or newer; everything else is fetched into .venv.

PYTHON ?= $(shell for name in python3 python3.13 python3.12 python3.11 python; do \
	command -v $$name >/dev/null 2>&1 || continue; \
	$$name -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && { echo $$name; break; }; done)
VENV := .venv
RUN := $(VENV)/bin/python
INSTALLED := $(VENV)/.installed
READY := $(VENV)/.ready
SYSTEM_PACKAGES := libgl1 libegl1 libx11-6 libxrender1

PEERS := .peers
PEER_SYSTEM_PACKAGES := cloudcompare libgl1 libgomp1 libusb-1.0-0

.PHONY: help demo test check lint bench-accuracy bench-peers bench-io bench-programs peers clean distclean

help:
	@echo 'make demo       correct the porthole sample: program, pictures and report in out/porthole'
	@echo 'make test       run all tests'
	@echo 'make lint       ruff and mypy'
	@echo 'make check      lint, then test'
	@echo 'make bench-accuracy  measure every method on every case: docs/accuracy.md and its picture'
	@echo 'make bench-peers     the same with other libraries beside them, which make peers installs'
	@echo 'make bench-io   measure how fast scans and programs are read, each against the plainest way'
	@echo 'make bench-programs  measure how fast programs are written by every postprocessor, and in how much memory'
	@echo 'make clean      remove what these commands made; distclean removes .venv too'

demo: $(READY)
	$(VENV)/bin/sicp-cam correct samples/porthole/job.toml --out out/porthole --force

test: $(READY)
	OMP_NUM_THREADS=1 $(RUN) -m pytest -n auto --dist loadfile --doctest-modules sicp_cam formats postprocessors tests

lint: $(INSTALLED)
	$(RUN) -m ruff check .
	$(RUN) -m ruff format --check .
	$(RUN) -m mypy

check: lint test

bench-accuracy: $(INSTALLED)
	$(RUN) benchmarks/accuracy.py --docs docs

bench-peers: $(INSTALLED) peers
	$(RUN) benchmarks/accuracy.py --peers --docs docs

bench-io: $(INSTALLED)
	OMP_NUM_THREADS=1 $(RUN) benchmarks/io.py

bench-programs: $(INSTALLED)
	OMP_NUM_THREADS=1 $(RUN) benchmarks/programs.py

peers: $(PEERS)/.installed

clean:
	rm -rf out build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -not -path './$(VENV)/*' -not -path './$(PEERS)/*' -prune -exec rm -rf {} +

distclean: clean
	rm -rf $(VENV) $(PEERS) sicp_cam.egg-info

$(INSTALLED): pyproject.toml
	@test -n '$(PYTHON)' || { echo 'Python 3.11 or newer is needed: install it, or name it with make PYTHON=FILE' >&2; exit 1; }
	@test -x $(RUN) || $(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); \
		echo 'Python has no venv: on Debian or Ubuntu run apt-get install python3-venv, then make again' >&2; exit 1; }
	$(RUN) -m pip install --disable-pip-version-check --quiet --editable '.[dev]'
	@touch $@

# The CAD kernel and the pictures need OpenGL libraries of the system. Where they cannot be installed from here, one line
# says which are missing, and what does without them still runs.
$(READY): $(INSTALLED)
	@if $(RUN) -m sicp_cam doctor --quiet; then touch $@; exit 0; fi; \
	if command -v apt-get >/dev/null 2>&1 && [ "$$(id -u)" = 0 ]; then as_root=; \
	elif command -v apt-get >/dev/null 2>&1 && sudo -n true 2>/dev/null; then as_root='sudo -n'; \
	else echo 'install the packages $(SYSTEM_PACKAGES) (their Debian names) as root, then run make again' >&2; exit 0; fi; \
	$$as_root apt-get update -qq; \
	$$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $(SYSTEM_PACKAGES); \
	if $(RUN) -m sicp_cam doctor --quiet; then touch $@; fi

# Other libraries for the benchmark, in an environment of their own; the product needs none of them.
$(PEERS)/.installed: benchmarks/peers/requirements.txt
	@test -n '$(PYTHON)' || { echo 'Python 3.11 or newer is needed: install it, or name it with make PYTHON=FILE' >&2; exit 1; }
	@test -x $(PEERS)/bin/python || $(PYTHON) -m venv $(PEERS)
	$(PEERS)/bin/python -m pip install --disable-pip-version-check --quiet --requirement benchmarks/peers/requirements.txt
	@command -v CloudCompare >/dev/null 2>&1 && $(PEERS)/bin/python -c 'import open3d' 2>/dev/null || \
		echo 'CloudCompare, or a library that Open3D loads, is missing and will be listed as not measured:' \
		'install $(PEER_SYSTEM_PACKAGES) (their Debian names) as root' >&2
	@touch $@

# Every command of the project, by hand and in CI. `make help` lists them.

VENV := .venv
BIN := $(VENV)/bin
# What flying needs, and beside it what development needs: a first flight does not wait for the second.
FLY := $(VENV)/.installed
DEVELOP := $(VENV)/.installed-dev
MINUTES ?= 10

# The first interpreter that is new enough and able to build an environment (Debian ships python3
# without ensurepip). Name one yourself with: make PYTHON=/path/to/python
PYTHON ?= $(shell for candidate in python3.11 python3.12 python3.13 python3.14 python3; do \
	if $$candidate -c 'import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 11))' \
	>/dev/null 2>&1; then echo $$candidate; break; fi; done)

.DEFAULT_GOAL := help
.PHONY: help demo test check bench soak docs reference pyodide chromium emulators screenshots clean

help: ## list the targets
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /|/' \
	| awk -F'|' '{ printf "  make %-11s %s\n", $$1, $$2 }'

demo: $(FLY) ## fly: both processes on this machine, the plant simulated
	$(BIN)/tenbaud demo

# Most tests wait for their processes half of the time: five at once keep two cores busy. What is said
# about the times of a flight comes after them, two at once; what needs both cores sees to it itself.
# The project's own rules are part of `make check`.
test: chromium emulators pyodide $(DEVELOP) ## run the tests: most of them first, then those of times on the real clock
	$(BIN)/python -m pytest -n 5 -m "not soak and not real_time" --ignore tests/rules
	$(BIN)/python -m pytest -n 2 -m "not soak and real_time" $$(grep -rl --include='test_*.py' real_time tests)

check: $(DEVELOP) ## lint, format, types, and the project's own rules
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m pytest tests/rules

bench: $(DEVELOP) ## measure speed, and write bench.json
	$(BIN)/python -m benchmarks

soak: $(DEVELOP) ## fly seeds under faults for MINUTES=n (10) into soak.json, then the long tests
	$(BIN)/python -m tests.simulation.soak --minutes $(MINUTES)
	MINUTES=$(MINUTES) $(BIN)/python -m pytest -m soak

# The page's tests drive Debian's Chromium; where it is missing and cannot be installed, they skip.
chromium: ## install Debian's Chromium if it is missing and this is root's machine to change
	@command -v chromium >/dev/null 2>&1 || { \
		test "$$(id -u)" = 0 && command -v apt-get >/dev/null 2>&1 && \
		apt-get -qq update && apt-get -qq install --yes --no-install-recommends chromium; } || \
		echo "no Chromium and no way to install it here: the tests of the page will skip" >&2

# The sensor node in C is compiled for this machine and for a Cortex-M3 that QEMU emulates, and the bits of the
# codec are compared with those of other processors: a minute and 1.1 GB, nearly all of it the compilers.
EMULATORS := gcc arm-none-eabi-gcc qemu-system-arm aarch64-linux-gnu-gcc qemu-aarch64
EMULATOR_PACKAGES := gcc gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm \
	gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user

emulators: .cache/aarch64 ## install Debian's compilers and QEMU if they are missing and this is root's machine to change
	@for one in $(EMULATORS); do command -v $$one >/dev/null 2>&1 || missing=$$one; done; test -z "$$missing" || { \
		test "$$(id -u)" = 0 && command -v apt-get >/dev/null 2>&1 && \
		apt-get -qq update && apt-get -qq install --yes --no-install-recommends $(EMULATOR_PACKAGES); } || \
		echo "no way to install $(EMULATOR_PACKAGES) here: tests of the node in C will skip" >&2

.cache/aarch64:
	@mkdir -p .cache
	@command -v apt-get >/dev/null 2>&1 && benchmarks/bits/fetch_python.sh $@ || \
		echo "no way to fetch Debian's Python for aarch64 here: its test will skip" >&2

# It takes about ten minutes, most of them in Python on the emulated processor.
.PHONY: bits
bits: emulators pyodide $(DEVELOP) ## compare the codec's bits on every processor that this machine has or emulates
	$(BIN)/python -m benchmarks.bits

screenshots: $(DEVELOP) ## fly with the live page, and make its pictures in docs/figures
	$(BIN)/python -m benchmarks.screenshots

# Material for MkDocs advertises its successor at every start; nothing else is silenced.
docs: reference pyodide ## build the documentation into site/, strictly
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet
	@echo "written to site/; read it: $(BIN)/python -m http.server --directory site --bind 127.0.0.1"

# Python for the page on which both ends fly in the browser: 14 MB by npm, versions and digests in its lock.
PYODIDE := .cache/pyodide

pyodide: ## get Pyodide for the flight in the browser, if npm is here
	@command -v npm >/dev/null 2>&1 && \
		mkdir -p $(PYODIDE) && cp docs/browser/package.json docs/browser/package-lock.json $(PYODIDE) && \
		{ test -f $(PYODIDE)/node_modules/pyodide/pyodide.asm.wasm && \
		cmp -s $(PYODIDE)/package-lock.json $(PYODIDE)/.installed || \
		npm ci --prefix $(PYODIDE) --ignore-scripts --no-audit --no-fund --silent && \
		cp $(PYODIDE)/package-lock.json $(PYODIDE)/.installed; } || \
		echo "npm could not get Pyodide: the flight in the browser is left out, and its test will skip" >&2

reference: $(DEVELOP) ## write the pages in docs/reference that follow from the code
	$(BIN)/python docs/tools/reference.py

clean: ## remove the environment and everything that was generated
	rm -rf $(VENV) $(PYODIDE) runs dist site bench.json soak.json .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
	rm -rf .cache/aarch64

# The environment is brought up to date whenever pyproject.toml changes. Without --no-compile pip
# compiles every module of every package, most of which no flight ever imports.
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --editable

$(FLY): pyproject.toml
	@test -n "$(PYTHON)" || { \
		echo "tenbaud needs Python 3.11 or newer with venv and ensurepip; none was found on PATH." >&2; \
		echo "Install one (Debian: python3 and python3-venv) or name it: make PYTHON=/path/to/python" >&2; \
		exit 1; }
	@echo "installing what flying needs into $(VENV), the first time only: a minute, or several on a slow network"
	@test -x $(BIN)/python || "$(PYTHON)" -m venv $(VENV)
	@$(INSTALL) .
	@touch $@

$(DEVELOP): $(FLY)
	@echo "installing what the tests need beside it, the first time only: several minutes"
	@$(INSTALL) '.[dev]'
	@touch $@

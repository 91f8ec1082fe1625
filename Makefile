# Everything that is done with this tree. Needs Python 3.11 or newer, git and make; all else is set up in .venv.
#
#   make play         the web page, over the twin; its address is printed where no browser opens
#   make test         lint, types, layers, the page's tests, tests, coverage
#   make lint         the first three alone
#   make page         the web page, where web/ has changed
#   make types        what the page knows of the server, where its topics or commands have changed
#   make bench        the measurements, as tables
#   make screenshots  pictures of the page, in docs/images/web
#   make soak         the long runs
#   make docs         the documentation, in site/
#   make setup        the virtual environment alone

VENV := .venv
BIN := $(VENV)/bin
ARGS ?=
# Python keeps what it has compiled, whatever the environment wishes: programs start in half the time so.
export PYTHONDONTWRITEBYTECODE :=
WORKERS ?= auto
BENCHES ?= motion twin
GATED := core game motion robots
LEAST_COVERAGE := 95
# To trace lines makes tests half as slow again: those that the gate is about are run first, the others untraced.
GATED_TESTS := tests/contract $(GATED:%=tests/unit/%)
PYTEST := $(BIN)/python -m pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder

SETUP := tools/setup.sh requirements/build.txt pyproject.toml hatch_build.py

.DEFAULT_GOAL := help
.PHONY: help setup play page types web-test browser test lint bench soak screenshots docs lock clean

help:
	@sed -n '2,/^$$/s/^# \{0,1\}//p' Makefile

setup: $(VENV)/.dev

# A development environment can also play.
$(VENV)/.dev: $(SETUP) requirements/dev.txt
	@sh tools/setup.sh dev
	@touch $(VENV)/.run $@

$(VENV)/.run: $(SETUP) requirements/run.txt
	@sh tools/setup.sh run
	@touch $@

# Costs nothing while the page is as web/ has it: the script compares their contents.
page: $(VENV)/.run
	@$(BIN)/python hatch_build.py

types: setup
	@$(BIN)/python -m kempelen.server.schema > web/openapi.json
	@$(BIN)/python hatch_build.py types

web-test: setup page
	@$(BIN)/python hatch_build.py check-types check size test

play: page
	@$(BIN)/kempelen serve $(ARGS)

# The tests in a browser skip themselves where there is none.
browser:
	@sh tools/browser.sh

test: lint page web-test browser
	$(PYTEST) $(GATED_TESTS) --cov --cov-report= $(ARGS)
	@for part in $(GATED); do \
		echo "Lines of $$part covered (at least $(LEAST_COVERAGE) %):"; \
		$(BIN)/coverage report --skip-covered --show-missing --include="src/kempelen/$$part/*" \
			--fail-under=$(LEAST_COVERAGE) || exit 1; \
	done
	$(PYTEST) $(GATED_TESTS:%=--ignore=%) $(ARGS)

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo

bench: setup
	@for name in $(BENCHES); do $(BIN)/kempelen bench $$name $(ARGS) || exit 1; done

screenshots: page browser setup
	$(BIN)/python tools/screenshots.py $(ARGS)

soak: setup
	$(BIN)/python -m pytest -m soak --timeout 0 $(ARGS)

docs: setup
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "Open site/index.html"

# Pins the newest versions that pyproject.toml allows; needs uv.
lock: setup
	@for job in "run:pyproject.toml" "dev:pyproject.toml --group dev --extra docs" "build:requirements/build.in"; do \
		$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url \
			--no-header --upgrade $${job#*:} -o requirements/$${job%%:*}.txt || exit 1; \
	done

clean:
	rm -rf $(VENV) web/node_modules src/kempelen/server/page site build dist .coverage* .mypy_cache .pytest_cache .ruff_cache .import_linter_cache

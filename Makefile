# `make demo` shows what it does, `make reproduce` makes every result, `make test` runs the tests.
# Every target creates .venv with the tested versions first, where it is missing or out of date.

PYTHON ?= python3
CORES ?= 2
VENV := .venv
INSTALLED := $(VENV)/.installed

.PHONY: reproduce demo model test claims trust package docs bench pictures lint clean help

reproduce: $(INSTALLED)  ## every result: those of the tool, and the main comparison of the thesis
	$(VENV)/bin/snakemake --cores $(CORES)
	$(VENV)/bin/snakemake --cores $(CORES) --configfile config/full.yaml config/main.yaml

demo: $(INSTALLED)  ## a survey, its tower map and a report in minutes, under results/demo/
	$(VENV)/bin/snakemake --cores $(CORES) --configfile config/demo.yaml -- results/demo/report/index.html
	@echo "open results/demo/predict/unseen/unseen.html: the tower map"
	@echo "open results/demo/report/index.html: the report"

model: $(INSTALLED)  ## train the models that come with the package again, and put them in
	$(VENV)/bin/snakemake --cores $(CORES) -- results/packaged/towers.json results/packaged/wires.json
	cp $(foreach name,towers wires,results/packaged/$(name).json results/packaged/$(name).md) \
	  scenenet/models/packaged/

test: $(INSTALLED)  ## the tests
	$(VENV)/bin/python -m pytest -n $(CORES) --no-loadscope-reorder

claims: $(INSTALLED)  ## compare every figure in README and docs with the results of its run
	$(VENV)/bin/python tools/doc_figures.py

trust: $(INSTALLED)  ## try to lose something: damaged files, kills, full disks; a table of what was lost
	PYTHONPATH=tests $(VENV)/bin/python -m trust

package: $(INSTALLED)  ## build the package, install it in a fresh environment and predict with it
	$(VENV)/bin/python -m pytest -m packaging

docs: $(INSTALLED)  ## the documentation as a site, under site/; a broken link is an error
	NO_MKDOCS_2_WARNING=1 $(VENV)/bin/mkdocs build --strict

bench: $(INSTALLED)  ## speed of the convolution compared with alternative implementations
	$(VENV)/bin/scenenet bench

pictures: $(INSTALLED)  ## take docs/images again from the results of make reproduce; needs Chromium
	$(VENV)/bin/python tools/doc_pictures.py

lint: $(INSTALLED)  ## style, types, formatting, order of the packages
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy
	$(VENV)/bin/lint-imports
	$(VENV)/bin/snakefmt --check Snakefile workflow

clean:  ## remove what Python and the tools leave behind; results stay
	rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis site build
	find scenenet workflow tests -name __pycache__ -prune -exec rm -rf {} +

help:  ## this list
	@sed -n 's/^\([a-z]*\):.*## /\1\t/p' $(MAKEFILE_LIST)

$(INSTALLED): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "scenenet needs Python 3.11 or later; name one with: make PYTHON=python3.12"; exit 1; }
	@$(PYTHON) -c 'import ensurepip' 2>/dev/null || \
	  { echo "Python's venv is not installed; on Debian or Ubuntu: apt install python3-venv"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check --no-compile \
	  -c constraints.txt -e '.[dev]'
	@# pip would compile the 17 000 modules on one core. Nothing imports their tests. A few are for
	@# other versions of Python.
	$(VENV)/bin/python -m compileall -qq -j $(CORES) -x '/(tests?|testing)/' $(VENV)/lib || true
	touch $@

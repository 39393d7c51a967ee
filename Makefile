# `make` lists what there is.
PYTHON ?= python3
VENV ?= .venv
BIN = $(VENV)/bin
READY = $(VENV)/.ready
READY_DEV = $(VENV)/.ready-dev
unexport PYTHONDONTWRITEBYTECODE  # without bytecode, each of the thousand processes of the tests compiles what it imports

.PHONY: help demo test nightly lint docs site words size bench clean attack mutants lowest pythons wheel hashes sbom audit

help: ## list the targets
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 8

demo: $(READY) ## set up (with the solver NGSolve), and build two triangular sensors: one to change, one to print
	$(BIN)/sensorgen build tri --dielectric 0.2 || test $$? = 1  # 1: the checks have findings of severity error
	$(BIN)/sensorgen build docs/locates-tri.yaml --no-cad

test: $(READY_DEV) ## set up, with slicers, ngspice and Chromium where apt may, and run all tests
	scripts/system-packages --programs
	scripts/debian13-slicers
	$(BIN)/python -m pytest -m "kernel and not nightly" tests/geometry $(ARGS) >$(VENV)/kernel.txt 2>&1 & kernel=$$!; \
		$(BIN)/python -m pytest -n 3 --dist loadfile --no-loadscope-reorder $(ARGS); code=$$?; \
		wait $$kernel || code=1; cat $(VENV)/kernel.txt; exit $$code

nightly: $(READY_DEV) ## the tests that guard more of the same, kills and attacks among them, then the coverage of intervals; hours
	scripts/system-packages --programs
	scripts/debian13-slicers
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder -m "nightly and not kernel" $(ARGS)
	$(BIN)/python -m pytest -m "nightly and kernel" tests/geometry $(ARGS)
	$(BIN)/python bench/coverage.py
	$(MAKE) attack sbom audit

lint: $(READY_DEV) ## style, types, which module may import which, and the lines of budget.tsv
	$(BIN)/ruff format --check conftest.py src tests bench docs scripts
	$(BIN)/ruff check conftest.py src tests bench docs scripts
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache
	$(BIN)/python scripts/size.py --check

docs: $(READY_DEV) ## write docs/reference.md from the --help texts, and the pictures of README and docs
	$(BIN)/python docs/generate.py
	$(BIN)/python docs/validation.py
	$(BIN)/python docs/pictures.py
	$(BIN)/python docs/screenshot.py

site: $(READY_DEV) ## build the documentation as a site that works offline, out/site/index.html; a broken link fails
	$(BIN)/sphinx-build -q -W --keep-going -c docs . out/site

words: $(READY_DEV) ## list words that docs/words.yaml has retired, with file, line and the better word
	$(BIN)/python scripts/words.py $(ARGS)

size: $(READY_DEV) ## print the size of the code beside its lines in budget.tsv; ARGS=--lower lowers them
	@$(BIN)/python scripts/size.py $(ARGS)

bench: $(READY_DEV) ## measure speed, memory and accuracy; write bench/results
	set -e; for program in bench/*.py; do $(BIN)/python $$program; done

attack: $(READY_DEV) ## feed 10 000 damaged files of each kind to every reader, in 2 GB; takes hours
	$(BIN)/python tests/attacks/fuzz.py $(ARGS)
	SENSORGEN_ATTACK=1 $(BIN)/python -m pytest -q tests/attacks/test_log.py
	$(BIN)/python bench/attacks.py

mutants: $(READY_DEV) ## plant 60 faults one at a time, run the tests that guard against each; write bench/results/mutants.md
	$(BIN)/python scripts/mutants.py $(ARGS)

lowest: ## install the lowest versions that pyproject.toml allows in a fresh environment, and run every command there
	scripts/clean-environment "$(PYTHON)" lowest-direct $(ARGS)

pythons: ## install the newest versions in fresh environments of Python 3.11 to 3.13 (of the system, pyenv or uv), and run every command
	set -e; for version in 3.11 3.12 3.13; do scripts/clean-environment python$$version highest; done

wheel: $(READY_DEV) ## build the wheel twice, compare the bytes, and run every command from it in a fresh environment of hashed files
	scripts/same-wheel $(BIN)/python out/wheel
	scripts/clean-environment "$(PYTHON)" out/wheel/*.whl $(ARGS)

hashes: ## write constraints-hashes.txt, with the SHA-256 of every file, for pip install --require-hashes
	scripts/clean-environment --tools "$(PYTHON)" && out/tools/bin/uv pip compile --quiet --generate-hashes \
		--no-header --no-emit-index-url --all-extras -c constraints.txt pyproject.toml -o constraints-hashes.txt

sbom: $(READY) ## write out/sbom.json, what is installed beside sensorgen and its licences (CycloneDX)
	scripts/clean-environment --tools "$(PYTHON)"
	mkdir -p out
	out/tools/bin/cyclonedx-py environment --output-reproducible --of JSON -o out/sbom.json $(BIN)/python

audit: $(READY) ## look for advisories on every version in constraints.txt (pip-audit); offline with ADVISORIES=PLACE, see scripts/audit.py
	scripts/clean-environment --tools "$(PYTHON)"
	$(if $(ADVISORIES),$(BIN)/python scripts/audit.py $(ADVISORIES),out/tools/bin/pip-audit --strict --disable-pip --no-deps \
		-r constraints.txt --cache-dir out/audit --progress-spinner off)

clean: ## remove everything that is derived
	rm -rf $(VENV) out .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache

$(READY): pyproject.toml constraints.txt scripts/system-packages
	scripts/system-packages
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[fem]'
	touch $@

$(READY_DEV): $(READY)
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	touch $@

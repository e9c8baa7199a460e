# feeler: `make reproduce` runs the paper, `make test` the tests. Each sets up .venv by itself; a second call reuses it.
PYTHON ?= python3
SCALE ?= published
VENV := .venv
BIN := $(VENV)/bin
CODE := src paper studies tests benchmarks docs examples
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt

.DEFAULT_GOAL := help
.PHONY: help reproduce test test-long test-slow check words audit kept oldest bench peers docs numbers wheel face screencast decoders notebooks clean

help:  ## list what make can do
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 14

$(BIN)/.core: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit("feeler needs Python 3.11 or newer; set PYTHON=/path/to/python3.11" if sys.version_info < (3, 11) else 0)'
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@echo "setting up $(VENV) (once, a minute or two)"
	@# uv installs side by side and costs a third of pip's time; pip where it cannot
	@{ $(PIP) uv && VIRTUAL_ENV=$(VENV) $(BIN)/uv pip install --quiet -c constraints.txt -e '.[all]'; } || $(PIP) -e '.[all]'
	@touch $@

$(BIN)/.test: $(BIN)/.core
	@$(PIP) -e '.[test]'
	@command -v chromedriver >/dev/null || { [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null && apt-get install -y -qq chromium chromium-driver >/dev/null; } \
	  || echo "no Chromium with chromedriver: the studio's tests in a browser will be skipped (apt-get install chromium chromium-driver)"
	@touch $@

$(BIN)/.cnn: $(BIN)/.core
	@$(PIP) -e '.[cnn]'
	@touch $@

$(BIN)/.docs: $(BIN)/.core
	@$(PIP) -e '.[docs,cnn]'
	@touch $@

reproduce: $(BIN)/.core $(if $(filter paper,$(SCALE)),$(BIN)/.cnn)  ## the whole paper: out/report.html (SCALE=quick|published|paper)
	@$(BIN)/python -m paper --scale $(SCALE)

test: $(BIN)/.test  ## the default tests (some three minutes on two cores)
	@$(BIN)/python -m pytest -q -n auto --dist loadfile

test-long: $(BIN)/.test  ## the others: browsers, damaged files, the engine in space, what takes seconds; CI runs them after the default ones
	@$(BIN)/python -m pytest -q -n auto --dist loadfile -m "long and not slow"

$(BIN)/.lab: $(BIN)/.test
	@$(PIP) -e '.[test,lab]'
	@touch $@

test-slow: $(BIN)/.lab  ## the long tests: fuzzing, kills, full disks
	@$(BIN)/python -m pytest -q -m slow

$(BIN)/.check: $(BIN)/.core
	@$(PIP) -e '.[check]'
	@touch $@

check: $(BIN)/.check  ## style, types and spelling; pre-commit runs it
	@$(BIN)/ruff check --quiet $(CODE) && $(BIN)/ruff format --quiet --check $(CODE) && $(BIN)/python -m mypy
	@$(BIN)/codespell README.md CONTRIBUTING.md $(filter-out tests,$(CODE))  # tests misspell on purpose
	@$(BIN)/python -m docs.measured --check
	@$(MAKE) --no-print-directory words

words:  ## expressions that docs/words.md replaces, in README, docs, help, report and studio
	@! sed -n 's/^| \([^|]*\) |.*/\1/p' docs/words.md | grep -v -x -e not -e '-*' \
	  | git grep -n -w -i -E -I -f - -- README.md CONTRIBUTING.md docs src paper studies ':!docs/words.md' ':!*.json' ':!*.ipynb'

$(BIN)/.audit: $(BIN)/.core
	@$(PIP) -e '.[audit]'
	@touch $@

audit: $(BIN)/.audit  ## known weaknesses of the versions in constraints.txt (asks an advisory service)
	@$(BIN)/python -m pip_audit --no-deps --disable-pip -r constraints.txt

OLDEST := $(VENV)-oldest
$(OLDEST)/.ready: pyproject.toml
	@$(PYTHON) -m venv $(OLDEST)
	@$(OLDEST)/bin/python -m pip install --quiet --disable-pip-version-check uv
	@VIRTUAL_ENV=$(OLDEST) $(OLDEST)/bin/uv pip install --quiet --resolution lowest-direct -e '.[mujoco,store,processes,models,studio,movie,pdf]'
	@VIRTUAL_ENV=$(OLDEST) $(OLDEST)/bin/uv pip install --quiet "pytest>=8" "pytest-xdist>=3.6" "hypothesis>=6.100"
	@touch $@

kept: $(BIN)/.core  ## which kept results were made by other code than today's
	@PYTHONPATH=. $(BIN)/python benchmarks/kept.py

oldest: $(OLDEST)/.ready  ## quick tests with the oldest versions that pyproject.toml allows, in an environment of its own
	@$(OLDEST)/bin/python -m pytest -q -n auto --dist loadfile tests/cli tests/plotting tests/physics/test_parity_chain.py tests/physics/test_plain.py

bench: $(BIN)/.core  ## what is claimed of speed and growth in one table, our engines against MuJoCo, wall, calibration
	@for script in claims chain wall calibration; do PYTHONPATH=. $(BIN)/python benchmarks/$$script.py; done

peers:  ## the chain engine beside MuJoCo, PyElastica, Pinocchio and cosseratbench, in an environment of their own
	@bash benchmarks/peers/run.sh

docs: $(BIN)/.docs  ## the documentation site in site/
	@$(BIN)/python -m docs.build

numbers: $(BIN)/.core  ## measured numbers into README and docs, from benchmarks/results
	@$(BIN)/python -m docs.measured && $(BIN)/python -m docs.make_table

face: $(BIN)/.core  ## mark, preview picture, badges and the page to hand out, in docs/images
	@$(BIN)/python -m docs.make_face

screencast: $(BIN)/.test  ## a film of the studio, a minute long: screencast.mp4 (needs Chromium)
	@$(BIN)/python -m docs.make_screencast

decoders: $(BIN)/.core  ## the decoders that come with the studio, trained again
	@$(BIN)/python -m docs.make_decoders

wheel: $(BIN)/.core  ## a wheel with the engine's machine code for this Python: dist/
	@$(BIN)/python -m pip wheel --quiet --no-deps -w dist .
	@$(BIN)/python benchmarks/machine_code.py dist/feeler-*-any.whl

notebooks: $(BIN)/.lab  ## the tutorials as notebooks that were run: docs/notebooks (NAME=one of them)
	@$(BIN)/python docs/notebooks.py $(NAME)

clean:  ## remove what the targets made, except stores
	@rm -rf $(VENV) $(OLDEST) site build dist src/*.egg-info .pytest_cache

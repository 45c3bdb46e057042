# Every target sets up its own .venv first; nothing outside this folder is changed.

SUPPORTED := import sys; sys.exit(sys.version_info[:2] not in ((3, 11), (3, 12)))
# The first candidate that runs and is 3.11 or 3.12; `make PYTHON=/path/to/python3.11 …` overrides.
PYTHON ?= $(shell for candidate in python3.12 python3.11 python3; do \
	"$$candidate" -c "$(SUPPORTED)" 2>/dev/null && { command -v "$$candidate"; break; }; done)
BIN := .venv/bin
EXPLORER := $(BIN)/explorer

# Where this is set, each of the hundreds of processes that the tests start would compile the program anew.
unexport PYTHONDONTWRITEBYTECODE
# As the command `explorer` does for itself (explorer/cli.py): tests that run side by side fit spheres five times as fast.
export OPENBLAS_NUM_THREADS ?= 1

.DEFAULT_GOAL := help
.PHONY: help venv serve calibrate calibrate-quick diagnose test slow nightly pictures photographs preview page-speed faults memory fuzz peers foreign rolling golden against-r clean

help: ## show this list
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(firstword $(MAKEFILE_LIST)) | expand -t 18

venv: .venv/.ready ## set up .venv from pyproject.toml and constraints.txt

.venv/.ready: pyproject.toml constraints.txt
	@"$(PYTHON)" -c "$(SUPPORTED)" 2>/dev/null || \
		{ echo "error: Python 3.11 or 3.12 is needed; install one, or name it: make PYTHON=/path/to/python3.11" >&2; exit 1; }
	"$(PYTHON)" -m venv .venv
	$(BIN)/python -m pip install --disable-pip-version-check --quiet -c constraints.txt -e '.[test]'
	@touch $@

serve: .venv/.ready ## open the live page (address is printed; stop with Ctrl-C)
	$(EXPLORER) serve

calibrate: .venv/.ready ## calibrate the shipped material, profile standard, into results/standard (resumes)
	$(EXPLORER) calibrate --headless --profile standard --out results/standard $(if $(wildcard results/standard),--resume)

calibrate-quick: .venv/.ready ## the same chain with coarse shapes and less mass, into results/quick (resumes)
	$(EXPLORER) calibrate --headless --profile quick --out results/quick $(if $(wildcard results/quick),--resume)

diagnose: .venv/.ready ## find the effect that a shipped measurement asks for, into results/diagnosis (resumes)
	$(EXPLORER) diagnose trefoil_2 --out results/diagnosis --apply $(if $(wildcard results/diagnosis),--resume)

test: .venv/.ready ## format check, lint, types, fast tests
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	@# A file stays in one process; what is drawn in a browser is not fast enough beside other tests. Without one of its
	@# passes Taichi compiles to the same bits in three quarters of the time (the golden bits are taken with it).
	TI_ADVANCED_OPTIMIZATION=0 $(BIN)/pytest -m "not slow and not browser" -n auto --maxprocesses 4 --dist loadfile
	$(BIN)/pytest -m "not slow and browser"

slow: .venv/.ready ## the tests marked slow, but for those of `make peers`
	$(BIN)/pytest -m "slow and not peers"

nightly: .venv/.ready ## what is too long for CI (80 min at most); writes docs/nightly.md
	$(BIN)/python -m tests.nightly

pictures: .venv/.ready ## the pictures of README and docs, taken from the running program (needs Chromium; 25 min)
	$(BIN)/python -m tests.browser.pictures

photographs: .venv/.ready ## rendered photographs of piles, read by seed (resumes); writes docs/photographs.json (5 min)
	$(BIN)/python -m tests.solver.photograph.campaign 3000 3119 docs/photographs.json

preview: .venv/.ready ## record the pour that the page shows while its solver loads (1 min)
	$(BIN)/python -m tests.browser.preview

page-speed: .venv/.ready ## frames/s and slider echo of the page: one and two browsers, beside a study, over a slow line (6 min)
	$(BIN)/python -m tests.browser.page_speed

faults: .venv/.ready ## a study killed 20 times, a diagnosis and a page 10 times each, against unbroken ones (an hour)
	$(BIN)/python -m tests.faults.kills study --kills 20
	$(BIN)/python -m tests.faults.kills diagnosis --kills 10
	$(BIN)/python -m tests.faults.kills page --kills 10

memory: .venv/.ready ## memory of a command and its worker over 10,000 pours of 0.06 CPU s (30 min)
	$(BIN)/python -m tests.faults.memory --pours 10000

fuzz: .venv/.ready ## 500 damaged or hostile files for each parser (an hour)
	$(BIN)/python -m tests.faults.fuzz --inputs 500

foreign: .venv/.ready ## data sets poured by LIGGGHTS with effects that no file states, judged (an hour)
	$(BIN)/python -m tests.peers.foreign_sets results/foreign.sqlite

rolling: .venv/.ready ## trefoil_2's rolling friction poured by our solver and by LIGGGHTS, ten pairs (10 min)
	$(BIN)/python -m tests.peers.rolling_pairs

peers: .venv/.ready ## our solver against installed LIGGGHTS and YADE, with 18 pours each (hours)
	$(BIN)/pytest tests/peers -m "slow or not slow" -s

against-r: .venv/.ready ## analyses beside R's (needs R with MASS and nlme); writes tests/doe/against_r and docs/against_r.md
	Rscript tests/doe/against_r/against_r.R tests/doe/against_r
	$(BIN)/python -m tests.doe.against_r.compare

golden: .venv/.ready ## record the golden bits of the solver and the golden readings; refused where their version does not fit
	$(BIN)/python -m tests.solver.golden.golden_file
	$(BIN)/python -m tests.doe.golden_readings
	$(BIN)/python -m tests.solver.shipped_fits

clean: ## remove .venv and the caches; results stay
	rm -rf .venv .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find explorer solver doe tests -name __pycache__ -type d -prune -exec rm -rf {} +

# make run   the cone: robot, forming force, coupling, compensation, report   (results/cone)
# make test  style, types and tests
# make lint  style and types
# make check these, and the tests nearest to what changed since main: a minute for a small change
# make fuzz  the native FMUs under a million random calls
# make docs  every page and picture that runs write
# make release  sdist, wheel and checksums in dist/, tried in an environment of their own
# make site  the pages as a site, strictly   (results/site/html)

PYTHON ?= python3
export OPENBLAS_NUM_THREADS = 1
export OMP_NUM_THREADS = 1

# Needs preCICE, which no package index has; not among the pages below.
precice: .venv/installed
	.venv/bin/python docs/scripts/make_precice.py

# What runs write into docs/, and the scripts that do: all of it takes about an hour and a half, one is make milling.
PAGES = figures damping inverse robin study identify motion next comparison milling two-robots place export newcomer notebook sheet-fem measured-sheet commands masters-table stable-steps performance real-time inverse-time command-times expected-deviation trust
script = docs/scripts/make_$(subst -,_,$@).py
performance: script = benchmarks/iso_path.py --page docs/performance.md
real-time: script = -m benchmarks.real_time --page performance
inverse-time: script = -m benchmarks.inverse --page performance
command-times: script = -m benchmarks.commands --page
expected-deviation: script = -m benchmarks.expected_deviation --page

.PHONY: web precice notebooks run lint check test fuzz emulators docs site $(PAGES) masters clean
.NOTPARALLEL:  # what is timed runs alone

run: .venv/installed
	rm -rf results/cone
	.venv/bin/elastic-robot compensate examples/cases/cone.toml -o results/cone

lint: .venv/installed
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .
	.venv/bin/mypy

check: lint
	tests=$$(.venv/bin/python .ci/changed.py) && { test -z "$$tests" || .venv/bin/pytest -q -n 2 --dist worksteal $$tests; }

test: lint
	.venv/bin/pytest -n 3 --dist worksteal --durations=40  # on two cores: many tests wait for processes

# A million random calls each of co-simulation and model exchange, FMI 2.0 and 3.0, and a hundred thousand
# damaged trajectory files under address and undefined-behaviour sanitizers.
fuzz: .venv/installed
	ELASTIC_ROBOT_FUZZ=1000000 .venv/bin/pytest -q tests/native/test_fuzz.py tests/native/test_core_library.py -k sanitizers

# Debian: apt-get install qemu-user libc6-arm64-cross wine
emulators: .venv/installed
	ELASTIC_ROBOT_EMULATORS=1 .venv/bin/pytest -q tests/native/test_emulators.py tests/fmu/test_python_host.py tests/fmu/test_wheel.py -k "emulator or wine or platforms"

docs: run $(PAGES)

$(PAGES): .venv/installed
	.venv/bin/python $(script)

# Needs Node.js. What it writes, coupling/report/browser/, is in the repository.
web:
	cd web && npm ci --ignore-scripts && npm run build

site: .venv/site
	.venv/bin/python -m docs.site.build -o results/site

release: .venv/installed
	.venv/bin/python .ci/release.py

.venv/site: .venv/installed requirements-docs.lock
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-deps -r requirements-docs.lock
	touch $@

masters-table stable-steps: masters

# The co-simulation masters that the FMU is tried in; their tests are skipped without them.
masters: .venv/masters

.venv/masters: .venv/installed requirements-masters.lock requirements-cofmupy.lock
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-deps -r requirements-masters.lock
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --upgrade --target .venv/cofmupy -r requirements-cofmupy.lock
	touch $@

# Runs the notebooks; their test is skipped without what that needs.
notebooks: .venv/notebooks
	.venv/bin/pytest -q tests/docs/test_notebook.py

.venv/notebooks: .venv/installed requirements-notebook.lock
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-deps -r requirements-notebook.lock
	touch $@

.venv/installed: pyproject.toml requirements.lock
	$(PYTHON) -m venv .venv
	.venv/bin/python -m pip install --quiet --disable-pip-version-check -r requirements.lock
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps -e .
	touch $@

clean:
	rm -rf .venv results .mypy_cache .ruff_cache .pytest_cache .hypothesis

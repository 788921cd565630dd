# make run   the cone: robot, forming force, coupling, compensation, report   (results/cone)
# make test  style, types and tests

PYTHON ?= python3
export OPENBLAS_NUM_THREADS = 1
export OMP_NUM_THREADS = 1

.PHONY: run test emulators figures comparison milling two-robots performance masters masters-table sheet-fem clean

run: .venv/installed
	rm -rf results/cone
	.venv/bin/elastic-robot compensate examples/cases/cone.toml -o results/cone

test: .venv/installed
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .
	.venv/bin/mypy
	.venv/bin/pytest -n 2 --durations=10

# Debian: apt-get install qemu-user libc6-arm64-cross wine
emulators: .venv/installed
	.venv/bin/python -m pip install --quiet --disable-pip-version-check -e .[native]
	ELASTIC_ROBOT_EMULATORS=1 .venv/bin/pytest -q tests/native/test_emulators.py tests/fmu/test_python_host.py -k "emulator or wine or platforms"

figures: .venv/installed
	.venv/bin/python docs/scripts/make_figures.py

comparison: .venv/installed
	.venv/bin/python docs/scripts/make_comparison.py

milling: .venv/installed
	.venv/bin/python docs/scripts/make_milling.py

two-robots: .venv/installed
	.venv/bin/python docs/scripts/make_two_robots.py

performance: .venv/installed
	.venv/bin/python benchmarks/iso_path.py --page docs/performance.md

sheet-fem: .venv/installed
	.venv/bin/python docs/scripts/make_sheet_fem.py

# The co-simulation masters that the FMU is tried in; their tests are skipped without them.
masters: .venv/masters

masters-table: .venv/masters
	.venv/bin/python docs/scripts/make_masters_table.py

.venv/masters: .venv/installed requirements-masters.lock requirements-cofmupy.lock
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-deps -r requirements-masters.lock
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --upgrade --target .venv/cofmupy -r requirements-cofmupy.lock
	touch $@

.venv/installed: pyproject.toml requirements.lock
	$(PYTHON) -m venv .venv
	.venv/bin/python -m pip install --quiet --disable-pip-version-check -r requirements.lock
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps -e .
	touch $@

clean:
	rm -rf .venv results .mypy_cache .ruff_cache .pytest_cache .hypothesis

# `make demo` and `make test` each do all their set-up in .venv and leave the system alone; only `make parts` installs
# packages on it.
PYTHON ?= python3
VENV := .venv
OUT ?= out/demo
SEED ?= 2
# Small matrices: more threads only wait for each other.
export OPENBLAS_NUM_THREADS ?= 1
# Where no bytecode is kept, every process compiles hvcpd, and every test run all tests, anew.
unexport PYTHONDONTWRITEBYTECODE

# What takes a machine or a root folder of its own has commands of its own (-m takes the place of pyproject.toml's).
HERE := not arm64 and not container
WORKERS := -n 3 --dist loadfile --no-loadscope-reorder

.PHONY: demo test test-long test-arm64 test-package check slow setup setup-dev deb wheel image sbom lock clean

demo: setup  ## two robots share out the watering, out loud
	$(VENV)/bin/hvcpctl simulate --seed $(SEED) --tank 2 --report $(OUT)

test: setup-dev  ## all tests but the longest, in under 8 minutes on 2 cores, with the parts that are here
	$(MAKE) --no-print-directory -j 2 lint compiled
	$(VENV)/bin/python -m pytest -m "not long and $(HERE)" $(WORKERS)

test-long: setup-dev  ## whole missions in sound, of processes in real time, and what else takes long: 11 minutes
	$(VENV)/bin/python -m pytest tests/e2e  # in real time, so nothing else runs beside them
	$(VENV)/bin/python -m pytest -m "long and $(HERE)" $(WORKERS) --ignore tests/e2e

check: setup-dev lint  ## the fast part
	$(VENV)/bin/python -m pytest -m "not slow" -n 2 -x

slow: setup-dev  ## measures all tests anew: check and test leave out what took long
	-$(VENV)/bin/python -m pytest -p tests.slow -n 2 --dist loadfile --junitxml=out/tests.xml
	$(VENV)/bin/python -m tests.slow out/tests.xml

.PHONY: fit
fit: setup-dev  ## fits the ear's weights anew, to be reviewed (make fit DATA=DIR: by people's recordings, too)
	$(VENV)/bin/python -m benchmarks.fit $(if $(DATA),--data $(DATA))

.PHONY: compiled
compiled: setup-dev  # all tests, once: on a new clone each worker would compile them for itself
	-$(VENV)/bin/python -m pytest --collect-only -qq >/dev/null

.PHONY: lint
lint: setup-dev
	$(VENV)/bin/ruff check .
	$(VENV)/bin/mypy
	$(VENV)/bin/lint-imports --cache-dir .import_linter_cache
	$(VENV)/bin/python -m release.prose

.PHONY: docs
docs: setup-dev $(VENV)/.docs-are-set-up  ## the documentation as a site, in out/docs; every link in it is checked
	$(VENV)/bin/python -m release.reference
	NO_MKDOCS_2_WARNING=1 $(VENV)/bin/python -m mkdocs build --strict --quiet
	@echo "Open out/docs/index.html in a browser."

$(VENV)/.docs-are-set-up: requirements/docs.txt | $(VENV)/bin/pip
	$(VENV)/bin/pip install --quiet --disable-pip-version-check --require-hashes --only-binary :all: -r $<
	@touch $@

.PHONY: parts
parts:  ## installs what tests of real parts need, by apt: a sound server, ROS, a browser, a broker
	@sh .ci/install-parts

setup: $(VENV)/.run-is-set-up
setup-dev: $(VENV)/.dev-is-set-up

# One environment serves both; the stamps say how far it has got.
$(VENV)/bin/pip:
	@sh .ci/make-venv "$(PYTHON)" "$(VENV)"

$(VENV)/.run-is-set-up: requirements/run.txt pyproject.toml | $(VENV)/bin/pip
	$(VENV)/bin/pip install --quiet --disable-pip-version-check --require-hashes --only-binary :all: -r requirements/run.txt
	$(VENV)/bin/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

$(VENV)/.dev-is-set-up: requirements/dev.txt pyproject.toml | $(VENV)/bin/pip
	$(VENV)/bin/pip install --quiet --disable-pip-version-check --require-hashes --only-binary :all: -r requirements/dev.txt
	$(VENV)/bin/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@ $(VENV)/.run-is-set-up

# For a Raspberry Pi: make deb FOR="--architecture arm64 --python 3.11" (3.13 from Debian 13 on).
deb: setup-dev  ## the Debian package, in dist/
	$(VENV)/bin/python -m release.deb $(FOR)

wheel: setup-dev  ## the wheel for pipx and the source archive, in dist/
	$(VENV)/bin/python -m release.wheel

image: deb  ## an OCI image of this computer's package, in dist/; rootless, needs mmdebstrap and buildah
	sh release/image "$$(ls dist/hvcpd_*_$$(dpkg --print-architecture).deb | sort -V | tail -n 1)" dist/hvcpd-oci.tar

test-package: setup-dev  ## the package in a Debian of its own with systemd; root only, needs mmdebstrap, systemd-container, pulseaudio
	$(VENV)/bin/python -m pytest -m container -n 0 tests/release

test-arm64: setup-dev  ## the package for a Raspberry Pi, run here under qemu-user
	$(VENV)/bin/python -m pytest -m arm64 -n 0 tests/release/test_arm64.py

sbom: setup-dev  ## the software bill of materials, CycloneDX
	mkdir -p dist
	$(VENV)/bin/python -W ignore -m cyclonedx_py requirements requirements/run.txt --pyproject pyproject.toml \
		--output-reproducible --output-file dist/hvcpd.cdx.json

lock: setup-dev  ## renew the hash-locked requirements (needs uv)
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-header --no-annotate --upgrade \
		pyproject.toml requirements/run.in --output-file requirements/run.txt
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-header --no-annotate --upgrade \
		--extra dev pyproject.toml requirements/run.in --output-file requirements/dev.txt
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-header --no-annotate --upgrade \
		-c requirements/dev.txt requirements/docs.in --output-file requirements/docs.txt

clean:
	rm -rf $(VENV) out build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache

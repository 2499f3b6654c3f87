# run: loop and search on the bundled campaign; test: style, types and all but the slow tests; check: style, types and layers; rust: the kernel's own tests;
# slow: the slow tests of simulation, identification, planning, fleets, bench, desk and kernel;
# bench: speed of the kernel; blind: blind simulation study; blind-coaches: of a coach;
# dist: wheel, source archive, bill of materials, installed away from the checkout, where the notebooks run; minimum: with the oldest versions allowed;
# wheels: for x86-64 and aarch64 Linux, the former tried with every Python found;
# mutants: changes of single lines of the verdict, the score test, the score and the wire that no test notices;
# docs: the site, in target/site; transcripts: check every command of README and docs, the recording in real time included;
# rewrite: write the present output of these commands into the pages;
# lock: renew requirements/, the versions and hashes of what pip installs;
# deny: advisories, licences, duplicates and sources of the crates;
# killed: a search killed at 50 random moments, cases that kill their workers;
# bench-peers: the standard job with other software; bench-counts: its instructions, counted by valgrind;
# exudyn: motions and loops of vehicles simulated by Exudyn;
# emulated: the kernel's tests on an emulated processor with AVX-512; aarch64: those for that processor, emulated;
# growth: cost against length, designs, degrees of freedom, threads and effects;
# sensors: what sets of sensors determine and detect, and the delay and noise that they bear;
# purpose: Pareto fronts of the nominal and of the calibrated vehicle compared, over several seeds;
# fuzz: other examples of the properties of readers, mutated files and command lines, damaged frames, forged streams;
# pictures: the figures of README and docs/vehicles.md, from the results of run and of the loop on the bundled coach
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# only what a lock names, with the hashes that it names
INSTALL := $(BIN)/python -m pip install --quiet --no-build-isolation --require-hashes -r
# rustdoc, which runs the examples, cannot use the job server of make
CARGO := env -u MAKEFLAGS -u MFLAGS cargo
SOURCES := $(shell find rust_core -name '*.rs' -o -name '*.toml') Cargo.toml Cargo.lock pyproject.toml

.PHONY: run lock wheels mutants fuzz test rust rust-style python-style slow check exudyn bench bench-peers bench-counts growth sensors shots desk-latency blind blind-coaches purpose pictures docs transcripts rewrite dist minimum deny emulated aarch64 killed clean

run: .stamp-build
	@$(BIN)/railui loop designs/campaigns/worn_axle_box -o railui-loop/worn_axle_box
	@$(BIN)/railui optimise designs/studies/worn_axle_box.yaml -o railui-study/worn_axle_box

# clippy and the kernel while pip fetches; three processes of tests, since many wait for wires, terminals and schedulers
test:
	@$(MAKE) --no-print-directory --jobs=2 --output-sync=line check rust
	$(BIN)/python -m pytest -n 3 --dist loadfile

# the whole workspace in one profile: the kernel that Python loads is compiled once for both
rust: rust-style
	$(CARGO) test --locked --release --workspace

check: rust-style python-style .stamp-build
	$(CARGO) test --locked --release --workspace --quiet --test layers

python-style: .stamp-packages
	$(BIN)/ruff check railui tests release docs examples
	$(BIN)/ruff format --check railui tests examples
	$(BIN)/mypy
	$(BIN)/lint-imports

rust-style:
	cargo fmt --all --check
	cargo clippy --locked --release --workspace --all-targets -- -D warnings

KEPT := target/bench/history.jsonl
bench: .stamp-build
	$(BIN)/railui bench --keep $(KEPT)

bench-counts: .stamp-build
	$(BIN)/python -m tests.bench.counts --keep $(KEPT)

# in a separate environment: these packages take a gigabyte
PEERS := target/peers
$(PEERS)/.stamp: requirements/peers.txt
	$(PYTHON) -m venv --without-pip $(PEERS)
	$(PYTHON) -m pip --python $(PEERS)/bin/python install --quiet --require-hashes -r $<
	@touch $@

bench-peers: .stamp-build $(PEERS)/.stamp
	$(PEERS)/bin/python -m tests.bench.peers --write docs/peers.md

growth: .stamp-build
	$(BIN)/python -m tests.bench.growth --write docs/growth.md

sensors: .stamp-build
	$(BIN)/python -m tests.bench.sensors --write docs/sensors.md

pictures: run
	@$(BIN)/railui loop designs/campaigns/worn_centre_guide -o railui-loop/worn_centre_guide
	@$(BIN)/python docs/pictures.py

shots: .stamp-build
	$(BIN)/python -m tests.desk.shots

# response time of the desk: from outside in a pseudo terminal, then its own heartbeat
desk-latency: .stamp-build
	$(BIN)/python -m tests.desk.latency
	$(BIN)/python -m pytest tests/desk/bench_heartbeat.py -q -s

# strict: a warning is an error; the two variables silence notices about successors of mkdocs
docs: .stamp-build
	@NO_MKDOCS_2_WARNING=1 DISABLE_MKDOCS_2_WARNING=true $(BIN)/mkdocs build --quiet
	@echo "target/site/index.html"

# wheel and source archive, tried in a clean environment away from here; what they bring and under which licences
dist: .stamp-build
	rm -rf dist
	$(BIN)/python -m maturin build --release --sdist --quiet --out dist
	$(BIN)/python release/check_install.py dist/railui-*.whl --notebooks --freeze dist/installed.json
	$(BIN)/python release/check_install.py dist/railui-*.tar.gz --wheel dist/railui-*.whl
	$(BIN)/python release/bill_of_materials.py dist/installed.json dist

# for x86-64 and aarch64, linked by zig; `rustup target add aarch64-unknown-linux-gnu` once
wheels: .stamp-packages
	$(INSTALL) requirements/wheels.txt
	$(BIN)/python release/build_wheels.py dist/wheels

# changes of single lines that no test notices
mutants: .stamp-build
	$(INSTALL) requirements/mutants.txt
	$(BIN)/python -m tests.mutants

# the oldest versions that pyproject.toml allows
minimum: dist
	$(INSTALL) requirements/lock.txt
	$(BIN)/python release/check_install.py dist/railui-*.whl --minimum

# versions and hashes of what pip installs here; `make lock UPGRADE=--upgrade` takes the newest
lock: .stamp-packages
	$(INSTALL) requirements/lock.txt
	$(BIN)/python release/lock.py $(UPGRADE)

# cargo install cargo-deny --locked; without a network: make deny CHECKS="bans licenses sources"
deny:
	cargo deny --locked check $(CHECKS)

# long trials of the identification (true effect excluded, crossed damping, sensitivity to the settings) and of all else;
# transcripts, killed and exudyn run the slow tests of docs, execution and third_program
slow: .stamp-build
	$(BIN)/python -m pytest tests -m slow --ignore=tests/docs --ignore=tests/execution --ignore=tests/third_program

# the optional dependencies `bench`
exudyn: .stamp-build
	$(INSTALL) requirements/exudyn.txt
	$(BIN)/python -m pytest tests/third_program -m "slow or not slow"
	$(BIN)/python -m tests.third_program.agreement
	$(BIN)/python -m tests.third_program.loops target/exudyn

emulated:
	$(PYTHON) release/emulate_avx512.py

# Debian: apt-get install qemu-user-binfmt gcc-aarch64-linux-gnu; rustup target add aarch64-unknown-linux-gnu.
# A test starts its own executable, for which the emulator has to be registered (binfmt_misc)
ARM := aarch64-unknown-linux-gnu
ARM_LIBRARIES := /usr/aarch64-linux-gnu
aarch64:
	CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc QEMU_LD_PREFIX=$(ARM_LIBRARIES) \
	CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER=qemu-aarch64 cargo test --locked --release --target $(ARM)

# failures are kept in target/fuzz; one case again: python -m tests.fuzz --only NUMBER
fuzz: .stamp-build
	RAILUI_HYPOTHESIS=random $(BIN)/python -m pytest tests/capture tests/io -q -n 2
	$(BIN)/python -m tests.fuzz --cases 10000 --frames 1000000 --seed 1

killed: .stamp-build
	$(BIN)/python -m pytest tests/execution -m slow

transcripts: .stamp-build
	$(BIN)/python -m pytest tests/docs -m "slow or not slow"

rewrite: .stamp-build
	$(BIN)/python -m tests.docs.transcript README.md docs/*.md docs/examples/*.md

blind: .stamp-build
	$(BIN)/python -m tests.blind.blind --loops 20 --seed 1000

blind-coaches: .stamp-build
	$(BIN)/python -m tests.blind.coaches --seed 60000

purpose: .stamp-build
	@$(BIN)/python -m tests.bench.purpose --write docs/studies.md

# the pip outside installs the one that the lock names, since ensurepip may be missing; maturin must be on the path
.stamp-venv: requirements/build.txt
	@$(PYTHON) release/check_build_tools.py
	@$(PYTHON) -m venv --without-pip $(VENV)
	@$(PYTHON) -m pip --python $(BIN)/python install --quiet --require-hashes -r $<
	@touch $@

# a target of its own: packages are downloaded while the kernel is compiled; cobs is built with the setuptools of the lock
.stamp-packages: requirements/dev.txt .stamp-venv
	@$(INSTALL) $<
	@touch $@

# bytecode included: without it (PYTHONDONTWRITEBYTECODE) every start would compile a hundred files
.stamp-build: .stamp-packages $(SOURCES)
	@echo "building railui (the first time takes a few minutes)" >&2
	@PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@$(BIN)/python -m compileall -q railui
	@touch $@

clean:
	rm -rf $(VENV) target dist .stamp-*

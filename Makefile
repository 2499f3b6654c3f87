# run: the main job on the bundled campaign; test: everything; check: style and floors; bench: speed; blind: planted effects;
# docs: the site, in target/site; transcripts: every command of README and docs typed again, the long ones too;
# purpose: what the declared optimum costs;
# pictures: the README's figure, from what run has found
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SOURCES := $(shell find rust_core -name '*.rs' -o -name '*.toml') Cargo.toml pyproject.toml

.PHONY: run test check bench shots blind pictures docs transcripts clean

run: .stamp-build
	@$(BIN)/railui loop designs/campaigns/worn_axle_box -o railui-loop/worn_axle_box
	@$(BIN)/railui optimise designs/studies/worn_axle_box.yaml -o railui-study/worn_axle_box

test: check
	cargo test --release
	$(BIN)/python -m pytest

check: .stamp-build
	cargo fmt --check
	cargo clippy --all-targets --features python -- -D warnings
	$(BIN)/ruff check railui tests
	$(BIN)/ruff format --check railui tests
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: .stamp-build
	$(BIN)/railui bench

pictures: run
	@$(BIN)/python docs/pictures.py

shots: .stamp-build
	$(BIN)/python -m tests.desk.shots

# strict: a warning is an error. The two variables silence notices of mkdocs' makers about its successors
docs: .stamp-build
	@NO_MKDOCS_2_WARNING=1 DISABLE_MKDOCS_2_WARNING=true $(BIN)/mkdocs build --quiet
	@echo "target/site/index.html"

transcripts: .stamp-build
	$(BIN)/python -m pytest tests/docs -m "slow or not slow"

blind: .stamp-build
	$(BIN)/python -m tests.blind.blind --campaigns 20 --seed 1000

purpose: .stamp-build
	@$(BIN)/python -m tests.bench.purpose

# the outer pip serves where ensurepip is missing
.stamp-venv: constraints.txt
	$(PYTHON) -m venv $(VENV) 2>/dev/null || $(PYTHON) -m venv --without-pip $(VENV)
	$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m pip --python $(BIN)/python install --quiet pip
	$(BIN)/python -m pip install --quiet -c constraints.txt maturin
	@touch $@

.stamp-build: .stamp-venv $(SOURCES)
	@echo "building railui (the first time takes a few minutes)" >&2
	@$(BIN)/python -m pip install --quiet -c constraints.txt --no-build-isolation --editable '.[dev]'
	@touch $@

clean:
	rm -rf $(VENV) target .stamp-venv .stamp-build

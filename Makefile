# VisualHFSM: every command a newcomer or a maintainer types.
#   make demo [SECONDS=60]   set everything up and watch a simulated Nao follow a ball and dance
#   make check               format, lint, check types and run the quick unit tests: after each change
#   make test                set everything up and run the quick tests, those of the README's promises too
#   make test-all            run every other test, lint, and build the docs: what CI runs after `make test`;
#                            PLUGINS="ros2 match" runs all tests of these plug-ins, and no others
#   make findings            run what surprised us about libraries of others: minutes, with their packages
#   make soak                repeat what only repetition finds, for hours, in parts that can be resumed
#   make docs                build the documentation as a site in site/
#   make release             build the distributions and an SBOM in dist/, and check them
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Like pip, uv then trusts what the system trusts, such as the proxy of a school.
UV := $(BIN)/uv pip install --system-certs --python $(BIN)/python --constraint constraints.txt
PIP := PIP_CONSTRAINT=constraints.txt PIP_DISABLE_PIP_VERSION_CHECK=1 $(BIN)/python -m pip install
PYTHONS ?= python3.11 python3.12 python3.13
ROS_PYTHON ?= python3.11
CACHE := $(or $(XDG_CACHE_HOME),$(HOME)/.cache)/visualhfsm
ROS_PEERS ?= $(CACHE)/ros-peers
# One cache for all checkouts, because its entries go by content: a new clone is checked in seconds.
export MYPY_CACHE_DIR ?= $(CACHE)/mypy
# In this locale Python before 3.13 cannot read where a checkout lies whose path has umlauts.
ifneq ($(filter C POSIX,$(LC_ALL)),)
export LC_ALL = C.UTF-8
endif
SECONDS ?=
# Many containers set this variable. Each process that runs tests, and each of the hundreds that the tests start,
# would then compile all its modules again, which takes a third of their time.
unexport PYTHONDONTWRITEBYTECODE
# Linters use the processor time that is free while tests wait for robots.
LATER := nice -n 12
# NumPy's other threads wait for work at full speed when they start, in each of those processes.
quick-tests quick full-units full-others coverage soak: export OPENBLAS_NUM_THREADS = 1
# A worker takes neighboring tests, which share fixtures, and at the end those of others. There is one for each processor
# (logical), and half as many more where they wait for processes, browsers and robots. Beside these, slow unit tests have
# half as many (auto). All notice when they get no processor for seconds, so only linters give way.
PYTEST := $(BIN)/python -m pytest -q --dist worksteal
# What only `make test-all` runs, beside slow unit tests: PLUGINS="ros2 match" chooses among the plug-ins.
OTHERS := $(if $(PLUGINS),$(PLUGINS:%=plugins/%/tests),--ignore=tests/unit --ignore=tests/doors tests $(wildcard plugins/*/tests))

.PHONY: help demo check test soak types quick-tests quick full-units full-others cover-page docs release lint lint-quick lint-all lint-python lint-page check-page format coverage test-all pythons findings bench bench-transport oracle mutation codegen texts constraints vendor ros-peers ros-recordings packages system browser bubblewrap node node-modules clean
help: ## List the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "make %-15s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

demo: $(VENV)/demo.stamp system ## Watch the simulated Nao; SECONDS=60 ends by itself and writes demo/report.html
	@$(BIN)/nao stack deploy/demo.toml $(if $(SECONDS),--seconds $(SECONDS)) || [ $$? -eq 130 ]

check: $(VENV)/dev.stamp bubblewrap ## Format, lint, check types and run the quick unit tests
	@$(BIN)/ruff format --quiet . && $(BIN)/ruff check --quiet .
	@$(MAKE) --no-print-directory --jobs=2 quick-tests types

quick-tests:
	@TEST_EXAMPLES=0.1 $(PYTEST) -n logical tests/unit -m "not slow and not sim"

test: $(VENV)/dev.stamp system browser bubblewrap ## Set everything up and run the quick tests: before each commit
	@$(MAKE) --no-print-directory --jobs=2 --keep-going quick lint-quick

quick:
	@TEST_TIER=quick $(PYTEST) -n logical tests/doors tests/unit -m "not slow and not sim"

test-all: $(VENV)/dev.stamp packages node-modules ## Run every other test, all linters, and build the documentation
	@$(BIN)/python tools/runs/full.py $(PLUGINS)

# Their failures are in their records, which tools/runs/full.py reads.
full-units:
	@TEST_TIER=$@ $(PYTEST) -n auto tests/unit -m "slow or sim" || [ $$? -eq 1 ]

full-others:
	@TEST_TIER=$@ $(PYTEST) -n $$((3 * $$(nproc) / 2)) $(OTHERS) || [ $$? -eq 1 ]

soak: $(VENV)/dev.stamp packages node-modules ## Repeat what only repetition finds; PARTS="a b" runs these parts alone
	@$(BIN)/python tools/runs/soak.py $(PARTS)

coverage: $(VENV)/dev.stamp packages node-modules ## Run every test and report what it covers of the packages and of the page
	@rm -rf coverage
	@PAGE_COVERAGE="$(CURDIR)/coverage/page" $(BIN)/coverage run -m pytest -q -n logical --dist worksteal || touch coverage/failed
	@$(BIN)/coverage combine --quiet && $(BIN)/coverage report && $(BIN)/coverage html --quiet
	@if command -v npm >/dev/null; then $(MAKE) --no-print-directory cover-page; \
	else echo "Node.js is not installed: the coverage of the page is not reported"; fi
	@! test -e coverage/failed || { echo "tests failed: the figures say less than they could"; exit 1; }

pythons: ## Run every test on each Python of PYTHONS that is installed, and name those that are not
	@skipped=; failed=; for python in $(PYTHONS); do \
		if ! $$python -c pass 2>/dev/null; then skipped="$$skipped $$python"; continue; fi; \
		echo "$$python:"; \
		$(MAKE) --no-print-directory PYTHON=$$python VENV=$(VENV)/$$python test test-all \
		|| failed="$$failed $$python"; \
	done; \
	echo "skipped, as not installed:$${skipped:- none}; failed:$${failed:- none}"; test -z "$$failed"

findings: ## Run the scripts of findings/, which install packages of others; names those where something changed
	@changed=; for script in findings/*.sh plugins/*/findings/*.sh; do \
		echo "$$script:"; sh "$$script" || changed="$$changed $$script"; \
	done; echo "changed:$${changed:- none}"; test -z "$$changed"

cover-page: tests/page/node_modules/.stamp
	@npm run --silent --prefix tests/page coverage

docs: $(VENV)/dev.stamp ## Build the documentation as a site in site/
	@NO_MKDOCS_2_WARNING=1 $(LATER) $(BIN)/mkdocs build --clean && echo "the site is in site/; $(BIN)/mkdocs serve shows it, with search"

release: $(VENV)/release.stamp bubblewrap ## Build sdist, wheel and SBOM in dist/, and check them; nothing is uploaded
	@$(BIN)/python -m tools.setup.release

lint: lint-quick lint-all ## Check format, style, types, import rules, generated files and the page

lint-quick: $(VENV)/dev.stamp
	@$(BIN)/ruff format --check --quiet . && $(BIN)/ruff check --quiet .
	@$(BIN)/codegen --check interfaces/*.idl behaviors/*.xml

lint-all: lint-page lint-python

lint-python: $(VENV)/dev.stamp
	$(LATER) $(BIN)/mypy .
	@for project in . $(dir $(shell grep -ls importlinter plugins/*/pyproject.toml)); do \
		(cd $$project && "$(CURDIR)/$(BIN)/lint-imports" --no-cache) || exit 1; \
	done
	@$(LATER) $(BIN)/python -m tools.lint

lint-page: node-modules ## Check the modules of the page: format, mistakes, types
	@if command -v npm >/dev/null; then $(MAKE) --no-print-directory check-page; \
	else echo "Node.js is not installed: the page is not checked"; fi

types: $(VENV)/dev.stamp
	@$(BIN)/mypy .

check-page: tests/page/node_modules/.stamp
	$(LATER) npm run --silent --prefix tests/page check

node-modules: node
	@if command -v npm >/dev/null; then \
		$(MAKE) --no-print-directory tests/hub/node_modules/.stamp tests/page/node_modules/.stamp; \
	else echo "Node.js is not installed: tests of catalogs, with axe and with a JupyterHub are skipped"; fi

tests/%/node_modules/.stamp: tests/%/package-lock.json
	@[ ! -L tests/$*/node_modules ] || rm tests/$*/node_modules  # npm would empty the folder that a link leads to
	npm ci --silent --prefix tests/$*
	@touch $@

format: $(VENV)/dev.stamp ## Format the code
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .
	@! command -v npm >/dev/null || { $(MAKE) --no-print-directory tests/page/node_modules/.stamp && npm run --silent --prefix tests/page format; }

bench: $(VENV)/bench.stamp system browser ## Measure the figures and print them as tables
	@for script in benchmarks/bench_*.py plugins/*/benchmarks/bench_*.py; do $(BIN)/python $$script || exit 1; done

bench-transport: $(VENV)/bench.stamp ## Measure calls and streams beside Ice, some minutes
	@$(BIN)/python benchmarks/bench_transport.py

oracle: $(VENV)/bench.stamp ## Compare the Slice compiler with ZeroC's (needs a C++ compiler; minutes to build)
	$(BIN)/python -m pytest -q tests/unit/codegen/idl/test_compiler_reference.py
	$(BIN)/python benchmarks/slice_agreement.py

# Mutants stay out of the shared cache.
mutation: export MYPY_CACHE_DIR = .mypy_cache
mutation: $(VENV)/mutation.stamp ## Break what must not be wrong, in one place at a time: a test must notice (ten minutes)
	@ln -sfn plugins/makers/src src
	@TEST_EXAMPLES=0.1 PATH="$(CURDIR)/$(BIN):$$PATH" nice -n 19 $(BIN)/mutmut run --max-children 1 $(MUTANTS); \
		status=$$?; $(BIN)/mutmut results; rm src; exit $$status

codegen: $(VENV)/dev.stamp ## Generate the Python of interfaces/ and behaviors/, and the page's types
	$(BIN)/codegen interfaces/*.idl behaviors/*.xml
	$(BIN)/python -m tools.generators.protocol_types

texts: $(VENV)/dev.stamp node tests/page/node_modules/.stamp ## Bring the catalogs of all languages up to date with the code; NEW=fr adds one
	@$(BIN)/python -m tools.languages.texts $(if $(NEW),--new $(NEW))

constraints: ## Resolve the newest versions into constraints.txt
	sh tools/setup/resolve_constraints.sh

vendor: ## Bundle the libraries of the editor's page (needs Node.js and npm)
	cd tools/vendor && npm ci --silent && npm run --silent build

ros-peers: ## Install genuine rclpy and zenoh-ros2-sdk, with which the tests compare our ROS 2 (ROS_PEERS=FOLDER)
	@sh tools/setup/create_venv.sh $(ROS_PYTHON) "$(ROS_PEERS)"
	@"$(ROS_PEERS)/bin/python" -m pip install --quiet --requirement plugins/ros2/tests/ros_peers/requirements.txt

ros-recordings: ## Record what genuine ROS makes of messages in plugins/ros2/tests/data/ros2, after `make ros-peers`
	@"$(ROS_PEERS)/bin/python" plugins/ros2/tests/ros_peers/record_types.py >plugins/ros2/tests/data/ros2/types.json.new 2>/dev/null
	@mv plugins/ros2/tests/data/ros2/types.json.new plugins/ros2/tests/data/ros2/types.json

packages: system browser bubblewrap node

system: $(VENV)/python.stamp ## Install the GL library that the cameras of the simulation need
	@sh tools/setup/system_packages.sh $(BIN)/python gl

browser: $(VENV)/python.stamp ## Install the browser in which the editor's page is tested
	@sh tools/setup/system_packages.sh $(BIN)/python chromium

bubblewrap: $(VENV)/python.stamp ## Install what submissions of a class run in
	@sh tools/setup/system_packages.sh $(BIN)/python bubblewrap

node:
	@sh tools/setup/system_packages.sh $(PYTHON) node

$(VENV)/python.stamp:
	@sh tools/setup/create_venv.sh $(PYTHON) $(VENV)
	@touch $@

# The plug-ins of this checkout, and those of the demo, which need no other library.
PLUG_INS := $(patsubst plugins/%/pyproject.toml,%,$(wildcard plugins/*/pyproject.toml))
WITH_demo := $(foreach name,$(filter classes match old_documents own_robots trials,$(PLUG_INS)),--editable plugins/$(name))
WITH_dev := $(foreach name,$(PLUG_INS),--editable 'plugins/$(name)[dev]')
WITH_bench := $(WITH_dev)
WITH_mutation := $(WITH_dev)
EXTRAS_demo := sim,test,vision,web

# pip takes a minute where uv takes five seconds, but knows the indexes that its own configuration names.
$(VENV)/%.stamp: $(VENV)/python.stamp pyproject.toml $(wildcard plugins/*/pyproject.toml) constraints.txt
	@echo "installing the packages of visualhfsm[$*]"
	@$(UV) --quiet --editable '.[$(or $(EXTRAS_$*),$*)]' $(WITH_$*) \
	|| $(PIP) --quiet --no-compile --editable '.[$(or $(EXTRAS_$*),$*)]' $(WITH_$*)
	@touch $@

clean: ## Remove the environment and everything generated by running
	rm -rf $(VENV) coverage demo mutants src site .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache

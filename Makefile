# Everything a newcomer needs: `make demo` and `make test` work on a fresh checkout.
PYTHON ?= python3.11
ifeq ($(shell command -v $(PYTHON) 2>/dev/null),)
PYTHON := python3
endif
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
NATIVE_SOURCES := $(shell find firmware tables/native wheel -name '*.cpp' -o -name '*.hpp' -o -name CMakeLists.txt)
# One BLAS thread per process: the small matrices here gain nothing from more, and joblib's
# processes would fight over the cores.
export OPENBLAS_NUM_THREADS ?= 1
export OMP_NUM_THREADS ?= 1
# Fields of a few megabytes come and go by the thousand. Where the system hands memory out slowly,
# a quarter of a plate's time is spent on asking for what was given back a moment before.
export MALLOC_MMAP_THRESHOLD_ ?= 33554432
export MALLOC_TRIM_THRESHOLD_ ?= 536870912
export MALLOC_TOP_PAD_ ?= 67108864
# Images of Python often set it. Without .pyc files each of some hundred processes compiles all of
# Chladni, and each of pytest's all tests.
unexport PYTHONDONTWRITEBYTECODE

# What both analysers read: the core and the emulator; the bindings are mostly nanobind's.
CHECKED_SOURCES := $(filter-out firmware/esp32/emulator/bindings%, \
	$(shell find firmware/esp32/core firmware/esp32/emulator -name '*.cpp'))
CHECKED_HEADERS := $(shell find firmware/esp32/core firmware/esp32/emulator -name '*.hpp')
# A file that clang-tidy and its analyser, which follows every path, found nothing in; it is read
# again when it, a header or a rule changes. Paths are followed for 40,000 steps a function: 225,000,
# as they come, take twice as long and find nothing more.
PATHS := $(addprefix --extra-arg=,-Xclang -analyzer-config -Xclang max-nodes=40000)
TIDY := $(CHECKED_SOURCES:%=build/tidy/%.done)

.PHONY: help venv demo test all-tests long alone lint lint-types lint-style lint-cppcheck lint-generated device-suite \
	sanitize soak dist fuzz bench paper site headers native clean

help:  ## say what each target does
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 12

# Python compiles what is used when that is used first: of all that pip would, a third.
venv: $(STAMP)  ## set up .venv and build the emulator into it

$(STAMP): pyproject.toml $(NATIVE_SOURCES)
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --upgrade pip
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --editable '.[dev]'
	touch $@

demo: venv  ## run the whole chain on prototype and strip5; writes out/demo.png
	$(BIN)/python -m chladni.host.cli.demo --out out

# What each part of a test run takes, in words and seconds.
PART = f() { printf '\n== %s\n' "$$1"; shift; begun=$$(date +%s); "$$@" || exit 1; \
	printf '== done in %s s\n' $$(($$(date +%s) - begun)); }; f
# nproc would answer with the BLAS threads above.
JOBS ?= $(shell env -u OMP_NUM_THREADS nproc 2>/dev/null || echo 2)
# One more than cores: some tests wait for a page or for an emulated device.
WORKERS ?= $(shell expr $(JOBS) + 1)

# Side by side, each with its output in one piece.
BESIDE = $(MAKE) --no-print-directory --silent --output-sync=target --jobs
LINTERS := lint-style lint-cppcheck lint-generated

test: venv  ## lint, type-check and run the tests
	@$(PART) "1 of 2: style, imports, cppcheck, the device suite" $(BESIDE) $(JOBS) $(LINTERS) device-suite
	@$(PART) "2 of 2: types beside the tests, on $(JOBS) cores" \
		$(MAKE) --no-print-directory --silent --jobs 2 lint-types all-tests

# A test may call make, which is not to take this one's jobs.
all-tests:
	env -u MAKEFLAGS -u MFLAGS $(BIN)/python -m pytest -q -n $(WORKERS) --dist worksteal

# A third of them, 0 to 2; all if left out.
PART ?=
# `alone` waits more than it works: one job more than cores.
long: venv  ## clang-tidy, and the tests that take longer (tests/long_tests.py), or one third, PART= 0 to 2
	@$(BESIDE) $(WORKERS) alone $(TIDY)
	export CHLADNI_PART=$(PART); $(BIN)/python -m pytest -q -n $(WORKERS) --dist worksteal \
		-m "long and not alone" $$($(BIN)/python tests/long_tests.py)

lint: venv  ## ruff, mypy, import-linter, clang-format, clang-tidy, cppcheck (if there is one), generated headers, licences
	@$(BESIDE) $(JOBS) --keep-going lint-types $(LINTERS) $(TIDY)

alone:  # what waits for a page and a port in their own time, not among other tests
	$(BIN)/python -m pytest -q -m alone tests/docs

lint-types:
	$(BIN)/mypy

lint-style:
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports --no-logo --no-cache
	$(BIN)/clang-format --dry-run --Werror $$(git ls-files '*.cpp' '*.hpp')

build/tidy/%.done: % $(CHECKED_HEADERS) .clang-tidy pyproject.toml
	$(BIN)/clang-tidy --quiet $(PATHS) $< -- -std=c++17 -Ifirmware/esp32 2>/dev/null
	mkdir -p $(@D)
	touch $@

lint-cppcheck:
	if command -v cppcheck >/dev/null; then cppcheck --enable=warning,performance,portability \
		--std=c++17 --error-exitcode=1 --quiet -Ifirmware/esp32 $(CHECKED_SOURCES); fi

lint-generated:
	$(BIN)/python tools/generate_headers.py --check
	$(BIN)/python tools/draw_house.py --check
	$(BIN)/python tools/list_licences.py --check

device-suite:
	$(BIN)/python -m pytest -q -p pytest_embedded tests/device

# Not of the emulator's own code (other compilations, other processes), or hours that only pass, or
# the whole of a walk whose first half is taken, or other draws of what is drawn once. Then bad wires,
# which are the host's, and tables of each kind but the smallest.
UNSANITIZED := $(addprefix tests/firmware/, test_processors.py test_native_build.py test_chip_layer.py \
	test_chip_sensing.py test_chip_carrier.py test_chip_branches.py test_chip_crashes.py test_chip_iram.py test_iram.py \
	test_answers.py test_check_image.py test_components.py test_device_suite.py test_long_streams.py \
	test_finger_drives.py::test_a_processor_with_a_floating_point_unit_finds_drives_in_time \
	test_boot_log.py::test_crashes_are_forgotten_after_a_good_while \
	test_limits_walk.py::test_no_order_of_few_requests_lifts_a_limit[1] \
	test_limits_walk.py::test_no_order_of_few_requests_lifts_a_limit[2] \
	test_pins.py::test_both_sides_judge_five_thousand_configurations_alike \
	test_heat.py::test_play_until_hot_restart_and_again \
	test_heat.py::test_any_order_of_touches_streams_and_resets[2-False] \
	test_heat.py::test_any_order_of_touches_streams_and_resets[2-True] \
	test_heat.py::test_any_order_of_touches_streams_and_resets[3-False] \
	test_heat.py::test_any_order_of_touches_streams_and_resets[3-True] \
	test_heat.py::test_any_order_of_touches_streams_and_resets[4-False] \
	test_heat.py::test_any_order_of_touches_streams_and_resets[4-True] \
	test_heat.py::test_any_order_of_touches_streams_and_resets[5-False] \
	test_heat.py::test_any_order_of_touches_streams_and_resets[5-True] \
	test_pins.py::test_random_configurations_never_cost_the_link[esp32s3] \
	test_fingers_walk.py::test_whatever_fingers_do_outputs_end_in_time_and_no_limit_is_passed[1-2000] \
	test_table_store.py::test_two_cuts_at_random_places_do_no_harm_either \
	test_flash_wear.py::test_minutes_before_the_power_went_count \
	test_everything.py::test_everything_at_once_leaves_the_rules_standing[1] \
	test_everything.py::test_everything_at_once_leaves_the_rules_standing[2] \
	test_everything.py::test_everything_at_once_leaves_the_rules_standing[3] \
	test_everything.py::test_everything_at_once_leaves_the_rules_standing[4])
UNSANITIZED += $(addprefix tests/, host/test_link.py::test_a_flash_over_a_bad_wire_ends_right_or_says_that_it_failed \
	host/test_network_sessions.py::test_a_flash_over_a_bad_network_ends_right_or_says_that_it_failed \
	tables/test_format.py::test_readers_agree_on_flipped_bits_that_the_crc_allows[table0] \
	tables/test_format.py::test_readers_agree_on_flipped_bits_that_the_crc_allows[table1])

sanitize: venv  ## run the emulator's tests with the address and undefined-behaviour sanitizers
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --upgrade \
		--target build/sanitized --config-settings=cmake.define.CHLADNI_SANITIZE=ON \
		--config-settings=build-dir=build/sanitized-objects .
	LD_PRELOAD="$$(g++ -print-file-name=libasan.so) $$(g++ -print-file-name=libstdc++.so)" \
		ASAN_OPTIONS=detect_leaks=0 PYTHONPATH=build/sanitized:tests \
		CHLADNI_SANITIZED=build/sanitized $(BIN)/python -m pytest -q -n $(JOBS) -m "not soak" -p sanitized_build tests/firmware tests/host/test_link.py \
		tests/host/test_network.py tests/host/test_network_sessions.py tests/host/test_network_settings.py tests/tables/test_format.py tests/tables/test_lookup.py \
		$(UNSANITIZED:%=--deselect %)

SECONDS ?= 600
soak: venv  ## fuzz every parser and sweep over new boards and places, so long in all (SECONDS=600, FIRST_SEED=)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check 'atheris>=2.3'
	$(BIN)/python tools/soak.py --seconds $(SECONDS) $(if $(FIRST_SEED),--first $(FIRST_SEED))

dist:  ## build sdist and wheel, and run every command from them in an empty environment
	$(PYTHON) tools/try_distribution.py

FUZZ_SECONDS ?= 60
fuzz: venv  ## fuzz all parsers, each so many seconds (FUZZ_SECONDS=60); needs clang
	$(BIN)/python -m pip install --quiet --disable-pip-version-check 'atheris>=2.3'
	$(BIN)/python tools/fuzz.py --seconds $(FUZZ_SECONDS)

bench: venv  ## measure speed against error, one core; rewrites docs/performance.md and its data
	$(BIN)/python bench/page.py plate "stability --jobs 2" solve focus paper_scene tables synthesis link studio

paper: venv  ## draw the paper's figures from our own models; rewrites docs/paper.md
	cd tools && ../$(BIN)/python -m paper

site: venv  ## build the pages as a site, with a search and a reference of the Python names, into out/site
	$(BIN)/python tools/docs/build_site.py

headers: venv  ## write the C++ headers that Python declares, the drawing of the house
	$(BIN)/python tools/generate_headers.py
	$(BIN)/python tools/draw_house.py

native: venv  ## build the firmware core with PlatformIO, without its registry
	$(BIN)/python tools/platformio_offline.py .pio-core -- run -e native

clean:  ## remove everything that was built
	rm -rf $(VENV) build .pio .pio-core out

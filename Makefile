# nearfar: everything that is done often. Needs make, bash and cargo; ./setup brings the rest.
#   make render   a fresh machine to a picture: scenes/cornell-box by the three-pass method, compared with its ground truth
#   ./setup --oidn  Open Image Denoise into this folder: pictures are denoised then
#   make test     the whole test suite, on Embree and without it (installs Chromium for the pages' tests)
#   make install  the program in PREFIX/bin (/usr/local), and beside it the Embree of a private prefix, so that the checkout can go
#   make bench    ray backends and methods, measured
#   make peers    the methods beside Mitsuba 3 with and without a denoiser; SCENE=scene.toml REFERENCE=truth.exr PEERS="--size 640x360"
#   make reference, make readme   the Cornell box's ground truth, and the README's pictures and numbers, made again
#   make gallery  every scene by three methods with its ground truth, and gallery/index.html; ARGS=--quick in minutes; goes on where it stopped
#   make lint     formatting, clippy and documentation, without warnings; licences and sources of all crates
#   make fuzz     every reader fuzzed for TIME seconds (60; TARGETS="obj mtl" for some), on a nightly compiler
#   make sanitize tests and small renders under the address sanitizer and under valgrind, with Embree and without it
#   make hostile  every hostile input given to the program, its time and memory measured
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.PHONY: render install test test-embree test-bvh bench peers lint setup setup-test reference readme gallery fuzz fuzz-build sanitize hostile
.DEFAULT_GOAL := render

CARGO ?= cargo
SCENE := scenes/cornell-box/cornell-box.toml
REFERENCE := scenes/cornell-box/cornell-box.exr
OUT := out/cornell-box.exr
PREFIX ?= /usr/local
PROGRAM := target/release/nearfar

setup:
	@./setup

# What the tests need besides. The variable makes a missing browser a failure, not a skip.
setup-test:
	@./setup --test
test-embree test-bvh: export NEARFAR_TEST_BROWSER = 1

render: setup
	@$(CARGO) build --release
	@mkdir -p out
	@start=$$(date +%s.%N); target/release/nearfar render $(SCENE) -o $(OUT) --png; end=$$(date +%s.%N); \
	  echo "picture: $(OUT), $(OUT:.exr=.png)"; awk -v a=$$start -v b=$$end 'BEGIN { printf "time: %.1f s\n", b - a }'
	@echo "error against the ground truth $(REFERENCE):"
	@target/release/nearfar compare $(OUT) $(REFERENCE)

install: setup
	@$(CARGO) build --release
	@install -D $(PROGRAM) $(DESTDIR)$(PREFIX)/bin/nearfar
	@ldd $(PROGRAM) | awk '$$1 ~ /^lib(embree4|tbb)/ && $$3 !~ /^\/(usr\/)?lib/ { print $$3 }' | while read -r library; do \
	  install -D -m 644 "$$library" "$(DESTDIR)$(PREFIX)/lib/nearfar/$${library##*/}"; done
	@if [ -d .oidn/lib ]; then install -D -m 755 -t "$(DESTDIR)$(PREFIX)/lib/nearfar" .oidn/lib/*; fi
	@echo "installed: $(DESTDIR)$(PREFIX)/bin/nearfar"

test: test-embree test-bvh

test-embree: setup-test
	$(CARGO) test --release

# The same suite without Embree. A folder of its own, so that the two builds do not undo each other.
test-bvh: setup-test
	$(CARGO) test --release --no-default-features --features cli --target-dir target/bvh

# The readers' fuzz targets. What is found is in fuzz/artifacts; reduced, it becomes a seed called found-….
TIME ?= 60
TARGETS ?= $(basename $(notdir $(wildcard fuzz/fuzz_targets/*.rs)))
HOST := x86_64-unknown-linux-gnu
FUZZER := fuzz/target/$(HOST)/release
fuzz-build:
	@$(CARGO) fuzz --version >/dev/null 2>&1 || $(CARGO) install cargo-fuzz --locked
	$(CARGO) +nightly fuzz build --release --target $(HOST)

fuzz: fuzz-build
	@for target in $(TARGETS); do mkdir -p fuzz/corpus/$$target fuzz/artifacts/$$target; log=fuzz/artifacts/$$target.log; \
	  ASAN_OPTIONS=detect_leaks=0 $(FUZZER)/$$target fuzz/corpus/$$target fuzz/seeds/$$target -max_total_time=$(TIME) -timeout=10 \
	    -rss_limit_mb=3000 -max_len=16384 -artifact_prefix=fuzz/artifacts/$$target/ >$$log 2>&1 || { tail -40 $$log; exit 1; }; \
	  echo "$$target: $$(grep ^Done $$log)"; \
	done

# Embree and its threads have no leaks of ours to tell: what a process holds at its end is not looked for.
sanitize: setup fuzz-build
	@for target in $(TARGETS); do ASAN_OPTIONS=detect_leaks=0 $(FUZZER)/$$target -runs=0 fuzz/seeds/$$target >/dev/null 2>&1 \
	  || { echo "$$target: its seeds are not clean"; exit 1; }; done; echo "seeds of all readers without Embree: clean"
	ASAN_OPTIONS=detect_leaks=0 NEARFAR_OIDN=none RUSTFLAGS=-Zsanitizer=address $(CARGO) +nightly test --release \
	  --target $(HOST) --target-dir target/asan --test nearfar -- readers:: broken:: faults:: conformance:: every_layer two_scenes
	@$(CARGO) build --release
	@for backend in embree bvh; do for method in decomposition path gather irradiance-cache point-based; do \
	  NEARFAR_OIDN=none LD_LIBRARY_PATH=.embree/lib valgrind -q --fair-sched=yes --error-exitcode=9 \
	    target/release/nearfar render $(SCENE) -q --size 8x6 --threads 2 --backend $$backend --method $$method --spp 2 \
	    --set proxy.photons=200 --set decompose.rays=8 --set gather.rays=4 --set cache.rays=16 --set point_based.elements=500 \
	    -o target/valgrind.exr && echo "$$method on $$backend under valgrind: clean" || exit 1; done; done

hostile: setup
	$(CARGO) test --release every_hostile_input -- --ignored --nocapture

reference: setup
	@$(CARGO) build --release
	target/release/nearfar reference $(SCENE) --spp 2048 --no-state --half --aov half0,half1 -o $(REFERENCE)

readme: setup
	@$(CARGO) build --release
	@.ci/readme

gallery: setup
	@$(CARGO) build --release
	target/release/nearfar gallery $(ARGS)

bench: setup
	@$(CARGO) build --release
	target/release/nearfar bench $(SCENE) --backends
	target/release/nearfar bench $(SCENE) --methods --reference $(REFERENCE) --gather-reference --chart out/methods.svg

peers: setup
	@$(CARGO) build --release
	@python3 tests/peers/compare.py $(SCENE) --reference $(REFERENCE) $(PEERS)

lint: setup
	$(CARGO) fmt --check
	$(CARGO) clippy --release --all-targets -- -D warnings
	$(CARGO) clippy --release --all-targets --no-default-features --features cli --target-dir target/bvh -- -D warnings
	$(CARGO) check --release --no-default-features --target-dir target/bvh
	$(CARGO) check --release --no-default-features --features embree
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --release --no-deps
	$(CARGO) deny --version >/dev/null 2>&1 || $(CARGO) install cargo-deny --locked
	$(CARGO) deny check licenses bans sources

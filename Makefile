# nearfar: everything that is done often. Needs make, bash and cargo; ./setup brings the rest.
#   make render   a fresh machine to a picture: scenes/cornell-box by the three-pass method, compared with its ground truth
#   make test     the whole test suite, on Embree and without it (installs Chromium for the pages' tests)
#   make install  the program in PREFIX/bin (/usr/local), and beside it the Embree of a private prefix, so that the checkout can go
#   make bench    ray backends and methods, measured
#   make peers    the methods beside Mitsuba 3 with and without a denoiser; SCENE=scene.toml REFERENCE=truth.exr PEERS="--size 640x360"
#   make reference, make readme   the Cornell box's ground truth, and the README's pictures and numbers, made again
#   make gallery  every scene by three methods with its ground truth, and gallery/index.html; ARGS=--quick in minutes; goes on where it stopped
#   make fuzz     every reader of user files on made-up bytes, one after another; TIME=600 seconds each, READERS="film obj" some of them
#   make lint     formatting, clippy and documentation, without warnings; licences and sources of all crates
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.PHONY: render install test test-embree test-bvh bench peers lint setup setup-test reference readme gallery fuzz
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
	@echo "installed: $(DESTDIR)$(PREFIX)/bin/nearfar"

test: test-embree test-bvh

test-embree: setup-test
	$(CARGO) test --release

# Needs the nightly toolchain, for this alone. New inputs go to fuzz/found, what went wrong to fuzz/artifacts; the corpus is for made files.
TIME ?= 120
READERS ?= $(shell sed -n 's/^name = "\([a-z_]*\)"$$/\1/p' fuzz/Cargo.toml)
fuzz:
	@$(CARGO) fuzz --version >/dev/null 2>&1 || $(CARGO) install cargo-fuzz --locked
	@wrong=; for reader in $(READERS); do \
	  mkdir -p fuzz/found/$$reader; echo "== $$reader"; \
	  (cd fuzz && $(CARGO) +nightly fuzz run $$reader found/$$reader corpus/$$reader -- \
	    -max_total_time=$(TIME) -timeout=10 -rss_limit_mb=2048 -max_len=8192 -print_final_stats=1) || wrong="$$wrong $$reader"; \
	done; rm -rf "$${TMPDIR:-/tmp}"/nearfar-readers-*; if [ -n "$$wrong" ]; then echo "went wrong:$$wrong"; exit 1; fi

# The same suite without Embree. A folder of its own, so that the two builds do not undo each other.
test-bvh: setup-test
	$(CARGO) test --release --no-default-features --features cli --target-dir target/bvh

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

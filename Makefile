# The developer's front door: each target installs what is missing (packages.txt), builds what has changed, and does its
# one thing. Variables, as in `make test JOBS=4`:
JOBS ?= $(shell nproc)
PREFIX ?= /usr/local
FUZZ_SECONDS ?= 60
LONG ?= $(or $(KELLER_LONG),0)
WERROR ?= true

# Debian's own Python and meson, where there are any: another Python that comes first on PATH may lack h5py.
PYTHON := $(firstword $(wildcard /usr/bin/python3) python3)
MESON := $(firstword $(wildcard /usr/bin/meson) meson)
KELLER := build/release/src/cli/keller

# The builds. `checked` is both the second compiler, its warnings errors too, and the sanitizers.
OPTIONS_release = --prefix=$(PREFIX) --buildtype=release
# What lets a finding name its line, and no more: whole debugging information takes a sixth of the time.
CHECKED_ARGS = -gline-tables-only -fno-sanitize-recover=all
OPTIONS_checked = -Doptimization=1 -Db_sanitize=address,undefined -Db_lundef=false -Dbench=false \
    -Dc_args='$(CHECKED_ARGS)' -Dcpp_args='$(CHECKED_ARGS)'
OPTIONS_fuzz = -Doptimization=1 -Ddebug=true -Dfuzz=true
COMPILER_release = CC=gcc CXX=g++
COMPILER_checked = CC=clang CXX=clang++ CC_LD=lld CXX_LD=lld
COMPILER_fuzz = CC=clang CXX=clang++

.PHONY: help demo test build bench fuzz install clean setup build-release build-checked

help:
	@echo 'make demo      run configs/street_canyon.xml: street_canyon.h5, a summary, street_canyon.png'
	@echo 'make test      every test, built with gcc; the quick ones again, built with clang and sanitizers;'
	@echo '               LONG=1 draws all random cases, not a part'
	@echo 'make build     the program, optimised: $(KELLER)'
	@echo 'make bench     the measurements under bench/'
	@echo 'make fuzz      each fuzz target for FUZZ_SECONDS (now $(FUZZ_SECONDS)) seconds'
	@echo 'make install   program, library and headers under PREFIX (now $(PREFIX)); DESTDIR is honoured'
	@echo 'make clean     delete what was built'

setup:
	@tools/setup.sh

# Configured anew when this file changes; ninja itself watches the meson.build files.
build/%/build.ninja: Makefile | setup
	@mkdir -p $(@D)
	@$(COMPILER_$*) $(MESON) setup $(if $(wildcard $(@D)/meson-private/coredata.dat),--reconfigure) $(@D) \
	    -Dwerror=$(WERROR) $(OPTIONS_$*) > build/$*.log 2>&1 || { tail -n 6 build/$*.log; rm -f $@; exit 1; }
	@touch $@

build-release build-checked: build-%: build/%/build.ninja | setup
	@ninja --quiet -C build/$* -j $(JOBS)

build: build-release
	@echo 'built $(KELLER)'

demo: build-release
	@if $(MAKE) -q street_canyon.png; then \
	    echo 'demo: nothing has changed since the last run'; $(KELLER) info street_canyon.h5; \
	else $(MAKE) --no-print-directory street_canyon.png; fi
	$(KELLER) paths street_canyon.h5 --rx far --strongest 5
	@echo 'demo: the result is street_canyon.h5, its picture street_canyon.png'

street_canyon.h5: $(KELLER) $(wildcard configs/street_canyon*) data/scenes/street_canyon.obj
	$(KELLER) run configs/street_canyon.xml -o $@ --force

street_canyon.png: street_canyon.h5
	$(KELLER) plot street_canyon.h5 --what coverage -o $@ --force

# Builds by itself, so that a failed build is counted and the other one still runs.
test: setup
	@KELLER_LONG=$(LONG) MESON=$(MESON) $(PYTHON) tools/test.py --jobs $(JOBS) release checked:quick

bench: build-release
	@MESON=$(MESON) $(PYTHON) tools/bench.py build/release

fuzz: build/fuzz/build.ninja
	@MESON=$(MESON) $(PYTHON) tools/fuzz.py build/fuzz --seconds $(FUZZ_SECONDS) --jobs $(JOBS)

install: build-release
	@$(MESON) install -C build/release --no-rebuild

clean:
	rm -rf build street_canyon.h5 street_canyon.png

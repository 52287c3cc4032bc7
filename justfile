# Recipes of the project; `just ci` is what continuous integration runs.

# The Python package is a workspace of its own.
python := "--manifest-path python/Cargo.toml"

# All that is optional is checked too.
all := "--features lgvi_tests/zenoh,lgvi_tests/security,lgvi_tests/object-store,lgvi/object-store"

default:
    @just --list

# Everything that must hold before a change lands.
ci: fmt words book package tests-and-checks

# Tests wait for half of their time. What checks the sources fills it, and does not depend on what runs beside it.
[parallel, private]
tests-and-checks: test patient-checks python

# Builds of the tests and of these take turns, and share macros and build scripts.
[private]
patient-checks:
    nice -n 19 just lint docs instructions

# The sources are formatted.
fmt:
    cargo fmt --all --check
    cargo fmt {{python}} --check

# Spelling and prose.
words: book-env
    target/book-env/bin/codespell
    git ls-files '*.md' ':!:*vendor*' | xargs target/book-env/bin/proselint --config .proselintrc.json check

# Licenses and sources of all dependencies. Not in CI: cargo-deny takes a minute to build.
deny:
    cargo deny --version >/dev/null 2>&1 || cargo install cargo-deny --locked --debug
    cargo deny --all-features check licenses bans sources

# Known vulnerabilities; needs the network.
advisories:
    cargo deny --all-features check advisories

# Static programs, for any Linux of this architecture.
static:
    packaging/static

# A Debian package of static programs.
debian:
    packaging/debian

# The documentation as a book in target/book; all links resolve.
book: book-env
    NO_MKDOCS_2_WARNING=1 target/book-env/bin/mkdocs build --quiet

[private]
book-env:
    python3 -m venv target/book-env
    target/book-env/bin/pip install --quiet --disable-pip-version-check --requirement docs/book/requirements.txt

# No warning of the compiler or of clippy; without optional features it compiles, too.
lint:
    cargo clippy --workspace --all-targets --locked {{all}} -- -D warnings
    cargo clippy {{python}} --all-targets --locked --features shared -- -D warnings
    cargo check --locked

# The documentation builds, all links resolve.
docs:
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked {{all}}

# The library crates can be published.
package:
    cargo package --no-verify --allow-dirty --locked -p lgvi_lie -p lgvi_dynamics -p lgvi_control -p lgvi_scene

# All tests: the README's second command.
test:
    tests/run

# The Python package: its wheel is built and tested, with its types, examples, documentation and notebooks.
python: python-env
    target/python/env/bin/maturin build --quiet --profile dev {{python}} --locked --features shared --out target/python/wheels
    target/python/env/bin/pip install --quiet --disable-pip-version-check --force-reinstall --no-deps target/python/wheels/lgvi-*.whl
    cd python && ../target/python/env/bin/mypy
    cd python && ../target/python/env/bin/python -m pytest --quiet -p no:cacheprovider
    target/python/env/bin/python python/notebooks/execute.py

[private]
python-env:
    python3 -m venv target/python/env
    target/python/env/bin/pip install --quiet --disable-pip-version-check --requirement python/requirements.txt

# The wheel of the Python package in target/python/wheels, for all versions of Python on Linux of this architecture.
wheel: python-env
    target/python/env/bin/maturin build --release {{python}} --locked --out target/python/wheels

# What Python adds to the time of flights and steps, beside Rust alone, and two workers beside one. For a machine that does nothing else.
python-bench: wheel
    target/python/env/bin/pip install --quiet --disable-pip-version-check --force-reinstall --no-deps target/python/wheels/lgvi-*.whl
    target/python/env/bin/python python/benchmarks/overhead.py
    target/python/env/bin/python python/benchmarks/workers.py

# The README's first command, headless. Not in CI: it builds everything once more, in release.
demo:
    cargo run --release --locked -- run scenes/inclination_change.toml --output target/demo_$(date +%s)

# The tests with rclpy and colcon over another ROS 2: `just ros kilted`.
ros distribution:
    LGVI_TEST_ROS={{distribution}} cargo nextest run --workspace --locked {{all}} \
        -E 'test(/^(clock|instances|interfaces|launch_file|packages|parameter_files|plugging_in|real_cdr|real_launch|real_ros|suspended|two_hosts)::/)'

# Zenoh beside a node of hiroz, another implementation. Not in CI: hiroz takes minutes to build.
zenoh-peer:
    cargo build --manifest-path tests/zenoh_peer/Cargo.toml --locked
    HIROZ_PEER=$PWD/target/debug/zenoh_peer cargo nextest run --workspace --locked {{all}} --run-ignored only -E 'test(hiroz)'

# The fuzz targets for some seconds each, by hand: the tests run their corpora and mutants of them without cargo-fuzz.
fuzz seconds="5":
    tests/fuzz/run {{seconds}}

# No hot kernel takes more instructions than are kept for it, within 3 %. Built as the tests build it, once.
instructions *arguments:
    cargo build --release --workspace --example fly --bin lgvi_guard --locked {{all}}
    "${CARGO_TARGET_DIR:-target}"/release/lgvi_guard {{arguments}}

# The instructions that the hot kernels take now are kept.
instructions-update: (instructions "--update")

# The trials of docs/stability.md in full.
stress *family:
    cargo run --release --locked -p lgvi_bench -- stress {{family}}

# How soon plans made in flight are there, ten times a second, on the machine as it is and on a loaded one. Four minutes.
replanning *arguments:
    cargo build --release --locked -p lgvi --bin lgvi
    python3 crates/bench/replanning/measure.py {{arguments}}

# The libraries of the page of `lgvi report` are bundled anew. Needs npm, which a build of lgvi does not.
report-bundle:
    nodes/lgvi/src/report/bundle/make

# Reference bags are made anew.
bags:
    bags/regenerate

# The JSON Schema of scenes is made anew from the types that read them.
schema:
    UPDATE_SCHEMA=1 cargo nextest run --package lgvi_scene -E 'test(the_schema_is_that_of_the_types)'

# All benchmarks beside all peers; replaces the tables and pictures of docs. Some 35 minutes, of a machine that does nothing else.
bench *arguments:
    cargo build --release --locked --workspace
    cargo run --release --locked -p lgvi_bench -- all --python "$(python3 crates/bench/peers/environment.py)" --docs docs {{arguments}}

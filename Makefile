# `make help` lists what there is. The work is in scripts/; each target installs what it lacks first.
PHOTO ?=
OUT ?= results/local

.DEFAULT_GOAL := help
.PHONY: help demo test test-full sheets photos bench scoreboard chains fuzz lock clean

help: ## this list
	@grep -E '^[a-z-]+:.*##' Makefile | sed -E 's/:.*## /\t/' | expand -t 14

demo: ## build, and turn the sample photograph (or PHOTO=path) into a model
	@scripts/demo "$(PHOTO)" "$(OUT)/demo"

test: ## all tests, with the checks by OpenCV, scikit-image, Open3D, OpenImageIO, flip-evaluator, the Khronos validator and three.js
	@scripts/test

test-full: ## the tests, and Blender opens and renders models and baked trees (installs another 0.9 GB)
	@scripts/test full

sheets: ## contact sheets of every photograph, preset and representation into results/local
	@scripts/setup demo
	cargo run --release --locked --example contact_sheets
	cargo run --release --locked --example preset_sheet
	cargo run --release --locked --example method_sheet
	cargo run --release --locked --example resemblance

photos: ## the sample photographs of grown trees anew, into photos/
	@scripts/photos

bench: ## the benchmarks, into results/<date>-<cores>-core-cpu
	@scripts/bench

scoreboard: ## every method on three grown trees, into results/scoreboard
	@scripts/scoreboard

chains: ## what `grove --method auto` draws each preset with, anew by comparing them: src/grove/chains.json
	cargo run --release --locked --example grove_chains

fuzz: ## a minute each of random pictures through decode, segment and model, and of damaged models through import (FUZZ_SECONDS=n for longer)
	@scripts/fuzz

lock: ## write the Python and npm lock files anew, with the newest versions
	@scripts/lock

clean: ## remove everything that was built or installed here
	rm -rf target fuzz/target tests/js/node_modules results/local

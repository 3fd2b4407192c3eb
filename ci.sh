#!/usr/bin/env bash
# Every check as a named job, for those who do not use cargo's alias: xtask/src/main.rs.
cd "$(dirname "$0")" && exec cargo xtask "$@"

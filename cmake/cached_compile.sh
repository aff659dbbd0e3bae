#!/usr/bin/env bash
# COMPILER ARGUMENTS...: compiles through ccache, with the same objects for every clone whatever its folder: paths below it
# are made relative. In depend mode ccache gets the includes from the compiler and never runs the preprocessor.
set -euo pipefail
export CCACHE_BASEDIR=${0%/cmake/*} CCACHE_NOHASHDIR=1 CCACHE_DEPEND=1
# Macros and times of precompiled headers ccache cannot see.
export CCACHE_SLOPPINESS=pch_defines,time_macros
# GCC writes other bytes each time that it precompiles a header: who uses one is known by what it was made of.
export CCACHE_PCH_EXTSUM=1
case "$* " in
  *.gch\ *) ;;
  *) exec ccache "$@" ;;
esac

before=
for word in "$@"; do
  case $before in
    -o) out=$word ;;
    -MF) includes=$word ;;
  esac
  before=$word
done
rm -f "$out" "$out.sum"
ccache "$@"
sed -e '1s/^[^:]*://' -e 's/\\$//' "$includes" | tr -s ' ' '\n' | sed '/^$/d' | sort -u | xargs cat | sha256sum >"$out.sum"

#!/usr/bin/env bash
# COMPILER ARGUMENTS...: compiles through ccache, with the same objects for every clone whatever its folder: paths below it
# are made relative. In depend mode ccache gets the includes from the compiler and never runs the preprocessor.
#
# GCC writes other bytes each time that it precompiles a header, and ccache would take them for another header. So ccache
# sees a copy of the header without its precompiled form, and this script, run again by ccache as CCACHE_PREFIX, gives the
# compiler the original. With -fpch-deps the compiler lists what the header includes, precompiled or not.
set -euo pipefail
arguments=("$@") header=
for ((k = 1; k < $#; ++k)); do
  [[ ${arguments[k - 1]} != -include || ${arguments[k]} != *.hxx ]] || header=$k  # Clang has others
done

if [ -n "${CCACHE_PREFIX:-}" ]; then
  arguments[header]=${arguments[header]%.plain.hxx}
  exec "${arguments[@]}"
fi

export CCACHE_BASEDIR=${0%/cmake/*} CCACHE_NOHASHDIR=1 CCACHE_DEPEND=1
# Macros and times of precompiled headers ccache cannot see.
export CCACHE_SLOPPINESS=pch_defines,time_macros
if [ -n "$header" ]; then
  plain=${arguments[header]}.plain.hxx
  case "$* " in
    # The header itself. What an earlier compilation left would be taken for one of its includes.
    *.gch\ *)
      cp "${arguments[header]}" "$plain"
      for ((k = 1; k < $#; ++k)); do
        [ "${arguments[k - 1]}" != -o ] || rm -f "${arguments[k]}"
      done ;;
    *)
      arguments[header]=$plain
      arguments+=(-fpch-deps)
      export CCACHE_PREFIX=$0 ;;
  esac
fi
exec ccache "${arguments[@]}"

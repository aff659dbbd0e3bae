#!/usr/bin/env bash
# Correctness and benchmarks on a machine with a GPU, from programs and libraries that are carried there.
# Plain bash and coreutils: the machine needs nothing else but a GL driver and a C library no older than ours.
set -euo pipefail

usage() {
  cat <<'TEXT'
Usage: gpu_round.sh pack DIR                          build, and gather into DIR everything that the other
                                                      machine needs; DIR.tar.gz is the same in one file
       DIR/gpu_round.sh run DIR OUT [OPTIONS]         there: tests, then benchmarks; OUT/summary.txt, OUT/results.tar.gz

Options of run:
  --allow-software   accept a software renderer (llvmpipe); without it that is an error
  --limit-s=N        wall time of everything (default 540)
  --suites-s=N       of it, kept for the test suites after the benchmarks (default 170)
  --bench-s=N        wall time of `drape_bench all` (default 90)
  --speed-s=N        wall time of `drape_bench speed` (default 160)

Exit status of run: 0 all tests passed; 1 a test failed or did not end; 2 usage; 3 no OpenGL 4.5, or only software.
TEXT
}

die() { printf 'gpu_round: error: %s\n' "$1" >&2; exit "${2:-1}"; }
say() { printf '%s\n' "$*"; }

programs=(draped drape drape_bench)
# Suites that the GL backend must pass; one that this version of the tree does not have yet is named and left out.
suites=(gl_test gl_compute_test gl_draw_test parity_test physics_test stability_test scheduler_test system_test)
# Suites whose long cases run too, in the remaining time.
long_suites=(stability_test)
# Suites that take longest, in so many processes.
declare -A shards=([gl_compute_test]=4 [parity_test]=4 [physics_test]=3 [stability_test]=2)
# Before anything is measured: the kernels give the right bits at all.
smoke='StripHalvesTest.*:SharedRecordTest.*:RootsTest.*:*StripParityTest.*/gl:StripReductionTest.*'
smoke+=':*/BitExactnessTest.*/gl*:GlBackendTest.FreeFallIsExact:GlBackendTest.HangingGrid*:GlBackendTest.LocalSize*'
# Parts of `drape_bench speed` and their shares of its time [%]; those that matter most on a GPU come first.
speed_parts=(kernels:20 cost:30 limits:5 local_sizes:25 skips:5 curve:10 service:5)
files=(shaders client/examples tests/bench/scenes)
preloads=(liblost_device.so)  # that suites put before the driver
max_pack_mib=50  # of DIR.tar.gz

# Loaded by name at run time, so ldd does not list them: the vendor-neutral loader of GL drivers.
gl_loader='libEGL\.so\.1|libOpenGL\.so\.0|libGLdispatch\.so\.0'
# Part of glibc: never carried.
glibc_part='^(linux-vdso|ld-linux.*|libc|libm|libdl|libpthread|librt|libresolv|libutil|libanl)\.so'
# Carried in case the machine has none; its own come first, because its GL driver was built against them.
if_missing='^(libstdc\+\+|libgcc_s|libz|libEGL|libGLdispatch|libOpenGL)\.so'

# --- pack ---------------------------------------------------------------------------------------------------------------

shared_libraries() {
  local name path
  { ldd "$1"/bin/*; ldconfig -p | sed -nE "s/^\t($gl_loader) .* => (.*)$/\t\1 => \2/p"; } |
    awk '$2 == "=>" && $3 ~ /^\// {print $1, $3}' | sort -u | while read -r name path; do
      [[ $name =~ $glibc_part ]] || echo "$name $path"
    done
}

pack() {
  local root dir name path program suite built=() absent=()
  root=$(cd "$(dirname "$(readlink -f "$0")")/../.." && pwd)
  mkdir -p "$1"
  dir=$(cd "$1" && pwd)
  [ -z "$(ls -A "$dir")" ] || [ -f "$dir/COMMIT" ] || die "$dir is not empty and not a pack"
  cd "$root"
  local targets; targets=$(ninja -C build/release -t targets all 2>/dev/null | sed -n 's/: phony$//p')
  for suite in "${suites[@]}"; do
    if grep -qx "$suite" <<<"$targets"; then built+=("$suite"); else absent+=("$suite"); fi
  done
  ninja -C build/release "${programs[@]}" "${built[@]}" "${preloads[@]/#/bin/}"
  rm -rf "${dir:?}"/{bin,lib,lib-if-missing,shaders,client,tests}
  mkdir -p "$dir"/{bin,lib,lib-if-missing}
  for program in "${programs[@]}" "${built[@]}"; do strip -o "$dir/bin/$program" "build/release/bin/$program"; done
  for name in "${preloads[@]}"; do cp "build/release/bin/$name" "$dir/bin/"; done
  shared_libraries "$dir" | while read -r name path; do
    if [[ $name =~ $if_missing ]]; then cp -L "$path" "$dir/lib-if-missing/$name"; else cp -L "$path" "$dir/lib/$name"; fi
  done
  for path in "${files[@]}"; do
    mkdir -p "$dir/$(dirname "$path")"
    cp -r "$path" "$dir/$(dirname "$path")/"
  done
  cp tests/bench/gpu_round.sh "$dir/"
  git describe --always --dirty >"$dir/COMMIT"
  objdump -T "$dir"/bin/* "$dir"/lib/* "$dir"/lib-if-missing/* 2>/dev/null | grep -o 'GLIBC_2\.[0-9]*' | sort -uV | tail -n 1 |
    sed 's/GLIBC_//' >"$dir/GLIBC"
  tar -C "$(dirname "$dir")" -czf "$dir.tar.gz" "$(basename "$dir")"
  local mib; mib=$(du -sm "$dir.tar.gz" | cut -f1)
  say "packed ${#programs[@]} programs, ${#built[@]} test suites and $(ls "$dir/lib" "$dir/lib-if-missing" | grep -c '\.so') libraries:" \
    "$(du -sm "$dir" | cut -f1) MiB in $dir, $mib in $dir.tar.gz; needs glibc $(cat "$dir/GLIBC")"
  [ ${#absent[@]} -eq 0 ] || say "not in this tree: ${absent[*]}"
  [ "$mib" -le $max_pack_mib ] || die "more than $max_pack_mib MiB"
}

# --- run ----------------------------------------------------------------------------------------------------------------

# The loader's list is read once. `ldconfig -p | grep -q` would fail now and then: grep ends at the match, ldconfig
# dies of writing on, and pipefail makes that the result.
libraries=
read_libraries() { libraries=$(ldconfig -p 2>/dev/null || /sbin/ldconfig -p 2>/dev/null || :); }
has_library() { [[ $libraries == *$'\t'"$1 "* ]]; }

# First file of that path on the machine, for drivers that lie outside the places the loader looks in.
find_file() {
  find /usr/local/nvidia /usr/lib /usr/lib64 /usr/local/lib /usr/local/share /opt -maxdepth 4 -path "$1" -print -quit 2>/dev/null || :
}

# Points the loader at the carried libraries and EGL at the vendor's driver.
set_up_libraries() {
  local name library vendor driver=
  read_libraries
  mkdir -p "$work/lib"
  for library in "$dir"/lib-if-missing/*; do
    name=$(basename "$library")
    has_library "$name" || ln -sf "$library" "$work/lib/$name"
  done
  export LD_LIBRARY_PATH="$dir/lib:$work/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
  say "carried because the machine has none: $(ls "$work/lib" | tr '\n' ' ')"
  # A driver mounted into a container may have no entry in the loader's cache, or no vendor file.
  if ! has_library libEGL_nvidia.so.0; then
    driver=$(find_file '*/libEGL_nvidia.so.0')
    [ -z "$driver" ] || { say "driver outside the loader's cache: $driver"; LD_LIBRARY_PATH+=:$(dirname "$driver"); }
  fi
  [ -z "${__EGL_VENDOR_LIBRARY_FILENAMES:-}" ] || { say "vendor file as given: $__EGL_VENDOR_LIBRARY_FILENAMES"; return 0; }
  grep -qsl nvidia /usr/share/glvnd/egl_vendor.d/*.json /etc/glvnd/egl_vendor.d/*.json && return 0
  vendor=$(find_file '*/egl_vendor.d/*nvidia*.json')
  if [ -z "$vendor" ] && { has_library libEGL_nvidia.so.0 || [ -n "$driver" ]; }; then
    vendor=$work/10_nvidia.json
    printf '{"file_format_version": "1.0.0", "ICD": {"library_path": "libEGL_nvidia.so.0"}}\n' >"$vendor"
  fi
  [ -z "$vendor" ] || { say "vendor file: $vendor"; export __EGL_VENDOR_LIBRARY_FILENAMES=$vendor; }
}

check_glibc() {
  local needed own
  needed=$(cat "$dir/GLIBC")
  own=$(getconf GNU_LIBC_VERSION 2>/dev/null | awk '{print $2}')
  [ "$(printf '%s\n%s\n' "$needed" "$own" | sort -V | head -n 1)" = "$needed" ] ||
    die "glibc $own here, the programs need $needed: pack on an older Debian" 3
}

describe_machine() {
  uname -a
  grep PRETTY_NAME /etc/os-release || :
  grep -m 1 'model name' /proc/cpuinfo || :
  say "cores: $(nproc)"
  if command -v nvidia-smi >/dev/null; then
    nvidia-smi || :
    nvidia-smi -q -d CLOCK,POWER,TEMPERATURE 2>/dev/null | head -n 60 || :
    nvidia-smi --query-gpu=name,uuid,pci.bus_id,mig.mode.current,compute_mode --format=csv || :
  else
    say "no nvidia-smi"
  fi
  ldconfig -p 2>/dev/null | grep -E 'libEGL|libGLX|libOpenGL|libGLdispatch|libnvidia-(gl|egl)' || :
  ls -l /dev/nvidia* /dev/dri 2>/dev/null || :
}

# Results are saved now: a run that is killed later leaves those of the parts before.
keep() {
  cp "$work/summary.txt" "$out/summary.txt"
  tar -C "$work" -czf "$out/results.tar.gz.new" summary.txt log xml bench && mv "$out/results.tar.gz.new" "$out/results.tar.gz"
}

# tell KIND NAME EXIT_STATUS SECONDS: the line of a part in the summary, with its first errors. KIND: test (must pass),
# long (must not fail; may be cut off by the time limit of everything), bench (only reported). No exit status: no time.
failures=0
tell() {
  local kind=$1 name=$2 code=$3 seconds=$4 status=passed count failed
  case $code in 0) ;; '') status='no time' ;; 124 | 137) status='timed out' ;; *) status="FAILED ($code)" ;; esac
  case $kind:$status in
    *:passed | bench:* | long:'timed out' | long:'no time') ;;
    *) failures=$((failures + 1)) ;;
  esac
  count=$(grep -c '^\[       OK \]' "$work/log/$name.log" 2>/dev/null || :)
  failed=$(grep -c '^\[  FAILED  \] .* ms)$' "$work/log/$name.log" 2>/dev/null || :)
  [ "$kind" = bench ] || [ "${count:-0}${failed:-0}" = 00 ] || count="$count ok, $failed failed"
  [ "${count:-0}" != 0 ] || count=-
  printf '%-20s %-12s %6d s  %s\n' "$name" "$status" "$seconds" "$count" | tee -a "$work/summary.txt"
  [ "$status" = passed ] || [ ! -f "$work/log/$name.log" ] ||
    grep -m 20 -E 'Failure$|^\[  FAILED  \]|error|check failed' "$work/log/$name.log" | cut -c1-200 | sed 's/^/    /' || :
  keep
}

# limited SECONDS NAME COMMAND...: its output in a log; fails with its exit status, 124 or 137 where time was up.
limited() {
  local limit=$1 name=$2
  shift 2
  timeout --kill-after=5 "$limit" "$@" >"$work/log/$name.log" 2>&1 &
  local process=$! code=0
  : >"$work/running/$process"
  wait $process || code=$?  # a signal to this script interrupts it, which a command in the foreground would not allow
  rm -f "$work/running/$process"
  return $code
}

# part KIND NAME SECONDS COMMAND...: one part under its own limit, which leaves the suites their time.
part() {
  local kind=$1 name=$2 limit=$3 code=0 start=$SECONDS
  local left=$((deadline - suites_s - SECONDS))
  shift 3
  [ "$limit" -le "$left" ] || limit=$left
  if [ "$limit" -lt 2 ]; then
    tell "$kind" "$name" '' 0
  else
    limited "$limit" "$name" "$@" || code=$?
    tell "$kind" "$name" $code $((SECONDS - start))
  fi
}

# start KIND NAME COMMAND...: one of the parts that run at the same time, until the time of everything is over.
started=()
start() {
  local kind=$1 name=$2 limit=$((deadline - SECONDS))
  shift 2
  started+=("$kind:$name")
  if [ "$limit" -lt 2 ]; then
    echo "- $SECONDS" >"$work/ended/$name"
    return 0
  fi
  {
    local code=0
    limited "$limit" "$name" "$@" || code=$?
    echo "$code $SECONDS" >"$work/ended/$name.new" && mv "$work/ended/$name.new" "$work/ended/$name"
  } &
}

# Tells each of the started parts as it ends.
finish() {
  local part kind name code end begin=$SECONDS waiting=("${started[@]}") still
  while [ ${#waiting[@]} -gt 0 ]; do
    still=()
    for part in "${waiting[@]}"; do
      kind=${part%%:*} name=${part#*:}
      if [ -f "$work/ended/$name" ]; then
        read -r code end <"$work/ended/$name"
        tell "$kind" "$name" "${code#-}" $((end - begin))
      else
        still+=("$part")
      fi
    done
    waiting=("${still[@]}")
    [ ${#waiting[@]} -eq 0 ] || sleep 0.2
  done
}

# start_suite KIND NAME FILTER PROGRAM SHARDS
start_suite() {
  local kind=$1 name=$2 filter=$3 program=$4 count=$5 shard of
  [ -x "$dir/bin/$program" ] || return 0
  for ((shard = 0; shard < count; ++shard)); do
    of=$name
    [ "$count" -eq 1 ] || of=${name}_$shard
    start "$kind" "$of" env GTEST_TOTAL_SHARDS="$count" GTEST_SHARD_INDEX=$shard "$dir/bin/$program" \
      --gtest_filter="$filter" --gtest_output="xml:$work/xml/$of.xml"
  done
}

# One process before the benchmarks.
smoke_of() {
  [ -x "$dir/bin/$2" ] || return 0
  part test "$1" 60 "$dir/bin/$2" --gtest_filter="$3" --gtest_output="xml:$work/xml/$1.xml"
}

# What was under way ends, and what there is is kept.
cut_off() {
  say "cut off after $SECONDS s" | tee -a "$work/summary.txt"
  local running
  for running in "$work"/running/*; do kill "$(basename "$running")" 2>/dev/null || :; done
  keep
  exit 1
}

run() {
  local allow_software=0 limit_s=540 bench_s=90 speed_s=160
  suites_s=170
  [ $# -ge 2 ] || { usage >&2; exit 2; }
  dir=$(cd "$1" && pwd)
  mkdir -p "$2"
  out=$(cd "$2" && pwd)
  shift 2
  for argument in "$@"; do
    case $argument in
      --allow-software) allow_software=1 ;;
      --limit-s=*) limit_s=${argument#*=} ;;
      --suites-s=*) suites_s=${argument#*=} ;;
      --bench-s=*) bench_s=${argument#*=} ;;
      --speed-s=*) speed_s=${argument#*=} ;;
      *) usage >&2; die "unknown argument '$argument'" 2 ;;
    esac
  done
  local number
  for number in "$limit_s" "$suites_s" "$bench_s" "$speed_s"; do
    [[ $number =~ ^[1-9][0-9]*$ ]] || die "--limit-s, --suites-s, --bench-s and --speed-s are whole seconds above 0" 2
  done
  [ "$suites_s" -le $((limit_s / 2)) ] || suites_s=$((limit_s / 2))
  [ -f "$dir/COMMIT" ] || die "$dir was not made by 'gpu_round.sh pack'" 2
  unset GTEST_TOTAL_SHARDS GTEST_SHARD_INDEX  # whoever called may be a shard itself
  deadline=$((SECONDS + limit_s))
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
  trap cut_off INT TERM HUP
  mkdir -p "$work"/{log,xml,bench,ended,running}
  : >"$work/summary.txt"
  export DRAPE_TEST_ROOT=$dir HOME=${HOME:-$work}
  # Programs that one process compiled serve the next: of a thousand kernels each takes a good part of a second.
  export __GL_SHADER_DISK_CACHE=1 __GL_SHADER_DISK_CACHE_PATH=${GPU_ROUND_CACHE:-$dir/cache} \
    __GL_SHADER_DISK_CACHE_SKIP_CLEANUP=1 MESA_SHADER_CACHE_DIR=${GPU_ROUND_CACHE:-$dir/cache}
  mkdir -p "$__GL_SHADER_DISK_CACHE_PATH"
  check_glibc
  describe_machine 2>&1 | tee "$work/log/machine.log"
  set_up_libraries >"$work/log/libraries.log" 2>&1
  cat "$work/log/libraries.log"

  local commit name software=() device=0
  commit=$(cat "$dir/COMMIT")
  [ $allow_software -eq 1 ] || software=(--require-hardware)
  EGL_LOG_LEVEL=debug timeout 60 "$dir/bin/drape_bench" device "${software[@]}" >"$work/log/device.log" 2>&1 || device=$?
  cat "$work/log/device.log"
  { say "Drape $commit"; grep -E '^(renderer|version|kind):' "$work/log/device.log" || :; say ""; } >"$work/summary.txt"
  if [ $device -ne 0 ]; then
    ls -lR /usr/share/glvnd /etc/glvnd /usr/local/nvidia /usr/share/egl 2>&1 | head -n 200 | tee "$work/log/places.log" || :
    [ $device -eq 3 ] && say "THE GL BACKEND WOULD RUN IN SOFTWARE" >>"$work/summary.txt"
    keep
    die "no hardware OpenGL 4.5 (drape_bench device: exit status $device); --allow-software accepts a software renderer" 3
  fi

  local short='-*Long.*:*Long/*' scene
  smoke_of smoke_gl gl_test "$short"
  smoke_of smoke_gl_compute gl_compute_test "$smoke"
  smoke_of smoke_parity parity_test "$smoke"

  # Only this machine can give these, and nothing else may run beside them.
  local share share_s backends
  for share in "${speed_parts[@]}"; do
    name=${share%:*}
    backends=()
    [ "$name" != cost ] || backends=(--backends=cpu,gl,gl_both_ends,gl_elimination)  # the ways to solve strips
    share_s=$(((speed_s * ${share#*:} + 99) / 100))
    # A row that has begun when the share is used up may take a while longer. The service is `draped` beside
    # drape_bench.
    part bench "speed_$name" $((share_s + 20)) "$dir/bin/drape_bench" speed --parts="$name" "${backends[@]}" --out="$work/bench" \
      --budget-s="$share_s" --row-s=0.5 --commit="$commit" --invoked-as=drape_bench
  done
  part bench bench $((bench_s + 20)) "$dir/bin/drape_bench" all --out="$work/bench" --budget-s="$bench_s" --row-s=0.5 \
    --commit="$commit" --invoked-as=drape_bench

  # Tests at the same time: they wait for compilers more than for the device.
  for name in "${suites[@]}"; do
    start_suite test "${name%_test}" "$short" "$name" "${shards[$name]:-1}"
  done
  for scene in sphere_drop skirt; do
    start test "scene_$scene" "$dir/bin/drape" run "$dir/client/examples/$scene.json" --backend=gl --compare=reference \
      --every=30 --report="$work/log/$scene.json"
  done
  for name in "${long_suites[@]}"; do start_suite long "${name%_test}_long" '*Long.*:*Long/*' "$name" 1; done
  finish

  { say ""; [ $failures -eq 0 ] && say "all parts passed" || say "$failures PARTS FAILED"; } >>"$work/summary.txt"
  keep
  printf '\n'
  cat "$work/summary.txt"
  say "results: $out/results.tar.gz"
  [ $failures -eq 0 ]
}

case ${1:-} in
  pack) [ $# -eq 2 ] || { usage >&2; exit 2; }; pack "$2" ;;
  run) shift; run "$@" ;;
  help | --help | -h) usage ;;
  *) usage >&2; exit 2 ;;
esac

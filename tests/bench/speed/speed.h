// The subcommand `speed`: the cost of a cloth, its causes, and the costs of other programs; see
// README.md.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/bench/bench.h"

namespace drape::bench {

// Time against strain of hanging cloths -> speed_curve.csv.
struct CurveOptions {
  uint32_t cloths = 64;
  uint32_t side = 32;                // particles
  uint32_t frames = 240;             // of 1/60 s, from the horizontal start
  uint32_t window_frames = 60;       // strain counts in the last of them
  double thread_s = 3;               // timed frames with one thread: no more after that long
  double play_s = 60;                // a setting that would take longer is left out and told
  std::vector<std::string> methods;  // further settings, as of `accuracy --method`
};
void MeasureCurve(Bench& bench, CurveOptions options);

// The best that the machine can do -> speed_limits.csv.
struct LimitsOptions {
  double seconds = 0.1;  // of each of the repeats of a limit
};
void MeasureLimits(Bench& bench, const LimitsOptions& options);

// ms per step against the number of cloths and against the particles of one -> speed_cost.csv.
struct CostOptions {
  std::vector<uint32_t> counts = {1, 2, 3, 4, 5, 6, 8, 12, 16, 32, 64, 160, 256, 1024, 4096, 16384};
  std::vector<uint32_t> few_counts = {1, 8, 16, 64, 1024};  // of PAPER and ACCURATE
  uint32_t cloth_particles = 1024;                          // of each of several cloths
  std::vector<uint32_t> particles = {64,   128,  256,   512,   1024,  2048,
                                     4096, 8192, 16384, 65536, 262144};  // of the one cloth
  double longest_step_s = 2;  // a way of stepping whose step would take longer leaves the row out
};
void MeasureCost(Bench& bench, CostOptions options);

// Whether a cloth costs the same among few and many, and a particle in small cloths and large ones
// -> speed_flatness.csv.
struct FlatnessOptions {
  std::vector<uint32_t> counts = {64, 256, 1024, 4096};
  uint32_t cloth_particles = 1024;
  std::vector<uint32_t> particles = {1024, 2048, 4096, 8192, 16384, 65536};  // of the one cloth
  uint32_t rounds = 12;  // after one that does not count
  double turn_s = 0.1;   // of each size in a round, at least one step
};
void MeasureFlatness(Bench& bench, FlatnessOptions options);

// Step requests over localhost against the bare backend -> speed_service.csv.
struct ServiceLoad {
  uint32_t clients = 1;
  uint32_t cloths = 1;  // of each client
};
struct ServiceOptions {
  std::vector<ServiceLoad> loads = {{1, 1}, {1, 16}, {1, 64}, {1, 1024}, {8, 8}, {8, 64}, {64, 1}};
  uint32_t side = 32;   // particles
  uint32_t turns = 8;   // of service and bare backend, after one that does not count
  double turn_s = 0.2;  // of each
  // Of several clients: at both ends of a turn some of them are alone, which is to count little.
  uint32_t turns_of_several = 3;
  double turn_of_several_s = 1;
};
void MeasureService(Bench& bench, ServiceOptions options);

// Work that a scene does not need, with and without -> speed_skips.csv.
struct SkipsOptions {
  uint32_t cloths = 64;
  uint32_t side = 32;  // particles
  uint32_t turns = 3;  // of both in turn, after one that does not count
  uint32_t steps = 10;
};
void MeasureSkips(Bench& bench, SkipsOptions options);

// Cloths that hold different particles, or whose colliders move, against equal ones and resting
// colliders -> speed_unlike.csv.
struct UnlikeOptions {
  uint32_t cloths = 64;
  std::vector<uint32_t> sides = {16, 32};  // particles
  uint32_t lead_steps = 30;
  uint32_t rounds = 15;             // of both in turn, after one that does not count
  uint32_t steps = 10;              // of each in a round, always the same ones
  std::vector<std::string> only{};  // differences by their names; empty: all
};
void MeasureUnlike(Bench& bench, UnlikeOptions options);

// Fabrics and garments, in turn with the bare sheet -> speed_fabrics.csv.
struct FabricsOptions {
  std::vector<uint32_t> counts = {1, 64};
  uint32_t side = 32;    // particles of the sheets
  double cell_m = 0.04;  // of the garments
  double lead_s = 1;     // before the first round
  uint32_t rounds = 9;
  double turn_s = 0.1;
};
void MeasureFabrics(Bench& bench, FabricsOptions options);

// Steps of the backend gl with each local size -> speed_local_sizes.csv;
// several small sheets in one work group -> speed_packing.csv.
struct LocalSizesLoad {
  uint32_t cloths = 1;
  uint32_t particles = 0;  // of each
};
struct LocalSizesOptions {
  std::vector<std::string> presets = {"REALTIME", "PAPER"};
  // As many cloths as keep the device busy, and few. On hardware time may be short: what matters
  // most comes first.
  std::vector<LocalSizesLoad> software_loads = {{256, 16}, {64, 64},  {16, 256}, {8, 1024},
                                                {1, 1024}, {1, 4096}, {4, 4096}};
  std::vector<LocalSizesLoad> hardware_loads = {{1, 1024},   {1024, 1024}, {4096, 1024},
                                                {1, 65536},  {1, 262144},  {4096, 256},
                                                {16384, 64}, {16384, 16},  {64, 4096}};
  std::vector<uint32_t> sizes = {8, 16, 32, 64, 128, 256, 512, 1024};
  std::vector<uint32_t> packed_sides = {4, 6, 8};  // particles along a side of the packed sheets
  std::vector<uint32_t> sheets_per_group = {1, 2, 4, 8};
  uint32_t software_packed_sheets = 128, hardware_packed_sheets = 16384;  // of all work groups
  uint32_t rounds = 8;   // after one that does not count
  double turn_s = 0.05;  // of each size in a round, at least one step
};
void MeasureLocalSizes(Bench& bench, LocalSizesOptions options);

// The cloths whose kernels are counted, on the backend gl -> speed_kernels.csv.
struct KernelTimesOptions {
  static constexpr const char* kBuiltIn = "built_in";
  // That take turns: kBuiltIn or folders whose files replace the built-in shaders.
  std::vector<std::string> shader_dirs = {kBuiltIn};
  std::vector<std::string> cloths;  // only these; empty: all
  std::vector<uint32_t> counts;     // of cloths at once; empty: by the device
  std::vector<uint32_t> software_counts = {1, 4}, hardware_counts = {1, 1024};
  uint32_t most_particles_of_many = 1024;  // larger ones are measured alone
  uint32_t rounds = 7;                     // after one that does not count
  double turn_s = 0.03;                    // of each in a round, at least one step
};
void MeasureKernelTimes(Bench& bench, KernelTimesOptions options);

// In the order in which they are measured.
inline constexpr std::array kSpeedParts = {"limits",      "cost",   "flatness", "unlike",
                                           "fabrics",     "skips",  "service",  "curve",
                                           "local_sizes", "kernels"};

struct SpeedOptions {
  // Some of kSpeedParts; local_sizes and kernels only on request.
  std::vector<std::string> parts = {"limits",  "cost",  "flatness", "unlike",
                                    "fabrics", "skips", "service",  "curve"};
  LimitsOptions limits;
  CostOptions cost;
  FlatnessOptions flatness;
  UnlikeOptions unlike;
  FabricsOptions fabrics;
  CurveOptions curve;
  ServiceOptions service;
  SkipsOptions skips;
  LocalSizesOptions local_sizes;
  KernelTimesOptions kernels;
};
void MeasureSpeed(Bench& bench, const SpeedOptions& options);

}  // namespace drape::bench

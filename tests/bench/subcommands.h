// One function per subcommand of drape_bench, each in the file of its name: measures and writes its
// tables. Choices that only one subcommand has are in its options.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/bench/bench.h"
#include "tests/bench/bench_scenes.h"

namespace drape::bench {

// Figure 3c of the paper -> cloths.csv.
struct ClothsOptions {
  std::vector<uint32_t> counts = {1, 4, 16, 64, 256};
  std::vector<uint32_t> particles = {64, 128, 256, 512, 1024};
  std::vector<std::string> presets = {"PAPER", "REALTIME"};
};
void MeasureCloths(Bench& bench, ClothsOptions options);

// Figure 3b -> particles.csv.
struct ParticlesOptions {
  std::vector<uint32_t> particles = {64, 128, 256, 512, 1024, 2048, 4096, 16384, 65536};
  std::vector<std::string> presets = {"PAPER", "REALTIME"};
};
void MeasureParticles(Bench& bench, ParticlesOptions options);

// Figure 4 -> figure_4_motion.csv, figure_4.csv.
struct Figure4Options {
  uint32_t side = 256;  // particles along each side of the sheet
  double duration_s = 2.5;
  std::vector<std::string> presets = {"REALTIME", "PAPER"};
};
void MeasureFigure4(Bench& bench, Figure4Options options);

// Section 3.3, the order of the colours -> order.csv.
struct OrderOptions {
  uint32_t seeds = 25;
};
void MeasureOrder(Bench& bench, OrderOptions options);

// Section 3.5, frame budgets -> budget.csv.
struct BudgetOptions {
  std::vector<double> budgets_ms = {0.2, 0.5, 1, 2};
  uint32_t particles = 1024;
  uint32_t steps = 2000;  // a tenth of it on gl
};
void MeasureBudget(Bench& bench, BudgetOptions options);

// Bodies that touch and hang together -> bodies.csv.
struct BodiesOptions {
  std::vector<std::string> scenes;  // empty: all
  uint32_t steps = 90;              // from the start, all of them counted
};
void MeasureBodies(Bench& bench, BodiesOptions options);

// The renderer without requests -> pictures.csv.
struct PicturesOptions {
  uint32_t tiles = 64;
  uint32_t edge_px = 128;  // of a tile
  uint32_t rounds = 9;     // every way in turn
};
void MeasurePictures(Bench& bench, PicturesOptions options);

// Prints the GL devices and what the backend "gl" runs on. Exit status: 0, or 3 if that is
// software and `needs_hardware`, or 4 if there is none.
int ShowDevice(bool needs_hardware);

}  // namespace drape::bench

// The subcommand `contact`: what self-collision costs and keeps.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/bench/bench.h"

namespace drape::bench {

struct ContactOptions {
  std::vector<std::string> scenes;  // only these; empty: all
  std::vector<uint32_t> sides = {32, 64};
  std::vector<uint32_t> counts = {1, 64};  // of cloths; several only of the first size
  std::vector<uint32_t> substeps = {52};
  double thickness_m = 0.003;
  uint32_t threads = 1;   // of the backend; not in the tables, which are of one
  std::string positions;  // a file of them; not empty: CountCrossings instead
};
// -> contact.csv and contact_frames.csv: on the backend cpu with one thread, each cloth beside the
// same one without self-collision, frame by frame in turn. Times are of the thread, so that other
// work on the machine disturbs them little; of several threads they are what a clock shows.
void MeasureContact(Bench& bench, ContactOptions options);

// Prints, for each frame of a file of float[side * side][3], how many edges cross triangles of a
// sheet of side x side particles there, and its largest strain. 1: the file cannot be read, or does
// not hold whole frames.
int CountCrossings(const std::string& path, uint32_t side);

}  // namespace drape::bench

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
};
// -> contact.csv and contact_frames.csv: on the backend cpu with one thread, each cloth beside the
// same one without self-collision, frame by frame in turn. Times are of the thread, so that other
// work on the machine disturbs them little.
void MeasureContact(Bench& bench, ContactOptions options);

}  // namespace drape::bench

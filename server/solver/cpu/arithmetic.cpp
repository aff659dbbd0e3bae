#include "server/solver/cpu/arithmetic.h"

#include <fstream>

#include "server/solver/cpu/side_by_side/group_step.h"

namespace drape::cpu {
namespace {

// "model name" of the first processor, or "CPU" where the system does not tell.
std::string ProcessorName() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "CPU";
}

}  // namespace

std::string ArithmeticOf(uint32_t lane_count) {
  const std::string lanes =
      lane_count == 1 ? "no lanes"
                      : std::to_string(lane_count) + " lanes (" + SupportedLanes().name + ")";
  return ProcessorName() + ", " + lanes;
}

}  // namespace drape::cpu

#include "tests/emulator/findings.h"

namespace drape::emulator {

const char* NameOf(Fault fault) {
  switch (fault) {
    case Fault::kRace:
      return "race";
    case Fault::kNotVisible:
      return "not visible";
    case Fault::kUnwritten:
      return "unwritten";
    case Fault::kOutOfBounds:
      return "out of bounds";
    case Fault::kBarrier:
      return "barrier in divergent control flow";
    case Fault::kInactiveLane:
      return "inactive lane";
    case Fault::kReadonly:
      return "write to a block that is only read";
  }
  return "";
}

void Findings::Add(Fault fault, const void* place, const void* other_place,
                   const std::string& what) {
  const auto [found, is_new] = findings_.try_emplace(
      {fault, place, other_place},
      Finding{.fault = fault, .place = place, .other_place = other_place, .what = what});
  if (!is_new) ++found->second.count;
}

std::vector<Finding> Findings::all() const {
  std::vector<Finding> all;
  for (const auto& [key, finding] : findings_) all.push_back(finding);
  return all;
}

}  // namespace drape::emulator

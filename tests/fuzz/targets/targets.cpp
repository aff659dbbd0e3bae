#include "tests/fuzz/targets/targets.h"

#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <iterator>

namespace drape::test {

std::span<const FuzzTarget> FuzzTargets() {
  // It reports every text that is not UTF-8.
  static const google::protobuf::LogSilencer silencer;
  static const std::vector<FuzzTarget> all = [] {
    std::vector<FuzzTarget> targets = RequestTargets();
    for (auto more : {SnapshotTargets(), TextTargets()}) {
      std::ranges::move(more, std::back_inserter(targets));
    }
    return targets;
  }();
  return all;
}

const FuzzTarget* FindFuzzTarget(std::string_view name) {
  for (const FuzzTarget& target : FuzzTargets()) {
    if (target.name == name) return &target;
  }
  return nullptr;
}

}  // namespace drape::test

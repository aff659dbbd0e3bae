// What takes bytes of strangers, as functions that a fuzzer can call: the same for fuzz_test, which
// mutates a little with every test run, and for the program drape_fuzz, which searches for hours.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace drape::test {

enum class FuzzOutcome { kUnparsable, kRefused, kAccepted };

struct FuzzTarget {
  // Of its folder in tests/fuzz/corpus, too.
  std::string name;
  // Aborts (DRAPE_CHECK) where values get through that must not, or a refusal is not clear.
  std::function<FuzzOutcome(std::string_view bytes)> run;
  // Good inputs to begin with.
  std::function<std::vector<std::string>()> seeds;
  // Another input that can be parsed, of one that can: fields change, the form stays. Empty: there
  // is no form.
  std::function<std::string(std::string_view bytes, uint32_t seed)> mutate = {};
};

std::span<const FuzzTarget> FuzzTargets();
// Null: there is none of the name.
const FuzzTarget* FindFuzzTarget(std::string_view name);

// The parts of FuzzTargets().
std::vector<FuzzTarget> RequestTargets();
std::vector<FuzzTarget> SnapshotTargets();
std::vector<FuzzTarget> TextTargets();

}  // namespace drape::test

// Every target with some thousand mutated inputs, and with the corpus. The mutations are
// pseudo-random with fixed seeds, so a failure repeats.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/fuzz/targets/byte_mutator.h"
#include "tests/fuzz/targets/targets.h"
#include "tests/support/paths/paths.h"

namespace drape::test {
namespace {

constexpr int kRounds = 4000;
// Refused and accepted inputs: fewer would mean that the mutations miss their aim.
constexpr int kMinOfEach = 20;

std::vector<std::string> Names() {
  std::vector<std::string> names;
  for (const FuzzTarget& target : FuzzTargets()) names.push_back(target.name);
  return names;
}

class Fuzz : public testing::TestWithParam<std::string> {
 protected:
  const FuzzTarget& target() const { return *FindFuzzTarget(GetParam()); }
};
INSTANTIATE_TEST_SUITE_P(Targets, Fuzz, testing::ValuesIn(Names()),
                         [](const auto& test) { return test.param; });

TEST_P(Fuzz, MutatedInputsAreRefusedOrSound) {
  const std::vector<std::string> seeds = target().seeds();
  ASSERT_FALSE(seeds.empty());
  for (const std::string& seed : seeds) EXPECT_EQ(target().run(seed), FuzzOutcome::kAccepted);
  ByteMutator mutator(1);
  std::map<FuzzOutcome, int> outcomes;
  for (uint32_t round = 0; round < kRounds; ++round) {
    const std::string& seed = seeds[mutator.Below(seeds.size())];
    const bool keeps_form = target().mutate && round % 2 == 0;
    ++outcomes[target().run(keeps_form ? target().mutate(seed, round) : mutator.Mutate(seed))];
  }
  EXPECT_GE(outcomes[FuzzOutcome::kRefused], kMinOfEach);
  EXPECT_GE(outcomes[FuzzOutcome::kAccepted], GetParam() == "snapshot_bytes" ? 0 : kMinOfEach);
}

// What the search found worth keeping, and what once failed.
TEST_P(Fuzz, TheCorpus) {
  const std::filesystem::path folder = SourcePath("tests/fuzz/corpus/" + GetParam());
  ASSERT_TRUE(std::filesystem::is_directory(folder)) << folder;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    SCOPED_TRACE(entry.path());
    std::ifstream file(entry.path(), std::ios::binary);
    target().run(std::string(std::istreambuf_iterator<char>(file), {}));
  }
}

}  // namespace
}  // namespace drape::test

#include "server/solver/cpu/step/strain_histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

namespace drape::cpu {
namespace {

std::unique_ptr<StrainHistogram> HistogramOf(const std::vector<double>& strains) {
  auto histogram = std::make_unique<StrainHistogram>();
  for (const double strain : strains) histogram->Add(strain);
  return histogram;
}

// Against sorted strains, for numbers of links at which ranks jump.
TEST(StrainHistogramTest, PercentilesAreThoseOfSortedStrains) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> exponent(-7, 2);
  for (const size_t count : {1u, 2u, 9u, 10u, 11u, 99u, 100u, 101u, 2000u}) {
    std::vector<double> strains;
    for (size_t k = 0; k < count; ++k) {
      strains.push_back((k % 2 == 0 ? 1 : -1) * std::pow(10, exponent(random)));
    }
    const auto histogram = HistogramOf(strains);
    for (double& strain : strains) strain = std::abs(strain);
    std::sort(strains.begin(), strains.end());
    for (uint32_t percent = 1; percent <= 100; ++percent) {
      const double exact = strains[(count * percent + 99) / 100 - 1];
      const double found = histogram->Percentile(percent);
      EXPECT_LE(found, exact * (1 + 0x1p-24)) << percent << " % of " << count;
      EXPECT_GT(found, exact * (1 - 0x1p-7)) << percent << " % of " << count;
    }
  }
}

TEST(StrainHistogramTest, StrainsOutOfRangeCountAtItsEnds) {
  EXPECT_EQ(StrainHistogram().Percentile(99), 0) << "no links";
  EXPECT_EQ(HistogramOf({0, 0x1.fp-25, 1})->Percentile(50), 0);
  EXPECT_EQ(HistogramOf({0x1p-24})->Percentile(50), 0x1p-24);
  EXPECT_EQ(HistogramOf({253.9})->Percentile(50), 253);
  EXPECT_EQ(HistogramOf({1e30})->Percentile(99), 254);
  EXPECT_EQ(HistogramOf({INFINITY})->Percentile(99), 254);
}

}  // namespace
}  // namespace drape::cpu

#include "server/solver/surface_contact/wakes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <vector>

namespace drape::surface_contact {
namespace {

// Looks at every part in every substep.
struct PatientParts {
  struct Part {
    Wakes<double>::Corners corners;
    double wake = 0;
    uint32_t substep = 0;  // 0: the next one
  };

  double WayOf(const Part& part) const {
    const auto& [i, j, k] = part.corners;
    return std::max({ways[i], ways[j], ways[k]});
  }
  std::vector<uint32_t> Due(uint32_t now, double expected) const {
    std::vector<uint32_t> due;
    for (uint32_t k = 0; k < parts.size(); ++k) {
      const bool is_due = parts[k].substep <= now || WayOf(parts[k]) + expected >= parts[k].wake;
      if (is_due) due.push_back(k);
    }
    return due;
  }

  std::vector<Part> parts;
  std::vector<double> ways;
};

// Every part is found when it is due, and no other, whatever its corners and ways are.
TEST(WakesTest, WhatIsDueIsFound) {
  size_t found = 0, slept = 0;
  for (uint32_t seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    const auto between = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    const auto particles = static_cast<uint32_t>(between(3, 40));
    const auto count = static_cast<uint32_t>(between(1, 150));
    PatientParts expected;
    expected.ways.assign(particles, 0);
    std::vector<Wakes<double>::Corners> corners;
    for (uint32_t k = 0; k < count; ++k) {
      const auto any = [&] { return static_cast<uint32_t>(between(0, particles)); };
      const uint32_t i = any(), j = any();
      corners.push_back({i, j, k % 2 == 0 ? j : any()});
      expected.parts.push_back({corners.back()});
    }
    Wakes<double> wakes;
    wakes.Begin(particles, corners);
    const auto wait = [&](uint32_t part, double way, uint32_t substep) {
      wakes.Wait(part, way, substep);
      expected.parts[part].wake = expected.WayOf(expected.parts[part]) + way;
      expected.parts[part].substep = substep;
    };
    for (uint32_t k = 0; k < count; ++k) wait(k, between(0, 3), Wakes<double>::kNever);
    for (uint32_t substep = 1; substep < 60; ++substep) {
      const double reach = between(0, 0.3);
      const std::vector<uint32_t> due = expected.Due(substep, reach);
      const auto found_due = wakes.FindDue(substep, reach);
      ASSERT_EQ(std::vector<uint32_t>(found_due.begin(), found_due.end()), due) << seed;
      found += due.size();
      slept += count - due.size();
      for (const uint32_t part : due) {
        const double choice = between(0, 3);
        if (choice < 1) {
          wakes.LookAgain(part);
          expected.parts[part].substep = 0;
        } else {
          wait(part, between(0, 1), choice < 2 ? substep + 4 : Wakes<double>::kNever);
        }
      }
      for (uint32_t i = 0; i < particles; ++i) {
        const double way = between(-0.2, 0.1);
        if (way <= 0) continue;
        wakes.Move(i, way);
        expected.ways[i] += way;
      }
      for (uint32_t k = 0; k < count; ++k) {
        ASSERT_EQ(wakes.WayOf(k), expected.WayOf(expected.parts[k]));
      }
    }
  }
  EXPECT_GT(found, 20000u);
  EXPECT_GT(slept, 20000u);
}

TEST(WakesTest, ASearchBeginsAnew) {
  Wakes<float> wakes;
  wakes.Begin(3, {{0, 1, 2}});
  wakes.Wait(0, 0.1f, 2);
  wakes.Move(1, 0.5f);
  EXPECT_EQ(wakes.FindDue(1, 0).size(), 1u);
  wakes.LookAgain(0);
  wakes.Begin(2, {{0, 1, 1}, {1, 0, 0}});
  for (const size_t part : {0, 1}) wakes.Wait(part, 1);
  EXPECT_EQ(wakes.WayOf(0), 0);
  EXPECT_TRUE(wakes.FindDue(2, 0.5f).empty());
  EXPECT_FALSE(wakes.MayBeNear(0, 0.5f));
  EXPECT_TRUE(wakes.MayBeNear(0, 1));
  wakes.Begin(0, {});
  EXPECT_TRUE(wakes.FindDue(3, 100).empty());
}

}  // namespace
}  // namespace drape::surface_contact

#include "server/solver/gl_compute/collider_looks.h"

#include <gtest/gtest.h>

#include <string>

namespace drape {
namespace {

// A letter for each step: l looked in vain, F looked and found, . did not look. `is_far`: for each
// step whether there is anything to find.
std::string Looks(const std::string& is_far, uint32_t pause) {
  ColliderLooks looks;
  std::string steps;
  for (const char far : is_far) {
    const bool finds = looks.is_due() && far == '1';
    steps += !looks.is_due() ? '.' : finds ? 'F' : 'l';
    looks.AfterStep(finds, pause);
  }
  return steps;
}

TEST(ColliderLooksTest, PausesAfterFourInVainAndAfterEachThatFollows) {
  EXPECT_EQ(Looks("0000000000000000", 3), "llll...l...l...l");
}

TEST(ColliderLooksTest, LooksOnWhileItFindsAnything) {
  EXPECT_EQ(Looks("1111111100011111", 3), "FFFFFFFFlllFFFFF");
}

TEST(ColliderLooksTest, WhatItFindsAfterAPauseEndsThePauses) {
  EXPECT_EQ(Looks("0000011111000000", 3), "llll...FFFllll..");
}

TEST(ColliderLooksTest, WithoutAPauseEveryStepLooks) {
  EXPECT_EQ(Looks("0000000000000000", 0), "llllllllllllllll");
}

}  // namespace
}  // namespace drape

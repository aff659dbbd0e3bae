#include "server/core/patient_clock.h"

#include <gtest/gtest.h>

namespace drape {
namespace {

TEST(PatientClock, AGapCountsForABeat) {
  FakeClock clock;
  const PatientClock patient(clock);
  const int64_t start_us = patient.NowUs();
  clock.AdvanceUs(PatientClock::kMostGap_us);
  EXPECT_EQ(patient.NowUs() - start_us, PatientClock::kMostGap_us);
  clock.AdvanceUs(30'000'000);  // nobody looked in between
  EXPECT_EQ(patient.NowUs() - start_us, PatientClock::kMostGap_us + PatientClock::kBeat_us);
  clock.AdvanceUs(100);
  EXPECT_EQ(patient.NowUs() - start_us, PatientClock::kMostGap_us + PatientClock::kBeat_us + 100);
}

TEST(PatientClock, LooksByItself) {
  const SteadyClock clock;
  const PatientClock patient(clock);
  const int64_t start_us = patient.NowUs();
  const int64_t real_start_us = clock.NowUs();
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  const int64_t real_us = clock.NowUs() - real_start_us;
  // More than the largest gap has passed, in beats that count (a loaded machine may skip some).
  EXPECT_GT(patient.NowUs() - start_us, PatientClock::kMostGap_us);
  EXPECT_LE(patient.NowUs() - start_us, real_us + 100'000);
}

}  // namespace
}  // namespace drape

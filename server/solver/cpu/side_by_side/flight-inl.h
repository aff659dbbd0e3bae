// Cloths that could touch themselves, but are expected not to: whether they fly as expected
// (step/expected_flight.h). Compiled once per instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_FLIGHT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_FLIGHT_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_FLIGHT_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_FLIGHT_INL_H_
#endif

#include <limits>

#include "server/solver/cpu/side_by_side/state-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// Particle i ends the substep here.
HWY_INLINE void SeeEnd(ClothFlight& flight, uint32_t i, const VectorsCloths& place) {
  const ClothParticle& expected = flight.expected[i];
  const VectorsCloths drift = (place - expected.p) - expected.u * flight.time;
  ClothBox& box = flight.drifts;
  box.low = {Min(box.low.x, drift.x), Min(box.low.y, drift.y), Min(box.low.z, drift.z)};
  box.high = {Max(box.high.x, drift.x), Max(box.high.y, drift.y), Max(box.high.z, drift.z)};
}

// All particles have ended the substep, if there was one.
void JudgeFlight(ClothFlight& flight) {
  if (flight.expected == nullptr || flight.time == 0) return;
  const VectorsCloths size = flight.drifts.high - flight.drifts.low;
  flight.is_kept &= flight.drift >= Sqrt(Dot(size, size));
  flight.since_start += flight.substep_s;
}

// The ends of the next substep follow; those of the last one have been seen.
void NextFlightSubstep(ClothFlight& flight) {
  if (flight.expected == nullptr) return;
  JudgeFlight(flight);
  flight.time = flight.since_start + flight.substep_s;
  const VecCloths most = SplatCloths(std::numeric_limits<float>::max());
  flight.drifts = {{most, most, most}, {-most, -most, -most}};
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
